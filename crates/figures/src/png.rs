use std::path::Path;

use plotters::prelude::{BitMapBackend, DrawingBackend};
use plotters::style::{Color, RGBColor};

use crate::colour::{BLACK, Rgb, WHITE};
use crate::drawing::{Anchor, Drawing, Shape, Text};
use crate::geometry::Spot;

/// Pixels per millimetre of the file: 300 per inch.
const PIXELS_PER_MM: f64 = 300.0 / 25.4;
/// Drawn this much finer and then averaged, which smooths every edge (plotters' bitmaps have hard ones).
const OVERSAMPLING: usize = 3;
const FINE_PER_MM: f64 = PIXELS_PER_MM * OVERSAMPLING as f64;

/// Writes the page as a bitmap of 300 pixels per inch; the path must end in `.png`.
pub(crate) fn save(drawing: &Drawing, path: &Path) -> Result<(), String> {
    let (width, height) = size_px(drawing);
    let pixels = averaged(&fine_pixels(drawing)?, width, height);
    let mut backend = BitMapBackend::new(path, (width as u32, height as u32));
    backend
        .blit_bitmap((0, 0), (width as u32, height as u32), &pixels)
        .and_then(|()| backend.present())
        .map_err(|error| error.to_string())
}

fn size_px(drawing: &Drawing) -> (usize, usize) {
    let pixels = |length_mm: f64| (length_mm * PIXELS_PER_MM).ceil().max(1.0) as usize;
    (pixels(drawing.width_mm), pixels(drawing.height_mm))
}

/// The oversampled page: rows from the top, three bytes a pixel.
fn fine_pixels(drawing: &Drawing) -> Result<Vec<u8>, String> {
    let (width, height) = size_px(drawing);
    let (width, height) = (width * OVERSAMPLING, height * OVERSAMPLING);
    let Rgb(white, ..) = WHITE;
    let mut pixels = vec![white; 3 * width * height];
    let mut backend = BitMapBackend::with_buffer(&mut pixels, (width as u32, height as u32));
    for shape in &drawing.shapes {
        draw(&mut backend, shape, drawing)?;
    }
    backend.present().map_err(|error| error.to_string())?;
    drop(backend);
    Ok(pixels)
}

/// The mean of each block of `OVERSAMPLING` by `OVERSAMPLING` fine pixels.
fn averaged(fine: &[u8], width: usize, height: usize) -> Vec<u8> {
    let n = OVERSAMPLING;
    let stride = 3 * n * width;
    let mut pixels = Vec::with_capacity(3 * width * height);
    let mut sums = vec![0_u32; 3 * width];
    for band in fine.chunks_exact(n * stride) {
        sums.fill(0);
        for row in band.chunks_exact(stride) {
            for (sum, block) in sums.chunks_exact_mut(3).zip(row.chunks_exact(3 * n)) {
                for pixel in block.chunks_exact(3) {
                    sum.iter_mut().zip(pixel).for_each(|(sum, &byte)| *sum += u32::from(byte));
                }
            }
        }
        let count = (n * n) as u32;
        pixels.extend(sums.iter().map(|sum| ((sum + count / 2) / count) as u8));
    }
    pixels
}

fn draw(backend: &mut BitMapBackend, shape: &Shape, drawing: &Drawing) -> Result<(), String> {
    match shape {
        Shape::Line { points, width_mm, colour } => draw_line(backend, points, *width_mm, *colour),
        Shape::Area { points, fill } => fill_polygon(backend, points, *fill),
        Shape::Box { frame, fill } => {
            let ((left, top), (right, bottom)) =
                (place((frame.left, frame.top)), place((frame.right, frame.bottom)));
            backend
                .draw_rect((left, top), (right, bottom), &rgb(*fill).filled(), true)
                .map_err(|error| error.to_string())
        }
        Shape::Disc { centre, radius_mm, fill } => draw_disc(backend, *centre, *radius_mm, *fill),
        Shape::Text(text) => draw_text(backend, text, drawing),
    }
}

/// A line as one quadrilateral a segment with round joints between them.
fn draw_line(backend: &mut BitMapBackend, points: &[Spot], width_mm: f64, colour: Rgb) -> Result<(), String> {
    let half = 0.5 * width_mm;
    for pair in points.windows(2) {
        let ((x0, y0), (x1, y1)) = (pair[0], pair[1]);
        let length = (x1 - x0).hypot(y1 - y0);
        if length > 0.0 {
            let (dx, dy) = (half * (y1 - y0) / length, half * (x0 - x1) / length);
            let corners = [(x0 + dx, y0 + dy), (x1 + dx, y1 + dy), (x1 - dx, y1 - dy), (x0 - dx, y0 - dy)];
            fill_polygon(backend, &corners, colour)?;
        }
    }
    let turns = points.windows(3).filter(|corner| turns_notably(corner));
    turns.map(|corner| corner[1]).try_for_each(|joint| draw_disc(backend, joint, half, colour))
}

/// Whether a line turns by more than about 10 degrees; below that the notch of the joint is finer than a pixel, and a round
/// joint near the end of a dash would lengthen it.
fn turns_notably(corner: &[Spot]) -> bool {
    let step = |from: Spot, to: Spot| (to.0 - from.0, to.1 - from.1);
    let (before, after) = (step(corner[0], corner[1]), step(corner[1], corner[2]));
    let along = before.0 * after.0 + before.1 * after.1;
    along < 0.985 * before.0.hypot(before.1) * after.0.hypot(after.1)
}

fn draw_disc(backend: &mut BitMapBackend, (x, y): Spot, radius_mm: f64, colour: Rgb) -> Result<(), String> {
    let n_corners = 24;
    let corner = |i: i32| {
        let (sine, cosine) = (std::f64::consts::TAU * f64::from(i) / f64::from(n_corners)).sin_cos();
        (x + radius_mm * cosine, y + radius_mm * sine)
    };
    let corners: Vec<Spot> = (0..n_corners).map(corner).collect();
    fill_polygon(backend, &corners, colour)
}

fn fill_polygon(backend: &mut BitMapBackend, points: &[Spot], colour: Rgb) -> Result<(), String> {
    let mut corners: Vec<(i32, i32)> = points.iter().map(|&spot| place(spot)).collect();
    corners.dedup();
    backend.fill_polygon(corners, &rgb(colour).filled()).map_err(|error| error.to_string())
}

fn draw_text(backend: &mut BitMapBackend, text: &Text, drawing: &Drawing) -> Result<(), String> {
    let em_px = text.em_mm * FINE_PER_MM;
    let width = drawing.typeface.width(&text.text, em_px);
    let start = match text.anchor {
        Anchor::Start => 0.0,
        Anchor::Middle => -0.5 * width,
        Anchor::End => -width,
    };
    let start = start.round() as i32;
    let (x0, y0) = place(text.at);
    let mut result = Ok(());
    drawing.typeface.draw(&text.text, em_px, |x, y, coverage| {
        let (x, y) = (x + start, y);
        let spot = if text.upwards { (x0 + y, y0 - x) } else { (x0 + x, y0 + y) };
        let ink = rgb(BLACK).mix(f64::from(coverage.clamp(0.0, 1.0))).to_backend_color();
        if let Err(error) = backend.draw_pixel(spot, ink) {
            result = Err(error.to_string());
        }
    });
    result
}

fn place((x, y): Spot) -> (i32, i32) {
    ((x * FINE_PER_MM).round() as i32, (y * FINE_PER_MM).round() as i32)
}

fn rgb(Rgb(r, g, b): Rgb) -> RGBColor {
    RGBColor(r, g, b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::{Dash, Stroke};

    #[test]
    fn a_line_has_its_width_and_soft_edges() {
        let mut drawing = Drawing::new(20.0).unwrap();
        drawing.extend_to(10.0);
        drawing.segment((2.0, 2.0), (18.0, 8.0), Stroke::new(2.0, BLACK, Dash::Solid));
        let (width, height) = size_px(&drawing);
        let pixels = averaged(&fine_pixels(&drawing).unwrap(), width, height);
        let darkness: f64 = pixels.iter().step_by(3).map(|&byte| 1.0 - f64::from(byte) / 255.0).sum::<f64>();
        let expected = (16.0_f64).hypot(6.0) * 2.0 * 25.4 / 72.0 * PIXELS_PER_MM.powi(2);
        // Polygons of the fine grid include their border pixels, so a line of 25 fine pixels gains up to one.
        assert!((darkness / expected - 1.0).abs() < 0.06, "{darkness} {expected}");
        assert!(pixels.iter().any(|&byte| byte > 50 && byte < 200));
    }
}
