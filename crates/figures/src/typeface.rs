//! The built-in typeface: widths of labels and the outlines of their letters, so that no font of the system is needed.

use ttf_parser::{Face, OutlineBuilder};

use crate::FigureError;
use crate::geometry::{PathStep, Spot};
use crate::rich_text::{Run, runs};

/// Noto Sans, upright and italic, from a registry crate.
#[derive(Debug, Clone)]
pub(crate) struct Typeface {
    upright: Face<'static>,
    italic: Face<'static>,
}

impl Typeface {
    pub(crate) fn built_in() -> Result<Self, FigureError> {
        let read = |bytes| {
            Face::parse(bytes, 0).map_err(|error| FigureError::Typeface { reason: error.to_string() })
        };
        Ok(Self { upright: read(notosans::REGULAR_TTF)?, italic: read(notosans::ITALIC_TTF)? })
    }

    /// Width of a label, in the unit of `em`.
    pub(crate) fn width(&self, label: &str, em: f64) -> f64 {
        runs(label).iter().map(|run| em * self.advance_em(run)).sum()
    }

    /// Calls `draw` with the outline of each letter, for a label that starts at the origin on the base line, y down.
    pub(crate) fn outlines(&self, label: &str, em: f64, mut draw: impl FnMut(PathStep)) {
        let mut start = 0.0;
        for run in runs(label) {
            let mut pen = start + em * run.gap_em;
            for letter in run.letters.chars() {
                let (face, scale) = (self.face(&run), em * run.scale / self.units(&run));
                let Some(glyph) = face.glyph_index(letter) else { continue };
                let origin = (pen, -em * run.raised_em);
                face.outline_glyph(glyph, &mut Pen { origin, scale, at: origin, draw: &mut draw });
                pen += scale * f64::from(face.glyph_hor_advance(glyph).unwrap_or(0));
            }
            start += em * self.advance_em(&run);
        }
    }

    fn advance_em(&self, run: &Run) -> f64 {
        let face = self.face(run);
        let advance = |letter| face.glyph_hor_advance(face.glyph_index(letter)?);
        let units: f64 = run.letters.chars().filter_map(advance).map(f64::from).sum();
        run.gap_em + run.scale * units / self.units(run)
    }

    fn face(&self, run: &Run) -> &Face<'static> {
        if run.italic { &self.italic } else { &self.upright }
    }

    fn units(&self, run: &Run) -> f64 {
        f64::from(self.face(run).units_per_em())
    }

    #[cfg(test)]
    fn has(&self, letter: char) -> bool {
        self.upright.glyph_index(letter).is_some() && self.italic.glyph_index(letter).is_some()
    }
}

/// Turns the typeface's outlines, which have quadratic arcs and y up, into steps of a path.
struct Pen<'a, F: FnMut(PathStep)> {
    origin: Spot,
    scale: f64,
    at: Spot,
    draw: &'a mut F,
}

impl<F: FnMut(PathStep)> Pen<'_, F> {
    fn spot(&self, x: f32, y: f32) -> Spot {
        (self.origin.0 + self.scale * f64::from(x), self.origin.1 - self.scale * f64::from(y))
    }

    fn go(&mut self, to: Spot, step: PathStep) {
        self.at = to;
        (self.draw)(step);
    }
}

impl<F: FnMut(PathStep)> OutlineBuilder for Pen<'_, F> {
    fn move_to(&mut self, x: f32, y: f32) {
        let to = self.spot(x, y);
        self.go(to, PathStep::Move(to));
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let to = self.spot(x, y);
        self.go(to, PathStep::Line(to));
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let (control, to) = (self.spot(x1, y1), self.spot(x, y));
        // A quadratic arc is the cubic one whose controls lie two thirds of the way.
        let toward =
            |end: Spot| (end.0 + 2.0 / 3.0 * (control.0 - end.0), end.1 + 2.0 / 3.0 * (control.1 - end.1));
        let step = PathStep::Cubic(toward(self.at), toward(to), to);
        self.go(to, step);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let to = self.spot(x, y);
        let step = PathStep::Cubic(self.spot(x1, y1), self.spot(x2, y2), to);
        self.go(to, step);
    }

    fn close(&mut self) {
        (self.draw)(PathStep::Close);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sign_that_figures_use_exists() {
        let typeface = Typeface::built_in().unwrap();
        for letter in "−±·µσΨκ…%()/".chars() {
            assert!(typeface.has(letter), "{letter}");
        }
    }

    #[test]
    fn letters_are_drawn_where_they_are_measured() {
        let typeface = Typeface::built_in().unwrap();
        let (mut low, mut high) = ((f64::MAX, f64::MAX), (f64::MIN, f64::MIN));
        typeface.outlines("HHH", 100.0, |step| {
            if let PathStep::Move((x, y)) | PathStep::Line((x, y)) = step {
                (low, high) = ((low.0.min(x), low.1.min(y)), (high.0.max(x), high.1.max(y)));
            }
        });
        let width = typeface.width("HHH", 100.0);
        // Three letters of 0.741 em with side bearings of about 0.1 em; capitals are 0.714 em high (the font's own data).
        assert!((width - 222.3).abs() < 0.5, "{width}");
        assert!(low.0 > 5.0 && high.0 < width - 5.0);
        assert!((low.1 + 71.4).abs() < 0.1 && high.1.abs() < 0.1, "{low:?} {high:?}");
    }

    #[test]
    fn an_index_is_small_and_stands_beside_its_symbol() {
        let typeface = Typeface::built_in().unwrap();
        let width = |label| typeface.width(label, 1.0);
        assert!(width("$u_n$") < width("un") && width("$u_n$") > width("u"));
    }
}
