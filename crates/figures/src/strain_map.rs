//! Strain over gaps and time, one map for the experiment and each model (the paper's Fig. 2 a-c).

use chainwave_measurement::Estimate;
use ndarray::Array2;
use serde::{Deserialize, Serialize};

use crate::drawing::Drawing;
use crate::figure::{Draw, Figure};
use crate::heat_map::{Cells, ColourScale, Summary, check_times, inner_extent};
use crate::map_row::{self, MapPanel, MapTrace};
use crate::series::{MEASURED, source};
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
    let colours = ColourScale::signed_from(values, SPARE, lowest_shown(&maps));
    map_row::draw(style, &maps, &colours, "compressive strain $−u_n$ (%)")
}

/// The tension, negative and in percent, to which colours reach where there is an experiment to compare with: its own, or as much as the greatest compression.
/// A model's bodies that fly apart would take the colours of all that was measured.
fn lowest_shown(maps: &[MapPanel]) -> f64 {
    let extent_of = |map: &MapPanel| {
        let mut values: Vec<f64> = map.cells.measured().collect();
        values.sort_by(f64::total_cmp);
        inner_extent(&values, SPARE)
    };
    let measured = maps.iter().find(|map| source(&map.title) == Some(MEASURED)).and_then(extent_of);
    let Some(measured) = measured else { return f64::NEG_INFINITY };
    let greatest = maps.iter().filter_map(extent_of).map(|extent| extent.high).fold(0.0, f64::max);
    measured.low.min(-greatest)
}

fn map_panel(panel: &StrainMapPanel) -> MapPanel {
    let in_ms = |points: &[(f64, f64)]| {
        let broken = broken_where_unmeasured(panel, points).into_iter();
        broken.map(|(gap, t_s)| (gap, 1e3 * t_s)).collect()
    };
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

/// A trace with a break between two points where the straight way from one to the other runs over a gap that was not measured then: nothing is known
/// of the pulse there.
fn broken_where_unmeasured(panel: &StrainMapPanel, points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let is_unmeasured = |gap: usize, time_s: f64| {
        let sample = panel.times_s.partition_point(|&other| other < time_s);
        let sample = sample.min(panel.times_s.len().saturating_sub(1));
        gap.checked_sub(1).and_then(|row| panel.strain.get([row, sample])).is_some_and(Option::is_none)
    };
    let is_blind = |from: (f64, f64), to: (f64, f64)| {
        let between = (from.0.min(to.0).floor() as usize + 1)..(from.0.max(to.0).ceil() as usize);
        between.into_iter().any(|gap| {
            let share = (gap as f64 - from.0) / (to.0 - from.0);
            is_unmeasured(gap, from.1 + share * (to.1 - from.1))
        })
    };
    let mut broken = Vec::with_capacity(points.len());
    for (index, &point) in points.iter().enumerate() {
        if index.checked_sub(1).is_some_and(|before| is_blind(points[before], point)) {
            broken.push((f64::NAN, f64::NAN));
        }
        broken.push(point);
    }
    broken
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

    #[test]
    fn a_trace_breaks_over_gaps_that_were_not_measured() {
        let times_s: Vec<f64> = (0..10).map(|i| 1e-3 * f64::from(i)).collect();
        // Gap 4 was never seen, and gap 6 not yet when the pulse came to gap 5.
        let strain =
            Array2::from_shape_fn((8, 10), |(row, i)| (row != 3 && (row != 5 || i > 6)).then_some(-0.01));
        let trace = [1.0, 2.0, 3.0, 5.0, 7.0, 8.0].map(|gap| (gap, 1e-3 * gap));
        let of = |strain: &Array2<Option<f64>>| {
            let broken = broken_where_unmeasured(&panel(&times_s, strain), &trace);
            broken.iter().map(|point| point.0.is_nan()).collect::<Vec<bool>>()
        };
        assert_eq!(of(&strain), [false, false, false, true, false, true, false, false]);
        let seen = Array2::from_elem((8, 10), Some(-0.01));
        assert!(
            of(&seen).iter().all(|is_break| !is_break),
            "a gap without a peak is no break where it was measured"
        );
    }

    #[test]
    fn a_model_that_flies_apart_takes_no_colours_from_what_was_measured() {
        let times_s: Vec<f64> = (0..20).map(|i| 1e-3 * f64::from(i)).collect();
        // Strains are positive in tension: -0.05 is a compression of 5 %, and 1.15 a gap that opened by more than the pitch.
        let pulse = |title: &str, tension: f64| {
            let strain =
                Array2::from_shape_fn((8, 20), |(row, i)| Some(if row == i { -0.05 } else { tension }));
            map_panel(&StrainMapPanel { title: title.into(), ..panel(&times_s, &strain) })
        };
        let both = [pulse("experiment", 0.01), pulse("chain model", 1.15)];
        assert!((lowest_shown(&both) + 5.0).abs() < 1e-9, "{}", lowest_shown(&both));
        // What was measured is shown, and where there is nothing to compare with all of it.
        let tension = lowest_shown(&[pulse("experiment", 0.3), pulse("chain model", 1.15)]);
        assert!((tension + 30.0).abs() < 1e-9, "{tension}");
        assert!(lowest_shown(&[pulse("rings", 0.3)]).is_infinite());
    }
}
