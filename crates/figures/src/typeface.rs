use ab_glyph::{Font, FontRef, Glyph, PxScale, ScaleFont, point};

use crate::FigureError;

/// The built-in typeface: Noto Sans, from a registry crate, so that no font of the system is needed.
///
/// Text is measured and, for bitmaps, drawn here with the outlines' own side bearings; plotters' `ab_glyph` text leaves
/// those out, which spaces letters unevenly.
#[derive(Debug, Clone)]
pub(crate) struct Typeface {
    font: FontRef<'static>,
}

/// Families for viewers of SVG files, the built-in one first.
pub(crate) const SVG_FAMILIES: &str = "Noto Sans, Arial, Helvetica, sans-serif";

impl Typeface {
    pub(crate) fn built_in() -> Result<Self, FigureError> {
        FontRef::try_from_slice(notosans::REGULAR_TTF)
            .map(|font| Self { font })
            .map_err(|error| FigureError::Typeface { reason: error.to_string() })
    }

    /// Width of a line of text, in the unit of `em`.
    pub(crate) fn width(&self, text: &str, em: f64) -> f64 {
        // One em measured at 1000 pixels keeps the f32 advances exact to a few millionths of an em.
        self.advance(text, 1000.0) * em / 1000.0
    }

    fn advance(&self, text: &str, em_px: f64) -> f64 {
        let font = self.font.as_scaled(self.scale(em_px));
        text.chars().map(|letter| f64::from(font.h_advance(font.glyph_id(letter)))).sum()
    }

    /// Calls `ink(x, y, coverage)` for every pixel that the text touches; the text starts at x = 0 on the base line
    /// y = 0, y down.
    pub(crate) fn draw(&self, text: &str, em_px: f64, mut ink: impl FnMut(i32, i32, f32)) {
        let scale = self.scale(em_px);
        let scaled = self.font.as_scaled(scale);
        let mut pen_px = 0.0;
        for letter in text.chars() {
            let glyph: Glyph = self.font.glyph_id(letter).with_scale_and_position(scale, point(pen_px, 0.0));
            pen_px += scaled.h_advance(glyph.id);
            let Some(outline) = self.font.outline_glyph(glyph) else { continue };
            let corner = outline.px_bounds().min;
            let (left, top) = (corner.x.round() as i32, corner.y.round() as i32);
            outline.draw(|x, y, coverage| ink(left + x as i32, top + y as i32, coverage));
        }
    }

    /// `ab_glyph` scales by the height from ascender to descender, typography by the em.
    fn scale(&self, em_px: f64) -> PxScale {
        let units_per_em = f64::from(self.font.units_per_em().unwrap_or(1000.0));
        PxScale::from((em_px * f64::from(self.font.height_unscaled()) / units_per_em) as f32)
    }

    #[cfg(test)]
    fn has(&self, letter: char) -> bool {
        self.font.glyph_id(letter).0 != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sign_that_figures_use_exists() {
        let typeface = Typeface::built_in().unwrap();
        for letter in "−±·µσΨ…%()/".chars() {
            assert!(typeface.has(letter), "{letter}");
        }
    }

    #[test]
    fn text_is_drawn_where_it_is_measured() {
        let typeface = Typeface::built_in().unwrap();
        let (mut left, mut right, mut top, mut bottom) = (i32::MAX, i32::MIN, i32::MAX, i32::MIN);
        typeface.draw("HHH", 100.0, |x, y, coverage| {
            if coverage > 0.5 {
                (left, right) = (left.min(x), right.max(x));
                (top, bottom) = (top.min(y), bottom.max(y));
            }
        });
        let width = typeface.width("HHH", 100.0);
        // Three letters of 0.74 em with side bearings of about 0.1 em; capitals are 0.714 em high (the font's own data).
        assert!((width - 222.3).abs() < 0.5, "{width}");
        assert!(left > 5 && f64::from(right) < width - 5.0);
        assert!((-73..=-70).contains(&top) && (-2..=0).contains(&bottom), "{top} {bottom}");
    }
}
