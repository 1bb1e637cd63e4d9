use plotters::prelude::{DrawingBackend, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{
    Color, FontDesc, FontFamily, FontStyle, FontTransform, RGBColor, ShapeStyle, TextStyle,
};

use crate::colour::{BLACK, Rgb, WHITE};
use crate::drawing::{Anchor, Drawing, Shape, Text};
use crate::geometry::Spot;
use crate::typeface::SVG_FAMILIES;

/// Steps of the coordinate grid: plotters' backends take whole numbers.
const STEPS_PER_MM: f64 = 100.0;

/// The page as an SVG document whose size is stated in millimetres.
pub(crate) fn document(drawing: &Drawing) -> Result<String, String> {
    let size = (steps(drawing.width_mm) as u32, steps(drawing.height_mm) as u32);
    let mut text = String::new();
    let mut backend = SVGBackend::with_string(&mut text, size);
    let page = ((0, 0), (size.0 as i32, size.1 as i32));
    backend.draw_rect(page.0, page.1, &ink(WHITE), true).map_err(|error| error.to_string())?;
    for shape in &drawing.shapes {
        draw(&mut backend, shape)?;
    }
    backend.present().map_err(|error| error.to_string())?;
    drop(backend);
    Ok(tidied(&text, drawing))
}

/// States the size in millimetres, rounds the corners of lines and leaves out attributes that say the default.
fn tidied(text: &str, drawing: &Drawing) -> String {
    let size = format!("width=\"{}\" height=\"{}\"", steps(drawing.width_mm), steps(drawing.height_mm));
    let stated = format!(
        "width=\"{:.2}mm\" height=\"{:.2}mm\" stroke-linejoin=\"round\"",
        drawing.width_mm, drawing.height_mm
    );
    text.replacen(&size, &stated, 1).replace(" opacity=\"1\"", "").replace(" stroke=\"none\"", "")
}

fn draw(backend: &mut SVGBackend, shape: &Shape) -> Result<(), String> {
    let drawn = match shape {
        Shape::Line { points, width_mm, colour } => {
            let stroke_width = steps(*width_mm).max(1) as u32;
            backend.draw_path(on_grid(points), &ShapeStyle { stroke_width, ..ink(*colour) })
        }
        Shape::Area { points, fill } => backend.fill_polygon(on_grid(points), &ink(*fill)),
        Shape::Box { frame, fill } => {
            let corners = (place((frame.left, frame.top)), place((frame.right, frame.bottom)));
            backend.draw_rect(corners.0, corners.1, &ink(*fill), true)
        }
        Shape::Disc { centre, radius_mm, fill } => {
            backend.draw_circle(place(*centre), steps(*radius_mm).max(1) as u32, &ink(*fill), true)
        }
        Shape::Text(text) => {
            let (style, spot) = placed(text);
            backend.draw_text(&text.text, &style, place(spot))
        }
    };
    drawn.map_err(|error| error.to_string())
}

/// A text's style and spot. The backend moves text down by 0.76 em from its spot (plotters' `VPos::Top`) and states the font's size as size / 1.24,
/// so both are undone here.
fn placed(text: &Text) -> (TextStyle<'static>, Spot) {
    let (x, y) = text.at;
    let lift_mm = 0.76 * text.em_mm;
    let (spot, transform) = if text.upwards {
        ((x - lift_mm, y), FontTransform::Rotate270)
    } else {
        ((x, y - lift_mm), FontTransform::None)
    };
    let h_pos = match text.anchor {
        Anchor::Start => HPos::Left,
        Anchor::Middle => HPos::Center,
        Anchor::End => HPos::Right,
    };
    let size = 1.24 * (STEPS_PER_MM * text.em_mm).round();
    let font = FontDesc::new(FontFamily::Name(SVG_FAMILIES), size, FontStyle::Normal).transform(transform);
    let colour = rgb(BLACK).to_backend_color();
    (TextStyle { font, color: colour, pos: Pos::new(h_pos, VPos::Top) }, spot)
}

fn on_grid(points: &[Spot]) -> Vec<(i32, i32)> {
    let mut on_grid: Vec<(i32, i32)> = points.iter().map(|&spot| place(spot)).collect();
    on_grid.dedup();
    on_grid
}

fn place((x, y): Spot) -> (i32, i32) {
    (steps(x), steps(y))
}

fn steps(length_mm: f64) -> i32 {
    (STEPS_PER_MM * length_mm).round() as i32
}

fn rgb(Rgb(r, g, b): Rgb) -> RGBColor {
    RGBColor(r, g, b)
}

fn ink(colour: Rgb) -> ShapeStyle {
    rgb(colour).filled()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::{Dash, LABEL_MM, Stroke};

    #[test]
    fn the_document_states_its_size_and_its_text() {
        let mut drawing = Drawing::new(Drawing::ONE_COLUMN_MM).unwrap();
        drawing.extend_to(40.0);
        drawing.text("a < b", (10.0, 10.0), LABEL_MM, Anchor::Middle);
        drawing.upward_text("time (ms)", (5.0, 20.0), LABEL_MM);
        drawing.segment((1.0, 1.0), (2.0, 2.0), Stroke::axis());
        drawing.line(&[(3.0, 1.0), (9.0, 2.0)], Stroke::new(1.0, WHITE, Dash::Dashed));
        let text = document(&drawing).unwrap();
        assert!(text.contains("width=\"86.00mm\" height=\"40.00mm\""), "{text}");
        assert!(text.contains("a &lt; b") && text.contains("time (ms)"));
        assert!(text.contains("font-size=\"282\"") && text.contains("text-anchor=\"middle\""), "{text}");
        assert!(text.contains("rotate(270"));
        assert!(text.trim_end().ends_with("</svg>"));
    }
}
