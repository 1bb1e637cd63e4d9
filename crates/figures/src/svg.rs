//! The page as an SVG document: paths in millimetres, letters as outlines that carry their words, maps as pictures.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use crate::colour::{BLACK, Rgb};
use crate::drawing::{Drawing, Ink, Raster};
use crate::geometry::{PageRect, PathStep, Spot};
use crate::png;
use crate::stroke::Stroke;

/// The document; its size and its coordinates are in millimetres.
pub(crate) fn document(drawing: &Drawing) -> Result<String, String> {
    let (width, height) = (round(drawing.width_mm), round(drawing.height_mm));
    let mut elements = String::new();
    for ink in &drawing.inks {
        element(&mut elements, drawing, ink)?;
    }
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" viewBox=\"0 0 {width} {height}\" \
         stroke-linejoin=\"round\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n{elements}</svg>\n"
    ))
}

fn element(to: &mut String, drawing: &Drawing, ink: &Ink) -> Result<(), String> {
    let path = || path_data(&drawing.path(ink));
    let written = match ink {
        Ink::Line { stroke, .. } => {
            writeln!(to, "<path d=\"{}\" fill=\"none\"{}/>", path(), stroke_attributes(stroke))
        }
        Ink::Area { fill, .. } => writeln!(to, "<path d=\"{}\" fill=\"{}\"/>", path(), hex(*fill)),
        Ink::Disc { centre, radius_mm, fill } => writeln!(
            to,
            "<circle cx=\"{}\" cy=\"{}\" r=\"{}\" fill=\"{}\"/>",
            round(centre.0),
            round(centre.1),
            round(*radius_mm),
            hex(*fill)
        ),
        Ink::Words(words) => {
            let label = escaped(&words.plain());
            writeln!(
                to,
                "<path role=\"img\" aria-label=\"{label}\" d=\"{}\" fill=\"{}\"/>",
                path(),
                hex(BLACK)
            )
        }
        Ink::Picture { rect, raster } => writeln!(to, "{}", image(rect, raster)?),
    };
    written.map_err(|error| error.to_string())
}

fn stroke_attributes(stroke: &Stroke) -> String {
    let mut text = format!(" stroke=\"{}\" stroke-width=\"{}\"", hex(stroke.colour), round(stroke.width_mm));
    let pattern: Vec<String> = stroke.pattern_mm().into_iter().map(round).collect();
    if !pattern.is_empty() {
        text += &format!(" stroke-dasharray=\"{}\"", pattern.join(" "));
    }
    if stroke.is_round() {
        text += " stroke-linecap=\"round\"";
    }
    text
}

/// A grid of pixels stays one picture, so no viewer can show seams between its cells.
fn image(rect: &PageRect, raster: &Raster) -> Result<String, String> {
    Ok(format!(
        "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" style=\"image-rendering:pixelated\" \
         href=\"data:image/png;base64,{}\"/>",
        round(rect.left),
        round(rect.top),
        round(rect.width()),
        round(rect.height()),
        STANDARD.encode(png::of_raster(raster)?)
    ))
}

fn path_data(steps: &[PathStep]) -> String {
    let spot = |(x, y): Spot| format!("{} {}", round(x), round(y));
    let step = |step: &PathStep| match step {
        PathStep::Move(to) => format!("M{}", spot(*to)),
        PathStep::Line(to) => format!("L{}", spot(*to)),
        PathStep::Cubic(first, second, to) => format!("C{} {} {}", spot(*first), spot(*second), spot(*to)),
        PathStep::Close => "Z".into(),
    };
    steps.iter().map(step).collect()
}

/// A length to the micrometre, without zeros at its end.
fn round(length_mm: f64) -> String {
    let text = format!("{length_mm:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

fn hex(Rgb(r, g, b): Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Style;
    use crate::drawing::{Anchor, Columns};
    use crate::stroke::Dash;

    #[test]
    fn the_document_states_its_size_and_its_words() {
        let mut drawing = Drawing::new(&Style::default(), Columns::One).unwrap();
        drawing.extend_to(40.0);
        drawing.text("$a$ < \"b\"", (10.0, 10.0), 3.0, Anchor::Middle);
        drawing.upward_text("time (ms)", (5.0, 20.0), 3.0);
        drawing.line(&[(3.0, 1.0), (9.0, 2.0)], Stroke::new(1.0, BLACK, Dash::Dashed));
        drawing.picture(
            PageRect::new(1.0, 2.0, 3.0, 4.0),
            Raster { width_px: 1, height_px: 1, pixels: vec![BLACK] },
        );
        let document = document(&drawing).unwrap();
        assert!(document.contains("width=\"86mm\" height=\"40mm\" viewBox=\"0 0 86 40\""), "{document}");
        assert!(document.contains("aria-label=\"a &lt; &quot;b&quot;\""), "{document}");
        assert!(document.contains("aria-label=\"time (ms)\"") && document.contains("stroke-dasharray"));
        assert!(document.contains("<image x=\"1\" y=\"2\" width=\"3\" height=\"4\""));
        // Letters are outlines: no font of the viewer is asked for.
        assert!(!document.contains("<text") && !document.contains("font"));
        assert!(document.trim_end().ends_with("</svg>"));
    }
}
