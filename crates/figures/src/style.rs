//! How figures look: widths, type size, colour map and decimal sign, one plain value for all of them.

use serde::Deserialize;

use crate::FigureError;
use crate::colour::{Rgb, gray, viridis};

/// A typographic point in millimetres.
pub(crate) const POINT_MM: f64 = 25.4 / 72.0;

/// How figures look. The default suits a journal with columns of 86 mm and type of 8 points. As a file, each field is a key that may be left
/// out: `colour_map = "viridis"` or `"gray"`, `decimal_sign = "point"` or `"comma"`.
///
/// ```
/// use chainwave_figures::{DecimalSign, Style};
///
/// let poster = Style { font_pt: 12.0, decimal_sign: DecimalSign::Comma, ..Style::default() };
/// assert_eq!(poster.column_mm, 86.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Style {
    /// Width of a figure in one column, in millimetres, from 50 to 400.
    pub column_mm: f64,
    /// Width of a figure across two columns, in millimetres, from 50 to 400.
    pub page_mm: f64,
    /// Size of labels and legends in points, from 5 to 16; numbers at ticks are an eighth smaller.
    pub font_pt: f64,
    /// Colours of quantities that have no sign. Quantities with a sign go from blue through white to red.
    pub colour_map: ColourMap,
    /// Sign between the whole and the decimal digits of numbers.
    pub decimal_sign: DecimalSign,
}

/// Colours of quantities without a sign, dark to light in equal steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum ColourMap {
    /// Viridis (Smith and van der Walt), from dark blue to yellow.
    Viridis,
    /// From black to nearly white.
    Gray,
}

/// Sign between the whole and the decimal digits of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DecimalSign {
    /// 2.73
    Point,
    /// 2,73
    Comma,
}

impl Default for Style {
    fn default() -> Self {
        Self {
            column_mm: 86.0,
            page_mm: 178.0,
            font_pt: 8.0,
            colour_map: ColourMap::Viridis,
            decimal_sign: DecimalSign::Point,
        }
    }
}

impl Style {
    /// Refuses widths and sizes that no page can hold.
    ///
    /// # Errors
    /// [`FigureError::Value`], which names the key and its limits.
    pub fn check(&self) -> Result<(), FigureError> {
        let limits = [
            ("column_mm", self.column_mm, (50.0, 400.0)),
            ("page_mm", self.page_mm, (50.0, 400.0)),
            ("font_pt", self.font_pt, (5.0, 16.0)),
        ];
        let wrong = limits.into_iter().find(|(_, value, (low, high))| !(low..=high).contains(&value));
        wrong.map_or(Ok(()), |(what, value, (low, high))| {
            Err(FigureError::Value {
                figure: "style",
                what: what.into(),
                expected: format!("a number from {low} to {high}"),
                found: value.to_string(),
            })
        })
    }

    /// Size of labels and legends in millimetres.
    pub(crate) fn label_mm(&self) -> f64 {
        self.font_pt * POINT_MM
    }

    /// Size of numbers at ticks in millimetres.
    pub(crate) fn number_mm(&self) -> f64 {
        0.875 * self.label_mm()
    }

    /// A number that was written with a point.
    pub(crate) fn decimals(&self, number: &str) -> String {
        match self.decimal_sign {
            DecimalSign::Point => number.into(),
            DecimalSign::Comma => number.replace('.', ","),
        }
    }
}

impl ColourMap {
    /// The colour at a share from 0 to 1 (clamped).
    pub(crate) fn colour(self, share: f64) -> Rgb {
        match self {
            Self::Viridis => viridis(share),
            Self::Gray => gray(share),
        }
    }

    /// The colour of one of `count` curves in order, none too light for a white page.
    pub(crate) fn ordered(self, index: usize, count: usize) -> Rgb {
        self.colour(0.8 * index as f64 / (count.max(2) - 1) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_style_that_no_page_can_hold_is_refused() {
        for wrong in [
            Style { column_mm: 1.0, ..Style::default() },
            Style { page_mm: f64::NAN, ..Style::default() },
            Style { font_pt: 100.0, ..Style::default() },
        ] {
            assert!(wrong.check().is_err(), "{wrong:?}");
        }
        assert!(Style::default().check().is_ok());
    }
}
