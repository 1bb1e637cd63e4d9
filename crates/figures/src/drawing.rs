use crate::FigureError;
use crate::colour::{BLACK, DARK, HATCH, Rgb, WHITE};
use crate::geometry::{Frame, Spot, dashes, spaced};
use crate::typeface::Typeface;

/// A typographic point in millimetres.
pub(crate) const POINT_MM: f64 = 25.4 / 72.0;
/// Size of labels and legends (8 points) and of numbers at ticks (7 points), in millimetres.
pub(crate) const LABEL_MM: f64 = 8.0 * POINT_MM;
pub(crate) const NUMBER_MM: f64 = 7.0 * POINT_MM;

/// Half the height of a capital letter, in em.
const HALF_CAPITAL_EM: f64 = 0.357;

/// Size of an exponent relative to its number.
const EXPONENT: f64 = 0.75;

/// How a line is interrupted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Dash {
    Solid,
    Dashed,
    Dotted,
    /// Dash, dot, dash.
    Chain,
}

impl Dash {
    /// Lengths of dash, space and so on in millimetres; none for a solid line.
    fn pattern_mm(self) -> &'static [f64] {
        match self {
            Self::Solid => &[],
            Self::Dashed => &[1.7, 0.9],
            Self::Dotted => &[0.35, 0.6],
            Self::Chain => &[2.1, 0.65, 0.35, 0.65],
        }
    }
}

/// Width, colour and dashes of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stroke {
    pub(crate) width_mm: f64,
    pub(crate) colour: Rgb,
    pub(crate) dash: Dash,
}

impl Stroke {
    pub(crate) fn new(width_pt: f64, colour: Rgb, dash: Dash) -> Self {
        Self { width_mm: width_pt * POINT_MM, colour, dash }
    }

    /// The thin black line of axes.
    pub(crate) fn axis() -> Self {
        Self::new(0.6, BLACK, Dash::Solid)
    }
}

/// Where a text lies relative to its spot along the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// One line of black text.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Text {
    pub(crate) text: String,
    /// On the base line.
    pub(crate) at: Spot,
    pub(crate) em_mm: f64,
    pub(crate) anchor: Anchor,
    /// Whether the text runs upwards.
    pub(crate) upwards: bool,
}

/// What a page is made of; later shapes cover earlier ones.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Shape {
    Line { points: Vec<Spot>, width_mm: f64, colour: Rgb },
    Area { points: Vec<Spot>, fill: Rgb },
    Box { frame: Frame, fill: Rgb },
    Disc { centre: Spot, radius_mm: f64, fill: Rgb },
    Text(Text),
}

/// A page as a list of shapes in millimetres, from which both the SVG and the PNG file are made.
#[derive(Debug, Clone)]
pub(crate) struct Drawing {
    pub(crate) width_mm: f64,
    /// Grows with the content (see [`Drawing::extend_to`]).
    pub(crate) height_mm: f64,
    pub(crate) shapes: Vec<Shape>,
    pub(crate) typeface: Typeface,
}

impl Drawing {
    /// Width of a figure in one column of a journal, and in two, in millimetres.
    pub(crate) const ONE_COLUMN_MM: f64 = 86.0;
    pub(crate) const TWO_COLUMNS_MM: f64 = 178.0;

    pub(crate) fn new(width_mm: f64) -> Result<Self, FigureError> {
        Ok(Self { width_mm, height_mm: 0.0, shapes: Vec::new(), typeface: Typeface::built_in()? })
    }

    /// Makes the page at least `bottom_mm` high.
    pub(crate) fn extend_to(&mut self, bottom_mm: f64) {
        self.height_mm = self.height_mm.max(bottom_mm);
    }

    pub(crate) fn line(&mut self, points: &[Spot], stroke: Stroke) {
        if points.len() < 2 {
            return;
        }
        let pieces = match stroke.dash.pattern_mm() {
            [] => vec![points.to_vec()],
            pattern => dashes(points, pattern),
        };
        self.shapes.extend(pieces.into_iter().map(|points| Shape::Line {
            points,
            width_mm: stroke.width_mm,
            colour: stroke.colour,
        }));
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

    /// The outline of a frame, closed.
    pub(crate) fn outline(&mut self, frame: Frame, stroke: Stroke) {
        let corners = frame.corners();
        self.line(&[corners[0], corners[1], corners[2], corners[3], corners[0], corners[1]], stroke);
    }

    pub(crate) fn area(&mut self, points: Vec<Spot>, fill: Rgb) {
        self.shapes.push(Shape::Area { points, fill });
    }

    pub(crate) fn fill(&mut self, frame: Frame, fill: Rgb) {
        self.shapes.push(Shape::Box { frame, fill });
    }

    pub(crate) fn disc(&mut self, centre: Spot, radius_mm: f64, fill: Rgb) {
        self.shapes.push(Shape::Disc { centre, radius_mm, fill });
    }

    /// Black text whose capitals are centred on the height of `at`.
    pub(crate) fn text(&mut self, text: &str, at: Spot, em_mm: f64, anchor: Anchor) {
        let base_line = (at.0, at.1 + HALF_CAPITAL_EM * em_mm);
        self.put_text(Text { text: text.into(), at: base_line, em_mm, anchor, upwards: false });
    }

    /// A number at a tick; what follows a `^` is raised.
    pub(crate) fn number(&mut self, label: &str, at: Spot, anchor: Anchor) {
        let Some((base, exponent)) = label.split_once('^') else {
            return self.text(label, at, NUMBER_MM, anchor);
        };
        let width = self.number_width(label);
        let start = match anchor {
            Anchor::Start => at.0,
            Anchor::Middle => at.0 - 0.5 * width,
            Anchor::End => at.0 - width,
        };
        let end = (start + width, at.1 - 0.35 * NUMBER_MM);
        self.text(base, (start, at.1), NUMBER_MM, Anchor::Start);
        self.text(exponent, end, EXPONENT * NUMBER_MM, Anchor::End);
    }

    /// Width of a number at a tick.
    pub(crate) fn number_width(&self, label: &str) -> f64 {
        let (base, exponent) = label.split_once('^').unwrap_or((label, ""));
        let gap = if exponent.is_empty() { 0.0 } else { 0.05 * NUMBER_MM };
        self.text_width(base, NUMBER_MM) + gap + self.text_width(exponent, EXPONENT * NUMBER_MM)
    }

    /// Black text that runs upwards, centred on `at`.
    pub(crate) fn upward_text(&mut self, text: &str, at: Spot, em_mm: f64) {
        let base_line = (at.0 + HALF_CAPITAL_EM * em_mm, at.1);
        let anchor = Anchor::Middle;
        self.put_text(Text { text: text.into(), at: base_line, em_mm, anchor, upwards: true });
    }

    fn put_text(&mut self, text: Text) {
        if !text.text.is_empty() {
            self.shapes.push(Shape::Text(text));
        }
    }

    /// A white line with a dark rim, readable on every colour of a map.
    pub(crate) fn rimmed_line(&mut self, points: &[Spot], dash: Dash) {
        if dash == Dash::Dotted {
            let dots = spaced(points, 1.3);
            dots.iter().for_each(|&dot| self.disc(dot, 0.42, DARK));
            dots.iter().for_each(|&dot| self.disc(dot, 0.3, WHITE));
            return;
        }
        self.line(points, Stroke::new(1.7, DARK, dash));
        self.line(points, Stroke::new(0.9, WHITE, dash));
    }

    /// Diagonal hatching, the sign for "not measured".
    pub(crate) fn hatch(&mut self, frame: Frame) {
        let spacing_mm = 0.9;
        let n_lines = ((frame.width() + frame.height()) / spacing_mm).ceil() as usize;
        for i in 1..n_lines {
            let reach = i as f64 * spacing_mm;
            let from = (frame.left + reach, frame.top);
            let to = (frame.left, frame.top + reach);
            if let Some((from, to)) = frame.clip_segment(from, to) {
                self.segment(from, to, Stroke::new(0.4, HATCH, Dash::Solid));
            }
        }
    }

    /// The text, cut short with an ellipsis where it is wider than `room_mm`.
    pub(crate) fn fitted(&self, text: &str, em_mm: f64, room_mm: f64) -> String {
        if self.text_width(text, em_mm) <= room_mm {
            return text.into();
        }
        let mut kept = text.to_string();
        while kept.pop().is_some() {
            let cut = format!("{}…", kept.trim_end());
            if self.text_width(&cut, em_mm) <= room_mm {
                return cut;
            }
        }
        kept
    }

    pub(crate) fn text_width(&self, text: &str, em_mm: f64) -> f64 {
        self.typeface.width(text, em_mm)
    }
}

#[cfg(test)]
impl Drawing {
    /// The rectangle that each text covers, for tests of the layout.
    pub(crate) fn text_frames(&self) -> Vec<(String, Frame)> {
        let frame_of = |text: &Text| {
            let width = self.text_width(&text.text, text.em_mm);
            let start = match text.anchor {
                Anchor::Start => 0.0,
                Anchor::Middle => -0.5 * width,
                Anchor::End => -width,
            };
            let (up, down) = (0.73 * text.em_mm, 0.2 * text.em_mm);
            let (x, y) = text.at;
            if text.upwards {
                Frame { left: x - up, right: x + down, top: y - start - width, bottom: y - start }
            } else {
                Frame { left: x + start, right: x + start + width, top: y - up, bottom: y + down }
            }
        };
        self.shapes
            .iter()
            .filter_map(|shape| match shape {
                Shape::Text(text) => Some((text.text.clone(), frame_of(text))),
                _ => None,
            })
            .collect()
    }

    /// Fails when a text leaves the page or two texts overlap.
    pub(crate) fn assert_readable(&self) {
        let page = Frame::new(0.0, 0.0, self.width_mm, self.height_mm);
        let frames = self.text_frames();
        for (i, (text, frame)) in frames.iter().enumerate() {
            assert!(frame.corners().iter().all(|&corner| page.holds(corner)), "{text:?} at {frame:?}");
            for (other, with) in &frames[..i] {
                let apart = frame.right <= with.left
                    || with.right <= frame.left
                    || frame.bottom <= with.top
                    || with.bottom <= frame.top;
                assert!(apart, "{text:?} and {other:?} overlap");
            }
        }
    }
}
