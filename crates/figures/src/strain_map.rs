//! Strain over gaps and time, one map for the experiment and each model (the paper's Fig. 2 a-c).

use chainwave_measurement::Estimate;
use ndarray::Array2;
use serde::{Deserialize, Serialize};

use crate::drawing::Drawing;
use crate::figure::{Draw, Figure};
use crate::heat_map::{Cells, ColourScale, Summary, check_times};
use crate::map_row::{self, MapPanel, MapTrace};
use crate::stroke::Dash;
use crate::{FigureError, Style};

/// Share of the values at each end that may lie beyond the colours.
const SPARE: f64 = 1.0 / 4000.0;

/// One strain map of a chain over gaps and time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StrainMapPanel {
    /// Title, such as `experiment`.
    pub title: String,
    /// Sample times in seconds, increasing.
    pub times_s: Vec<f64>,
    /// Strain u_n, negative in compression, shape `[gap, time]`, from gap 1; `None` where it was not measured.
    pub strain: Array2<Option<f64>>,
    /// Gap and time in seconds of the leading pulse's peak, drawn dotted.
    pub peak_trace: Vec<(f64, f64)>,
    /// Gap and time in seconds of the leading edge, drawn dashed.
    pub leading_edge: Vec<(f64, f64)>,
}

impl StrainMapPanel {
    /// A map of estimates of shape `[gap, time]` with its fronts: gap, time of the peak and of the leading edge, in seconds.
    pub fn new(
        title: impl Into<String>,
        times_s: &[f64],
        strain: &Array2<Option<Estimate>>,
        fronts: impl Iterator<Item = (usize, f64, Option<f64>)> + Clone,
    ) -> Self {
        Self {
            title: title.into(),
            times_s: times_s.to_vec(),
            strain: strain.mapv(|strain| strain.map(|strain| strain.value)),
            peak_trace: fronts.clone().map(|(gap, peak_s, _)| (gap as f64, peak_s)).collect(),
            leading_edge: fronts.filter_map(|(gap, _, edge_s)| Some((gap as f64, edge_s?))).collect(),
        }
    }
}

impl Draw for [StrainMapPanel] {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        layout(style, self).map(Figure::new)
    }
}

fn layout(style: &Style, panels: &[StrainMapPanel]) -> Result<Drawing, FigureError> {
    panels.iter().try_for_each(|panel| check_times("strain map", &panel.times_s, &panel.strain.view()))?;
    let maps: Vec<MapPanel> = map_row::or_empty(panels.iter().map(map_panel).collect());
    let values = maps.iter().flat_map(|map| map.cells.measured()).collect();
    map_row::draw(style, &maps, &ColourScale::signed(values, SPARE), "compressive strain $−u_n$ (%)")
}

fn map_panel(panel: &StrainMapPanel) -> MapPanel {
    let in_ms = |points: &[(f64, f64)]| points.iter().map(|&(gap, t_s)| (gap, 1e3 * t_s)).collect();
    MapPanel {
        title: panel.title.clone(),
        // Percent, positive in compression.
        cells: Cells::over_time(&panel.times_s, &panel.strain.view(), -100.0, Summary::Mean),
        traces: vec![
            MapTrace {
                name: "peak of the leading pulse",
                dash: Dash::Dotted,
                points: in_ms(&panel.peak_trace),
            },
            MapTrace { name: "leading edge", dash: Dash::Dashed, points: in_ms(&panel.leading_edge) },
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(times_s: &[f64], strain: &Array2<Option<f64>>) -> StrainMapPanel {
        StrainMapPanel {
            title: "model".into(),
            times_s: times_s.into(),
            strain: strain.clone(),
            peak_trace: Vec::new(),
            leading_edge: Vec::new(),
        }
    }

    #[test]
    fn axes_and_colour_bar_are_labelled_and_nothing_overlaps() {
        let times_s: Vec<f64> = (0..400).map(|i| 4e-5 * f64::from(i)).collect();
        let strain = Array2::from_shape_fn((25, 400), |(n, i)| {
            Some(-0.05 * (0.3 * (n as f64) - 0.02 * i as f64).sin())
        });
        for count in 1..=4 {
            let drawing = layout(&Style::default(), &vec![panel(&times_s, &strain); count]).unwrap();
            drawing.assert_readable();
            for label in ["gap number n", "time (ms)", "compressive strain −u_n (%)"] {
                assert!(drawing.says(label), "{label}");
            }
        }
    }

    #[test]
    fn degenerate_maps_give_an_error_or_say_no_data() {
        assert!(layout(&Style::default(), &[]).unwrap().says("no data"));
        let strain = Array2::from_elem((3, 2), Some(0.1));
        assert!(
            layout(&Style::default(), &[panel(&[0.0], &strain)])
                .unwrap_err()
                .to_string()
                .contains("expected 1")
        );
        assert!(layout(&Style::default(), &[panel(&[0.0, f64::NAN], &strain)]).is_err());
        assert!(layout(&Style::default(), &[panel(&[1.0, 1.0], &strain)]).is_err());
        for (lost, times_s) in [
            (Array2::from_elem((3, 2), None), vec![0.0, 1.0]),
            (Array2::from_elem((0, 2), None), vec![0.0, 1.0]),
            (Array2::from_elem((3, 0), None), vec![]),
            (Array2::from_elem((1, 1), Some(f64::NAN)), vec![0.0]),
        ] {
            let drawing = layout(&Style::default(), &[panel(&times_s, &lost)]).unwrap();
            assert!(drawing.says("no data"), "{lost:?}");
        }
        assert!(layout(&Style::default(), &[panel(&[0.0], &Array2::from_elem((1, 1), Some(0.0)))]).is_ok());
    }
}
