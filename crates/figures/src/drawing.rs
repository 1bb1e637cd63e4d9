//! A page as a list of marks in millimetres, from which the SVG, PNG and PDF files are all made.

use crate::FigureError;
use crate::colour::{HATCH, Rgb};
use crate::data::DataSet;
use crate::geometry::{PageRect, PathStep, Spot, polyline};
use crate::rich_text::plain;
use crate::stroke::{Dash, Stroke};
use crate::style::Style;
use crate::typeface::Typeface;

/// Half the height of a capital letter, in em.
const HALF_CAPITAL_EM: f64 = 0.357;
/// Controls of the cubic arc that is nearly a quarter of the unit circle.
const QUARTER: f64 = 0.552_284_75;

/// Where a label lies relative to its spot along the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// One line of black letters.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Words {
    pub(crate) label: String,
    /// On the base line.
    pub(crate) at: Spot,
    pub(crate) em_mm: f64,
    pub(crate) anchor: Anchor,
    /// Whether the line runs upwards.
    pub(crate) upwards: bool,
}

impl Words {
    /// The label without the marks of its mathematics.
    pub(crate) fn plain(&self) -> String {
        plain(&self.label)
    }

    /// How far the first letter starts behind the spot.
    fn start_mm(&self, typeface: &Typeface) -> f64 {
        let width = || typeface.width(&self.label, self.em_mm);
        match self.anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => -0.5 * width(),
            Anchor::End => -width(),
        }
    }

    /// The outlines of its letters on the page.
    pub(crate) fn outlines(&self, typeface: &Typeface) -> Vec<PathStep> {
        let start = self.start_mm(typeface);
        let place = |(x, y): Spot| {
            let (along, down) = (start + x, y);
            if self.upwards {
                (self.at.0 + down, self.at.1 - along)
            } else {
                (self.at.0 + along, self.at.1 + down)
            }
        };
        let mut steps = Vec::new();
        typeface.outlines(&self.label, self.em_mm, |step| steps.push(step.placed(place)));
        steps
    }
}

/// An opaque grid of equal pixels.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Raster {
    pub(crate) width_px: usize,
    pub(crate) height_px: usize,
    /// Rows from the top.
    pub(crate) pixels: Vec<Rgb>,
}

/// What a page is made of; later marks cover earlier ones.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Ink {
    Line { points: Vec<Spot>, stroke: Stroke },
    Area { points: Vec<Spot>, fill: Rgb },
    Disc { centre: Spot, radius_mm: f64, fill: Rgb },
    Words(Words),
    Picture { rect: PageRect, raster: Raster },
}

/// Width of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Columns {
    One,
    Two,
}

/// A page under construction.
#[derive(Debug, Clone)]
pub(crate) struct Drawing {
    pub(crate) style: Style,
    pub(crate) width_mm: f64,
    /// Grows with the content (see [`Drawing::extend_to`]).
    pub(crate) height_mm: f64,
    pub(crate) inks: Vec<Ink>,
    pub(crate) typeface: Typeface,
    /// The numbers that were drawn.
    pub(crate) data: Vec<DataSet>,
}

impl Drawing {
    pub(crate) fn new(style: &Style, columns: Columns) -> Result<Self, FigureError> {
        style.check()?;
        let width_mm = if columns == Columns::One { style.column_mm } else { style.page_mm };
        let typeface = Typeface::built_in()?;
        Ok(Self { style: *style, width_mm, height_mm: 0.0, inks: Vec::new(), typeface, data: Vec::new() })
    }

    pub(crate) fn label_mm(&self) -> f64 {
        self.style.label_mm()
    }

    pub(crate) fn number_mm(&self) -> f64 {
        self.style.number_mm()
    }

    /// Makes the page at least `bottom_mm` high.
    pub(crate) fn extend_to(&mut self, bottom_mm: f64) {
        self.height_mm = self.height_mm.max(bottom_mm);
    }

    pub(crate) fn line(&mut self, points: &[Spot], stroke: Stroke) {
        if points.len() > 1 {
            self.inks.push(Ink::Line { points: points.to_vec(), stroke });
        }
    }

    pub(crate) fn segment(&mut self, from: Spot, to: Spot, stroke: Stroke) {
        self.line(&[from, to], stroke);
    }

    /// A tick of an axis; none when it has no length.
    pub(crate) fn tick(&mut self, at: Spot, reach: Spot) {
        if reach != (0.0, 0.0) {
            self.segment(at, (at.0 + reach.0, at.1 + reach.1), Stroke::axis());
        }
    }

    /// The outline of a rectangle, closed.
    pub(crate) fn outline(&mut self, rect: PageRect, stroke: Stroke) {
        let corners = rect.corners();
        self.line(&[corners[0], corners[1], corners[2], corners[3], corners[0], corners[1]], stroke);
    }

    pub(crate) fn area(&mut self, points: Vec<Spot>, fill: Rgb) {
        self.inks.push(Ink::Area { points, fill });
    }

    pub(crate) fn fill(&mut self, rect: PageRect, fill: Rgb) {
        self.area(rect.corners().to_vec(), fill);
    }

    pub(crate) fn disc(&mut self, centre: Spot, radius_mm: f64, fill: Rgb) {
        self.inks.push(Ink::Disc { centre, radius_mm, fill });
    }

    pub(crate) fn picture(&mut self, rect: PageRect, raster: Raster) {
        self.inks.push(Ink::Picture { rect, raster });
    }

    /// Black letters whose capitals are centred on the height of `at`.
    pub(crate) fn text(&mut self, label: &str, at: Spot, em_mm: f64, anchor: Anchor) {
        let base_line = (at.0, at.1 + HALF_CAPITAL_EM * em_mm);
        self.put(Words { label: label.into(), at: base_line, em_mm, anchor, upwards: false });
    }

    /// Black letters that run upwards, centred on `at`.
    pub(crate) fn upward_text(&mut self, label: &str, at: Spot, em_mm: f64) {
        let base_line = (at.0 + HALF_CAPITAL_EM * em_mm, at.1);
        let anchor = Anchor::Middle;
        self.put(Words { label: label.into(), at: base_line, em_mm, anchor, upwards: true });
    }

    fn put(&mut self, words: Words) {
        if !words.label.is_empty() {
            self.inks.push(Ink::Words(words));
        }
    }

    /// A line with a rim, readable on every colour of a map.
    pub(crate) fn rimmed_line(&mut self, points: &[Spot], stroke: Stroke, rim: Rgb) {
        self.line(points, stroke.rim(0.9, rim));
        self.line(points, stroke);
    }

    /// Diagonal hatching, the sign for "not measured", where `is_blank` says so of places given as shares of the
    /// rectangle's width and height.
    pub(crate) fn hatch(&mut self, rect: PageRect, is_blank: impl Fn(f64, f64) -> bool) {
        const SPACING_MM: f64 = 0.9;
        const STEP_MM: f64 = 0.1;
        let n_lines = ((rect.width() + rect.height()) / SPACING_MM).ceil() as usize;
        for i in 1..n_lines {
            let reach = i as f64 * SPACING_MM;
            let (from, to) = ((rect.left + reach, rect.top), (rect.left, rect.top + reach));
            let Some((from, to)) = rect.clip_segment(from, to) else { continue };
            let n_steps = ((to.1 - from.1) / STEP_MM).ceil().max(1.0) as usize;
            let at = |step: usize| {
                let share = step as f64 / n_steps as f64;
                (from.0 + share * (to.0 - from.0), from.1 + share * (to.1 - from.1))
            };
            let blank: Vec<bool> = (0..n_steps)
                .map(|step| {
                    let ((x, y), (next_x, next_y)) = (at(step), at(step + 1));
                    let (x, y) = (0.5 * (x + next_x) - rect.left, 0.5 * (y + next_y) - rect.top);
                    is_blank(x / rect.width(), y / rect.height())
                })
                .collect();
            let mut step = 0;
            for run in blank.chunk_by(|a, b| a == b) {
                if run[0] {
                    self.segment(at(step), at(step + run.len()), Stroke::new(0.5, HATCH, Dash::Solid));
                }
                step += run.len();
            }
        }
    }

    /// The label, cut short with an ellipsis where it is wider than `room_mm`; never within a number, which would be another one.
    pub(crate) fn fitted(&self, label: &str, em_mm: f64, room_mm: f64) -> String {
        if self.text_width(label, em_mm) <= room_mm {
            return label.into();
        }
        let letters: Vec<char> = plain(label).chars().collect();
        let is_within_number = |end: usize| is_of_number(letters[end - 1]) && is_of_number(letters[end]);
        for end in (1..letters.len()).rev().filter(|&end| !is_within_number(end)) {
            let kept: String = letters[..end].iter().collect();
            let cut = format!("{}…", kept.trim_end());
            if self.text_width(&cut, em_mm) <= room_mm {
                return cut;
            }
        }
        String::new()
    }

    /// The label in lines no wider than `room_mm`, broken at spaces outside of mathematics; a word that is wider is cut as by [`Drawing::fitted`].
    pub(crate) fn wrapped(&self, label: &str, em_mm: f64, room_mm: f64) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for word in words(label) {
            match lines.last_mut() {
                Some(line) if self.text_width(&format!("{line} {word}"), em_mm) <= room_mm => {
                    line.push(' ');
                    line.push_str(&word);
                }
                _ => lines.push(word),
            }
        }
        lines.into_iter().map(|line| self.fitted(&line, em_mm, room_mm)).collect()
    }

    pub(crate) fn text_width(&self, label: &str, em_mm: f64) -> f64 {
        self.typeface.width(label, em_mm)
    }

    /// The path of a mark; none of a picture.
    pub(crate) fn path(&self, ink: &Ink) -> Vec<PathStep> {
        match ink {
            Ink::Line { points, .. } => polyline(points).collect(),
            Ink::Area { points, .. } => polyline(points).chain([PathStep::Close]).collect(),
            Ink::Disc { centre, radius_mm, .. } => circle(*centre, *radius_mm),
            Ink::Words(words) => words.outlines(&self.typeface),
            Ink::Picture { .. } => Vec::new(),
        }
    }

    /// The rectangle that each label covers, and the label without its marks.
    pub(crate) fn text_frames(&self) -> Vec<(String, PageRect)> {
        let frame_of = |words: &Words| {
            let start = words.start_mm(&self.typeface);
            let end = start + self.text_width(&words.label, words.em_mm);
            // Numbers reach no lower than their base line, and exponents reach above capitals.
            let down = if words.label.chars().any(char::is_alphabetic) { 0.2 } else { 0.02 } * words.em_mm;
            let up = if words.label.contains('^') { 0.88 } else { 0.73 } * words.em_mm;
            let (x, y) = words.at;
            if words.upwards {
                PageRect { left: x - up, right: x + down, top: y - end, bottom: y - start }
            } else {
                PageRect { left: x + start, right: x + end, top: y - up, bottom: y + down }
            }
        };
        let words = self.inks.iter().filter_map(|ink| match ink {
            Ink::Words(words) => Some((words.plain(), frame_of(words))),
            _ => None,
        });
        words.collect()
    }
}

/// Whether a letter is part of a number as it is printed.
fn is_of_number(letter: char) -> bool {
    letter.is_ascii_digit() || matches!(letter, '.' | ',' | '^' | '−' | '-' | '+' | '·')
}

/// A label's words, parted at spaces outside of mathematics.
fn words(label: &str) -> Vec<String> {
    let mut words: Vec<String> = vec![String::new()];
    let mut in_mathematics = false;
    for letter in label.chars() {
        in_mathematics ^= letter == '$';
        match words.last_mut() {
            Some(word) if letter != ' ' || in_mathematics => word.push(letter),
            _ => words.push(String::new()),
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

fn circle((x, y): Spot, radius: f64) -> Vec<PathStep> {
    let at = |(dx, dy): Spot| (x + radius * dx, y + radius * dy);
    let corners = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0), (1.0, 0.0)];
    let quarter = |pair: &[Spot]| {
        let (from, to) = (pair[0], pair[1]);
        let first = (from.0 + QUARTER * to.0, from.1 + QUARTER * to.1);
        let second = (to.0 + QUARTER * from.0, to.1 + QUARTER * from.1);
        PathStep::Cubic(at(first), at(second), at(to))
    };
    let start = PathStep::Move(at(corners[0]));
    std::iter::once(start).chain(corners.windows(2).map(quarter)).chain([PathStep::Close]).collect()
}

#[cfg(test)]
impl Drawing {
    /// The labels without their marks.
    pub(crate) fn labels(&self) -> Vec<String> {
        self.text_frames().into_iter().map(|(label, _)| label).collect()
    }

    /// Whether a label stands somewhere.
    pub(crate) fn says(&self, label: &str) -> bool {
        self.labels().iter().any(|one| one == label)
    }

    /// Fails when a label leaves the page, two labels overlap, or a line runs through a label outside of a frame.
    pub(crate) fn assert_readable(&self) {
        let page = PageRect::new(0.0, 0.0, self.width_mm, self.height_mm);
        let frames = self.text_frames();
        for (i, (label, frame)) in frames.iter().enumerate() {
            assert!(frame.corners().iter().all(|&corner| page.holds(corner)), "{label:?} at {frame:?}");
            for (other, with) in &frames[..i] {
                assert!(!frame.meets(with), "{label:?} and {other:?} overlap");
            }
            let axes = self.inks.iter().filter_map(|ink| match ink {
                Ink::Line { points, stroke } if *stroke == Stroke::axis() => Some(points),
                _ => None,
            });
            for pair in axes.flat_map(|points| points.windows(2)) {
                assert!(frame.clip_segment(pair[0], pair[1]).is_none(), "an axis runs through {label:?}");
            }
        }
        assert!(self.height_mm <= 240.0, "higher than a page: {} mm", self.height_mm);
    }
}
