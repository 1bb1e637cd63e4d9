//! Lines: their width, colour and dashes.

use crate::colour::{BLACK, Rgb};
use crate::style::POINT_MM;

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
    /// Lengths of dash and space in turn, in units of the line's width; none for a solid line.
    fn pattern(self) -> &'static [f64] {
        match self {
            Self::Solid => &[],
            Self::Dashed => &[4.2, 2.2],
            // Round ends make dots of dashes without length; renderers want some.
            Self::Dotted => &[0.02, 2.1],
            Self::Chain => &[5.0, 1.7, 1.0, 1.7],
        }
    }
}

/// Width, colour and dashes of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stroke {
    pub(crate) width_mm: f64,
    pub(crate) colour: Rgb,
    pub(crate) dash: Dash,
    /// The width that the dashes are measured by.
    dash_mm: f64,
}

impl Stroke {
    pub(crate) fn new(width_pt: f64, colour: Rgb, dash: Dash) -> Self {
        let width_mm = width_pt * POINT_MM;
        Self { width_mm, colour, dash, dash_mm: width_mm }
    }

    /// The thin black line of axes.
    pub(crate) fn axis() -> Self {
        Self::new(0.6, BLACK, Dash::Solid)
    }

    /// The rim of a line: wider, with dashes at the same places.
    pub(crate) fn rim(self, width_pt: f64, colour: Rgb) -> Self {
        Self { width_mm: self.width_mm + width_pt * POINT_MM, colour, ..self }
    }

    /// Lengths of dash and space in turn, in millimetres; none for a solid line.
    pub(crate) fn pattern_mm(&self) -> Vec<f64> {
        self.dash.pattern().iter().map(|length| length * self.dash_mm).collect()
    }

    /// Whether dashes have round ends.
    pub(crate) fn is_round(&self) -> bool {
        self.dash == Dash::Dotted
    }
}
