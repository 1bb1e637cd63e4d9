//! The page as a PNG image of 300 pixels per inch.

use tiny_skia::{
    FillRule, FilterQuality, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, PixmapPaint, StrokeDash,
    Transform,
};

use crate::colour::{BLACK, Rgb, WHITE};
use crate::drawing::{Drawing, Ink, Raster};
use crate::geometry::{PageRect, PathStep};
use crate::stroke::Stroke;

const PIXELS_PER_MM: f64 = 300.0 / 25.4;

/// The bytes of the file.
pub(crate) fn encoded(drawing: &Drawing) -> Result<Vec<u8>, String> {
    let pixels = |length_mm: f64| (length_mm * PIXELS_PER_MM).ceil().max(1.0) as u32;
    let (width, height) = (pixels(drawing.width_mm), pixels(drawing.height_mm));
    let mut page = Pixmap::new(width, height).ok_or(format!("a page of {width} by {height} pixels"))?;
    page.fill(colour(WHITE));
    for ink in &drawing.inks {
        draw(&mut page, drawing, ink)?;
    }
    page.encode_png().map_err(|error| error.to_string())
}

/// A grid of pixels as a PNG image of its own.
pub(crate) fn of_raster(raster: &Raster) -> Result<Vec<u8>, String> {
    pixmap(raster)?.encode_png().map_err(|error| error.to_string())
}

fn draw(page: &mut Pixmap, drawing: &Drawing, ink: &Ink) -> Result<(), String> {
    let scale = Transform::from_scale(PIXELS_PER_MM as f32, PIXELS_PER_MM as f32);
    let path = path_of(&drawing.path(ink));
    let fill = |page: &mut Pixmap, fill: Rgb| {
        if let Some(path) = &path {
            page.fill_path(path, &paint(fill), FillRule::Winding, scale, None);
        }
    };
    match ink {
        Ink::Line { stroke, .. } => {
            if let Some(path) = &path {
                page.stroke_path(path, &paint(stroke.colour), &skia_stroke(stroke), scale, None);
            }
        }
        Ink::Area { fill: colour, .. } | Ink::Disc { fill: colour, .. } => fill(page, *colour),
        Ink::Words(_) => fill(page, BLACK),
        Ink::Picture { rect, raster } => draw_raster(page, rect, raster)?,
    }
    Ok(())
}

fn draw_raster(page: &mut Pixmap, rect: &PageRect, raster: &Raster) -> Result<(), String> {
    let of = |length_mm: f64, n: usize| (length_mm * PIXELS_PER_MM / n.max(1) as f64) as f32;
    let place = Transform::from_row(
        of(rect.width(), raster.width_px),
        0.0,
        0.0,
        of(rect.height(), raster.height_px),
        of(rect.left, 1),
        of(rect.top, 1),
    );
    let nearest = PixmapPaint { quality: FilterQuality::Nearest, ..PixmapPaint::default() };
    page.draw_pixmap(0, 0, pixmap(raster)?.as_ref(), &nearest, place, None);
    Ok(())
}

fn pixmap(raster: &Raster) -> Result<Pixmap, String> {
    let told = format!("a picture of {} by {} pixels", raster.width_px, raster.height_px);
    let bytes = raster.pixels.iter().flat_map(|&Rgb(r, g, b)| [r, g, b, 255]).collect();
    let size = tiny_skia::IntSize::from_wh(raster.width_px as u32, raster.height_px as u32);
    size.and_then(|size| Pixmap::from_vec(bytes, size)).ok_or(told)
}

fn path_of(steps: &[PathStep]) -> Option<Path> {
    let mut path = PathBuilder::new();
    for step in steps {
        match *step {
            PathStep::Move((x, y)) => path.move_to(x as f32, y as f32),
            PathStep::Line((x, y)) => path.line_to(x as f32, y as f32),
            PathStep::Cubic(a, b, to) => {
                path.cubic_to(a.0 as f32, a.1 as f32, b.0 as f32, b.1 as f32, to.0 as f32, to.1 as f32);
            }
            PathStep::Close => path.close(),
        }
    }
    path.finish()
}

fn skia_stroke(stroke: &Stroke) -> tiny_skia::Stroke {
    let pattern: Vec<f32> = stroke.pattern_mm().into_iter().map(|length| length as f32).collect();
    tiny_skia::Stroke {
        width: stroke.width_mm as f32,
        line_cap: if stroke.is_round() { LineCap::Round } else { LineCap::Butt },
        line_join: LineJoin::Round,
        dash: StrokeDash::new(pattern, 0.0),
        ..tiny_skia::Stroke::default()
    }
}

fn paint(ink: Rgb) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color(colour(ink));
    paint
}

fn colour(Rgb(r, g, b): Rgb) -> tiny_skia::Color {
    tiny_skia::Color::from_rgba8(r, g, b, 255)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Style;
    use crate::drawing::Columns;
    use crate::stroke::Dash;

    /// How much black each pixel of the page has, from 0 to 1.
    fn darkness(drawing: &Drawing) -> Vec<f64> {
        let page = Pixmap::decode_png(&encoded(drawing).unwrap()).unwrap();
        page.pixels().iter().map(|pixel| 1.0 - f64::from(pixel.green()) / 255.0).collect()
    }

    #[test]
    fn a_line_has_its_width_and_soft_edges() {
        let mut drawing = Drawing::new(&Style::default(), Columns::One).unwrap();
        drawing.extend_to(10.0);
        let stroke = Stroke::new(2.0, BLACK, Dash::Solid);
        drawing.segment((2.0, 2.0), (18.0, 8.0), stroke);
        let darkness = darkness(&drawing);
        let expected = 16.0_f64.hypot(6.0) * stroke.width_mm * PIXELS_PER_MM.powi(2);
        // Coverage is rounded to 8 bits, and to sixteenths where an edge cuts a pixel: two edges of 200 pixels, each off by
        // half a sixteenth at most, of an area of 1650 pixels.
        assert!((darkness.iter().sum::<f64>() / expected - 1.0).abs() < 0.01);
        assert!(darkness.iter().any(|&share| share > 0.2 && share < 0.8));
    }

    #[test]
    fn a_picture_keeps_its_colours() {
        let mut drawing = Drawing::new(&Style::default(), Columns::One).unwrap();
        drawing.extend_to(10.0);
        let raster = Raster { width_px: 2, height_px: 1, pixels: vec![BLACK, WHITE] };
        drawing.picture(PageRect::new(10.0, 0.0, 20.0, 10.0), raster);
        let n_dark = darkness(&drawing).iter().filter(|&&share| share > 0.5).count() as f64;
        // Half of the picture is black; its border is off by half a pixel at most.
        let side = 10.0 * PIXELS_PER_MM;
        assert!((n_dark - side * side).abs() <= 2.0 * (side + 1.0), "{n_dark}");
    }
}
