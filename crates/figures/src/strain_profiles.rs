use std::path::Path;

use crate::colour::GREEN;
use crate::drawing::Drawing;
use crate::geometry::Frame;
use crate::legend::{self, Entry, Key};
use crate::plot::{self, BOTTOM_MARGIN_MM, Labels, Plot};
use crate::scale::{Extent, Scale};
use crate::series::{Look, Series, looks};
use crate::ticks::trimmed;
use crate::{FigureError, output};

const PER_ROW: usize = 3;
const HEIGHT_MM: f64 = 44.0;
const GAP_MM: f64 = 4.0;
const TITLE_MM: f64 = 5.2;

/// Strain over the chain at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct ProfilePanel {
    /// The time in seconds.
    pub time_s: f64,
    /// Strain u_n (negative in compression) against gap number, measured or computed.
    pub series: Vec<Series>,
    /// First and last gap of the front, which is shaded.
    pub front: Option<(f64, f64)>,
}

/// Draws strain profiles at several times with common axes (the paper's Fig. 2 d-f).
///
/// A series keeps its look in all panels by its place in the list.
///
/// # Errors
/// [`FigureError`] when there is no panel or a file cannot be written.
pub fn strain_profiles(stem: &Path, panels: &[ProfilePanel]) -> Result<(), FigureError> {
    output::write(stem, &layout(stem, panels)?)
}

fn layout(stem: &Path, panels: &[ProfilePanel]) -> Result<Drawing, FigureError> {
    if panels.is_empty() {
        return Err(FigureError::NoPanels { stem: stem.into() });
    }
    let width = if panels.len() > 1 { Drawing::TWO_COLUMNS_MM } else { Drawing::ONE_COLUMN_MM };
    let mut drawing = Drawing::new(width)?;
    let drawn: Vec<ProfilePanel> = panels.iter().map(in_percent).collect();
    let (x, y) = shared_scales(&drawn);
    let left = plot::side_margin_mm(&drawing, &y, HEIGHT_MM);
    let mut top = legend::draw(&mut drawing, &entries(panels), (left, width), 1.0);
    let n_columns = panels.len().min(PER_ROW);
    let panel_width = (width - 1.5 - left - GAP_MM * (n_columns - 1) as f64) / n_columns as f64;
    for (row, chunk) in drawn.chunks(PER_ROW).enumerate() {
        top += TITLE_MM;
        for (column, panel) in chunk.iter().enumerate() {
            let start = left + column as f64 * (panel_width + GAP_MM);
            let frame = Frame::new(start, top, panel_width, HEIGHT_MM);
            let y_label = if column == 0 { "compressive strain (%)" } else { "" };
            draw_panel(&mut drawing, &Plot { frame, x, y }, panel, y_label);
            let name = format!("t = {} ms", trimmed(1e3 * panel.time_s, 2));
            let title = plot::lettered(row * PER_ROW + column, panels.len(), &name);
            plot::title(&mut drawing, frame, &title);
        }
        top += HEIGHT_MM + BOTTOM_MARGIN_MM;
    }
    drawing.extend_to(top);
    Ok(drawing)
}

/// Percent, positive in compression.
fn in_percent(panel: &ProfilePanel) -> ProfilePanel {
    let series = panel.series.iter().map(|series| series.scaled(1.0, -100.0)).collect();
    ProfilePanel { series, ..panel.clone() }
}

fn shared_scales(panels: &[ProfilePanel]) -> (Scale, Scale) {
    let points = || panels.iter().flat_map(|panel| &panel.series).flat_map(|series| &series.points);
    let x = Extent::of(points().map(|point| point.x.value));
    let y = Extent::of(points().flat_map(|point| point.y_reach()));
    let y = y.map(|extent| extent.including(0.0).padded(0.06));
    (Scale::whole(x.map(|extent| extent.padded(0.03))), Scale::linear(y))
}

fn draw_panel(drawing: &mut Drawing, plot: &Plot, panel: &ProfilePanel, y_label: &str) {
    if let Some(front) = panel.front {
        plot.shade(drawing, front, GREEN.tint(0.22));
    }
    plot.level(drawing, 0.0, plot::zero_line());
    let looks = looks(panel.series.iter().map(|series| series.origin));
    let layers = panel.series.iter().zip(looks);
    // Lines first, so that the measured points stay visible on them.
    let (lines, markers): (Vec<_>, Vec<_>) = layers.partition(|(_, look)| matches!(look, Look::Line(_)));
    for (series, look) in lines.into_iter().chain(markers) {
        plot.series(drawing, &series.points, look);
    }
    plot.axes(drawing, Labels { x: "gap number n", y: y_label });
}

/// The names of the panel with the most series, and the front.
fn entries(panels: &[ProfilePanel]) -> Vec<Entry> {
    let fullest = panels.iter().map(|panel| &panel.series).max_by_key(|series| series.len());
    let series = fullest.map(Vec::as_slice).unwrap_or_default();
    let looks = looks(series.iter().map(|series| series.origin));
    let mut entries: Vec<Entry> =
        series.iter().zip(looks).map(|(series, look)| Entry::new(&series.name, look)).collect();
    if panels.iter().any(|panel| panel.front.is_some()) {
        entries.push(Entry::new("front", Key::Area(GREEN.tint(0.22))));
    }
    entries
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Point;
    use chainwave_measurement::Estimate;

    fn panel(time_s: f64) -> ProfilePanel {
        let strain = |n: f64| -0.05 * (-0.1 * (n - 8.0).powi(2)).exp();
        let gaps = || (1..=25).map(f64::from);
        let measured = gaps().map(|n| Point::measured(n, Estimate::new(strain(n), 1e-3))).collect();
        let series = vec![
            Series::measured("experiment", measured),
            Series::model("discrete elements", gaps().map(|n| (n, strain(n)))),
        ];
        ProfilePanel { time_s, series, front: Some((8.0, 13.0)) }
    }

    #[test]
    fn labels_are_there_and_nothing_overlaps() {
        for count in 1..=5 {
            let drawing = layout(Path::new("x"), &vec![panel(2.73e-3); count]).unwrap();
            drawing.assert_readable();
            let texts: Vec<String> = drawing.text_frames().into_iter().map(|(text, _)| text).collect();
            assert!(texts.iter().any(|text| text.ends_with("t = 2.73 ms")));
            assert!(texts.contains(&"experiment".into()) && texts.contains(&"front".into()));
        }
    }

    #[test]
    fn empty_panels_say_so() {
        assert!(layout(Path::new("x"), &[]).is_err());
        let empty = ProfilePanel { time_s: f64::NAN, series: Vec::new(), front: Some((1.0, f64::NAN)) };
        let drawing = layout(Path::new("x"), &[empty]).unwrap();
        assert!(drawing.text_frames().iter().any(|(text, _)| text == "no data"));
    }
}
