//! The page as a PDF document of one page, with letters as outlines.

use miniz_oxide::deflate::compress_to_vec_zlib;
use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref};

use crate::colour::{BLACK, Rgb};
use crate::drawing::{Drawing, Ink, Raster};
use crate::geometry::{PageRect, PathStep};
use crate::stroke::Stroke;
use crate::style::POINT_MM;

const POINTS_PER_MM: f32 = (1.0 / POINT_MM) as f32;
/// Effort of the compression, of 10.
const COMPRESSION_LEVEL: u8 = 6;

/// The bytes of the file.
pub(crate) fn document(drawing: &Drawing) -> Vec<u8> {
    let mut pdf = Pdf::new();
    let [catalog, pages, page, contents] = [1, 2, 3, 4].map(Ref::new);
    let rasters: Vec<&Raster> = drawing
        .inks
        .iter()
        .filter_map(|ink| match ink {
            Ink::Picture { raster, .. } => Some(raster),
            _ => None,
        })
        .collect();
    pdf.catalog(catalog).pages(pages);
    pdf.pages(pages).kids([page]).count(1);
    let size = [drawing.width_mm, drawing.height_mm].map(|length_mm| length_mm as f32 * POINTS_PER_MM);
    let mut leaf = pdf.page(page);
    leaf.parent(pages).media_box(Rect::new(0.0, 0.0, size[0], size[1])).contents(contents);
    let mut resources = leaf.resources();
    let mut pictures = resources.x_objects();
    for i in 0..rasters.len() {
        pictures.pair(Name(picture_name(i).as_bytes()), picture_ref(i));
    }
    pictures.finish();
    resources.finish();
    leaf.finish();
    for (i, raster) in rasters.into_iter().enumerate() {
        let bytes: Vec<u8> = raster.pixels.iter().flat_map(|&Rgb(r, g, b)| [r, g, b]).collect();
        let packed = compress_to_vec_zlib(&bytes, COMPRESSION_LEVEL);
        let mut image = pdf.image_xobject(picture_ref(i), &packed);
        image.filter(Filter::FlateDecode);
        image.width(raster.width_px as i32).height(raster.height_px as i32);
        image.bits_per_component(8).color_space().device_rgb();
    }
    let packed = compress_to_vec_zlib(&content(drawing), COMPRESSION_LEVEL);
    pdf.stream(contents, &packed).filter(Filter::FlateDecode);
    pdf.finish()
}

fn picture_name(index: usize) -> String {
    format!("Picture{index}")
}

fn picture_ref(index: usize) -> Ref {
    Ref::new(5 + index as i32)
}

/// The page's marks, in millimetres from the top left corner, y down.
fn content(drawing: &Drawing) -> Vec<u8> {
    let mut content = Content::new();
    let top = drawing.height_mm as f32 * POINTS_PER_MM;
    content.transform([POINTS_PER_MM, 0.0, 0.0, -POINTS_PER_MM, 0.0, top]);
    content.set_line_join(LineJoinStyle::RoundJoin);
    let mut n_pictures = 0;
    for ink in &drawing.inks {
        let path = drawing.path(ink);
        match ink {
            Ink::Line { stroke, .. } => {
                set_stroke(&mut content, stroke);
                trace(&mut content, &path);
                content.stroke();
            }
            Ink::Area { fill, .. } | Ink::Disc { fill, .. } => fill_path(&mut content, &path, *fill),
            Ink::Words(_) => fill_path(&mut content, &path, BLACK),
            Ink::Picture { rect, .. } => {
                place(&mut content, rect, n_pictures);
                n_pictures += 1;
            }
        }
    }
    content.finish().to_vec()
}

/// A picture fills the unit square with its first row on top.
fn place(content: &mut Content, rect: &PageRect, index: usize) {
    let [width, height, left, bottom] =
        [rect.width(), rect.height(), rect.left, rect.bottom].map(|x| x as f32);
    content.save_state();
    content.transform([width, 0.0, 0.0, -height, left, bottom]);
    content.x_object(Name(picture_name(index).as_bytes()));
    content.restore_state();
}

fn set_stroke(content: &mut Content, stroke: &Stroke) {
    let [r, g, b] = shares(stroke.colour);
    content.set_stroke_rgb(r, g, b);
    content.set_line_width(stroke.width_mm as f32);
    content.set_dash_pattern(stroke.pattern_mm().into_iter().map(|length| length as f32), 0.0);
    content.set_line_cap(if stroke.is_round() { LineCapStyle::RoundCap } else { LineCapStyle::ButtCap });
}

fn fill_path(content: &mut Content, path: &[PathStep], fill: Rgb) {
    let [r, g, b] = shares(fill);
    content.set_fill_rgb(r, g, b);
    trace(content, path);
    content.fill_nonzero();
}

fn trace(content: &mut Content, path: &[PathStep]) {
    for step in path {
        match *step {
            PathStep::Move((x, y)) => content.move_to(x as f32, y as f32),
            PathStep::Line((x, y)) => content.line_to(x as f32, y as f32),
            PathStep::Cubic(a, b, to) => {
                content.cubic_to(a.0 as f32, a.1 as f32, b.0 as f32, b.1 as f32, to.0 as f32, to.1 as f32)
            }
            PathStep::Close => content.close_path(),
        };
    }
}

fn shares(Rgb(r, g, b): Rgb) -> [f32; 3] {
    [r, g, b].map(|channel| f32::from(channel) / 255.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Style;
    use crate::drawing::{Anchor, Columns};
    use crate::stroke::Dash;

    #[test]
    fn the_page_has_its_size_and_its_pictures() {
        let mut drawing = Drawing::new(&Style::default(), Columns::One).unwrap();
        drawing.extend_to(25.4);
        drawing.text("n", (10.0, 10.0), 3.0, Anchor::Middle);
        drawing.line(&[(3.0, 1.0), (9.0, 2.0)], Stroke::new(1.0, BLACK, Dash::Dotted));
        let raster = Raster { width_px: 2, height_px: 1, pixels: vec![BLACK; 2] };
        drawing.picture(PageRect::new(1.0, 2.0, 3.0, 4.0), raster);
        let bytes = document(&drawing);
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.starts_with("%PDF-1.") && text.trim_end().ends_with("%%EOF"));
        // 86 mm and an inch, in points.
        assert!(text.contains("/MediaBox [0 0 243.77") && text.contains(" 72]"), "{text}");
        assert!(text.contains("/Picture0") && text.contains("/Width 2"));
    }
}
