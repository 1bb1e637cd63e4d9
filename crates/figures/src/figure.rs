//! A drawn figure, what can be drawn, and the files that a figure becomes.

use std::ffi::OsString;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use chainwave_durable::NewFile;

use crate::data::{DataSet, csv};
use crate::drawing::Drawing;
use crate::{FigureError, Style, pdf, png, svg};

/// What can be drawn. A figure without data says so in its panels.
pub trait Draw {
    /// The figure in a style.
    ///
    /// # Errors
    /// [`FigureError`] when inputs do not fit together or cannot be drawn, or the style suits no page.
    fn draw(&self, style: &Style) -> Result<Figure, FigureError>;
}

/// A figure, ready to be written.
#[derive(Debug, Clone)]
pub struct Figure {
    drawing: Drawing,
}

/// A kind of file that a figure is written as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Scalable: paths, with letters as outlines that carry their words.
    Svg,
    /// 300 pixels per inch.
    Png,
    /// One page of paths, for typesetting.
    Pdf,
    /// The numbers drawn, as comma-separated values.
    Csv,
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 4] = [Self::Svg, Self::Png, Self::Pdf, Self::Csv];

    pub(crate) fn ending(self) -> &'static str {
        match self {
            Self::Svg => "svg",
            Self::Png => "png",
            Self::Pdf => "pdf",
            Self::Csv => "csv",
        }
    }
}

impl Figure {
    pub(crate) fn new(drawing: Drawing) -> Self {
        Self { drawing }
    }

    /// Width and height in millimetres.
    pub fn size_mm(&self) -> (f64, f64) {
        (self.drawing.width_mm, self.drawing.height_mm)
    }

    /// The words on the page, without the marks of mathematics, in the order in which they were drawn.
    pub fn labels(&self) -> Vec<String> {
        self.drawing.text_frames().into_iter().map(|(label, _)| label).collect()
    }

    /// The numbers that were drawn.
    pub fn data(&self) -> &[DataSet] {
        &self.drawing.data
    }

    /// The file's bytes in a format.
    ///
    /// # Errors
    /// [`FigureError::Encode`] when a picture cannot be encoded.
    pub fn bytes(&self, format: Format) -> Result<Vec<u8>, FigureError> {
        let encoded = match format {
            Format::Svg => svg::document(&self.drawing).map(String::into_bytes),
            Format::Png => png::encoded(&self.drawing),
            Format::Pdf => Ok(pdf::document(&self.drawing)),
            Format::Csv => Ok(csv(&self.drawing.data).into_bytes()),
        };
        encoded.map_err(|reason| FigureError::Encode { reason })
    }

    /// Writes `STEM.svg` and so on, each whole or not at all, so that a reader never meets half a file.
    ///
    /// # Errors
    /// [`FigureError`] when a file cannot be written.
    pub fn write(&self, stem: &Path, formats: &[Format]) -> Result<(), FigureError> {
        for &format in formats {
            let bytes = self.bytes(format)?;
            put(stem, format.ending(), |file| file.write_all(&bytes))?;
        }
        Ok(())
    }

    /// Whether it shows a map, whose table has a row for each cell.
    pub(crate) fn has_map(&self) -> bool {
        self.data().iter().any(|set| !set.colour.is_empty())
    }
}

/// Writes `STEM.ENDING` whole or not at all.
pub(crate) fn put(
    stem: &Path,
    ending: &str,
    write: impl FnOnce(&mut NewFile) -> io::Result<()>,
) -> Result<(), FigureError> {
    let path = with_ending(stem, ending);
    let written = NewFile::create(&path).and_then(|mut file| {
        write(&mut file)?;
        file.finish()
    });
    written.map_err(|source| FigureError::Write { path, source })
}

/// The stem with an ending put behind it; a dot in the stem stays.
pub(crate) fn with_ending(stem: &Path, ending: &str) -> PathBuf {
    let mut path = OsString::from(stem);
    path.push(".");
    path.push(ending);
    path.into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DataPoint, DecimalSign, EnergyShares, PeakEnergy, ProfilePanel, Series, StrainMapPanel};
    use chainwave_measurement::Estimate;
    use ndarray::Array2;

    fn energy() -> PeakEnergy {
        let curve = |rate: f64| (1..=250).map(f64::from).map(move |n| (n, (-rate * (n - 1.0)).exp()));
        let point = |n: i32| DataPoint::measured(f64::from(n), Estimate::new(0.7, 0.02));
        PeakEnergy {
            measured: (1..=20).map(point).collect(),
            damped: curve(0.02).collect(),
            undamped: curve(0.006).collect(),
            shares: Some(EnergyShares {
                dispersion: 0.768,
                damping: 0.193,
                gap: Some(250),
                is_of_uniform_chain: true,
            }),
            relative_to_gap: None,
        }
    }

    fn styles() -> [Style; 3] {
        let narrow = Style { column_mm: 70.0, page_mm: 140.0, font_pt: 6.0, ..Style::default() };
        let large = Style { column_mm: 130.0, page_mm: 260.0, font_pt: 12.0, ..Style::default() };
        [narrow, large, Style { decimal_sign: DecimalSign::Comma, ..Style::default() }]
    }

    #[test]
    fn figures_stay_readable_in_other_styles() {
        let times_s: Vec<f64> = (0..60).map(|i| 3e-4 * f64::from(i)).collect();
        let strain =
            Array2::from_shape_fn((25, 60), |(n, i)| Some(0.05 * (0.3 * n as f64 - 0.1 * i as f64).sin()));
        let map = StrainMapPanel {
            title: "rings".into(),
            times_s,
            strain,
            peak_trace: vec![(1.0, 1e-3), (25.0, 15e-3)],
            leading_edge: Vec::new(),
        };
        let profile = ProfilePanel {
            time_s: 2.73e-3,
            series: vec![Series::model("chain model", (1..25).map(f64::from).map(|n| (n, 0.01 * n.sin())))],
            front: None,
        };
        for style in styles() {
            for figure in [
                energy().draw(&style),
                vec![map.clone(); 3][..].draw(&style),
                vec![profile.clone(); 3][..].draw(&style),
            ] {
                let figure = figure.unwrap();
                figure.drawing.assert_readable();
                assert!(figure.size_mm().0 <= style.page_mm);
            }
        }
    }

    #[test]
    fn numbers_have_the_decimal_sign_of_the_style() {
        let labels = energy().draw(&styles()[2]).unwrap().labels();
        assert!(labels.contains(&"76,8 %".into()) && labels.contains(&"0,8".into()), "{labels:?}");
        assert!(!labels.iter().any(|label| label.contains("0.8")));
    }

    #[test]
    fn a_map_is_one_picture_and_letters_are_paths() {
        let strain = Array2::from_shape_fn((25, 60), |(n, i)| (n != 3).then_some((n + i) as f64 * 1e-3));
        let times_s: Vec<f64> = (0..60).map(|i| 3e-4 * f64::from(i)).collect();
        let map = StrainMapPanel {
            title: "rings".into(),
            times_s,
            strain,
            peak_trace: Vec::new(),
            leading_edge: Vec::new(),
        };
        let figure = [map][..].draw(&Style::default()).unwrap();
        let document = String::from_utf8(figure.bytes(Format::Svg).unwrap()).unwrap();
        // The map and its bar of colours; one rectangle is the page's ground.
        assert_eq!(document.matches("<image").count(), 2);
        assert_eq!(document.matches("<rect").count(), 1);
        assert_eq!(document.matches("aria-label").count(), figure.labels().len());
        assert!(document.contains("aria-label=\"gap number n\"") && !document.contains("<text"));
        // Every cell is in the table, those that were not measured without a value.
        assert_eq!(figure.data()[0].rows.len(), 25 * 60);
        assert_eq!(figure.data()[0].rows.iter().filter(|row| row.colour.is_none()).count(), 60);
    }
}
