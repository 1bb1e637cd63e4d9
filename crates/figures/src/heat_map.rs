use std::path::Path;

use ndarray::{Array2, ArrayView2};

use crate::FigureError;
use crate::colour::{BLANK, Rgb};
use crate::drawing::{Drawing, Stroke};
use crate::geometry::{Frame, Spot};
use crate::plot::{Labels, Plot, side_margin_mm};
use crate::scale::{Extent, Scale, is_drawable};
use crate::ticks::nice_step;

/// Most columns and rows of a map: finer ones cannot be seen in print and only make the file large.
const MOST_COLUMNS: usize = 300;
const MOST_ROWS: usize = 300;
/// Colours are rounded to so many steps, so that equal neighbours in a column become one rectangle.
const COLOUR_STEPS: f64 = 128.0;
const BAR_GAP_MM: f64 = 3.0;
const BAR_MM: f64 = 2.8;
/// How far a rectangle reaches under the ones that are drawn after it.
const HIDDEN_MM: f64 = 0.1;

/// What stands for several samples in one cell of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Summary {
    /// Their mean.
    Mean,
    /// The middle one in order of gap and time, so that the scatter of the samples is kept.
    Middle,
}

impl Summary {
    /// The summary of the drawable values; `None` without any.
    fn of(self, values: impl Iterator<Item = f64>) -> Option<f64> {
        let drawable: Vec<f64> = values.filter(|&value| is_drawable(value)).collect();
        match self {
            Self::Mean => {
                (!drawable.is_empty()).then(|| drawable.iter().sum::<f64>() / drawable.len() as f64)
            }
            Self::Middle => drawable.get(drawable.len() / 2).copied(),
        }
    }
}

/// The cells of a map: each value fills the rectangle between its edges.
#[derive(Debug, Clone)]
pub(crate) struct Cells {
    /// Borders of the columns, one more than there are columns.
    pub(crate) x_edges: Vec<f64>,
    /// Borders of the rows, one more than there are rows.
    pub(crate) y_edges: Vec<f64>,
    /// Shape `[column, row]`; `None` where nothing was measured.
    pub(crate) values: Array2<Option<f64>>,
}

impl Cells {
    /// Cells of a quantity over gap (row 0 of `values` is gap 1) and time in milliseconds, times `factor`; when there are
    /// many samples or gaps, each cell stands for the measured ones among neighbours.
    pub(crate) fn over_time(
        times_s: &[f64],
        values: &ArrayView2<Option<f64>>,
        factor: f64,
        summary: Summary,
    ) -> Self {
        let n_times = values.ncols().min(times_s.len());
        let (columns, rows) = (groups(values.nrows(), MOST_COLUMNS), groups(n_times, MOST_ROWS));
        let value = |(column, row): (usize, usize)| {
            let gaps = columns[column]..columns[column + 1];
            let samples = gaps.flat_map(|gap| (rows[row]..rows[row + 1]).map(move |sample| [gap, sample]));
            summary.of(samples.filter_map(|place| values[place])).map(|value| factor * value)
        };
        let edges = edges_between(&times_s[..n_times]);
        Self {
            x_edges: columns.iter().map(|&gap| gap as f64 + 0.5).collect(),
            y_edges: rows.iter().filter_map(|&sample| edges.get(sample)).map(|t| 1e3 * t).collect(),
            values: Array2::from_shape_fn((columns.len() - 1, rows.len() - 1), value),
        }
    }

    pub(crate) fn x_extent(&self) -> Option<Extent> {
        Extent::of(self.x_edges.iter().copied()).filter(|_| self.x_edges.len() > 1)
    }

    pub(crate) fn y_extent(&self) -> Option<Extent> {
        Extent::of(self.y_edges.iter().copied()).filter(|_| self.y_edges.len() > 1)
    }

    /// The values that were measured.
    pub(crate) fn measured(&self) -> impl Iterator<Item = f64> {
        self.values.iter().flatten().copied()
    }

    /// Whether some cells, but not all, have no value: these are hatched.
    pub(crate) fn shows_blanks(&self) -> bool {
        self.values.iter().any(Option::is_none) && self.measured().next().is_some()
    }
}

/// Borders of equal groups (but for the last) of `count` neighbours, at most `most` of them.
fn groups(count: usize, most: usize) -> Vec<usize> {
    let size = count.div_ceil(most).max(1);
    (0..=count.div_ceil(size)).map(|group| (group * size).min(count)).collect()
}

/// Borders halfway between neighbours; the outer ones lie as far outside as the next ones lie inside.
pub(crate) fn edges_between(places: &[f64]) -> Vec<f64> {
    let (Some(&first), Some(&last)) = (places.first(), places.last()) else { return Vec::new() };
    let inner: Vec<f64> = places.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    // A single place gets a cell of an arbitrary small width.
    let half = |a: Option<&f64>, b: f64| a.map_or(0.5e-3, |a| (a - b).abs());
    let (head, tail) = (first - half(inner.first(), first), last + half(inner.last(), last));
    std::iter::once(head).chain(inner).chain(std::iter::once(tail)).collect()
}

/// Checks that times fit the columns of a map and increase.
pub(crate) fn check_times(
    stem: &Path,
    times_s: &[f64],
    values: &ArrayView2<Option<f64>>,
) -> Result<(), FigureError> {
    if values.ncols() != times_s.len() {
        return Err(FigureError::Length {
            stem: stem.into(),
            what: "columns of a map, one for each time".into(),
            expected: times_s.len(),
            found: values.ncols(),
        });
    }
    let rising = |pair: &&[f64]| pair[0].is_finite() && pair[1].is_finite() && pair[0] < pair[1];
    match times_s.windows(2).position(|pair| !rising(&pair)) {
        None => Ok(()),
        Some(i) => Err(FigureError::Value {
            stem: stem.into(),
            what: format!("times_s[{}]", i + 1),
            expected: format!("a time after {} s", times_s[i]),
            found: format!("{} s", times_s[i + 1]),
        }),
    }
}

/// From values to colours.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ColourScale {
    pub(crate) scale: Scale,
    pub(crate) map: fn(f64) -> Rgb,
    /// Whether values lie below and above the scale; they take its end colours and the bar says so.
    pub(crate) beyond: (bool, bool),
}

impl ColourScale {
    /// A scale over nearly all values: one in four thousand at each end may lie beyond it.
    pub(crate) fn covering(mut values: Vec<f64>, map: fn(f64) -> Rgb) -> Self {
        values.sort_by(f64::total_cmp);
        let spare = values.len() / 4000;
        let inner = values.get(spare).copied().zip(values.iter().rev().nth(spare).copied());
        let extent = inner.map(|(low, high)| {
            let Extent { low, high } = Extent { low, high }.padded(0.0);
            let step = nice_step(high - low, 12);
            Extent { low: (low / step).floor() * step, high: (high / step).ceil() * step }
        });
        Self::fixed(extent, &values, map)
    }

    /// A scale symmetric around zero that holds 99 % of the values, and at least 3 to each side.
    pub(crate) fn symmetric(values: &[f64], map: fn(f64) -> Rgb) -> Self {
        let mut sizes: Vec<f64> = values.iter().map(|value| value.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let outer = sizes.get(sizes.len() * 99 / 100).map(|size| size.ceil().max(3.0));
        Self::fixed(outer.map(|size| Extent { low: -size, high: size }), values, map)
    }

    fn fixed(extent: Option<Extent>, values: &[f64], map: fn(f64) -> Rgb) -> Self {
        let beyond = extent.map_or((false, false), |extent| {
            (values.iter().any(|&v| v < extent.low), values.iter().any(|&v| v > extent.high))
        });
        Self { scale: Scale::linear(extent), map, beyond }
    }

    fn colour(&self, value: f64) -> Option<Rgb> {
        let share = self.scale.share(value)?.clamp(0.0, 1.0);
        Some((self.map)((share * COLOUR_STEPS).round() / COLOUR_STEPS))
    }

    /// Room for the bar right of a frame of the given height.
    pub(crate) fn bar_margin_mm(&self, drawing: &Drawing, height_mm: f64) -> f64 {
        BAR_GAP_MM + BAR_MM + side_margin_mm(drawing, &self.scale, height_mm)
    }

    /// The bar that explains the colours, right of a frame.
    pub(crate) fn bar(&self, drawing: &mut Drawing, beside: Frame, label: &str) {
        let frame = Frame::new(beside.right + BAR_GAP_MM, beside.top, BAR_MM, beside.height());
        let n_steps = 64;
        for i in (0..n_steps).filter(|_| !self.scale.is_empty()) {
            let at = |i: usize| frame.bottom - frame.height() * i as f64 / n_steps as f64;
            // Each step reaches under the next one, so that viewers show no seams.
            let top = if i + 1 < n_steps { at(i + 2).max(frame.top) } else { at(i + 1) };
            let step = Frame { top, bottom: at(i), ..frame };
            drawing.fill(step, (self.map)((i as f64 + 0.5) / n_steps as f64));
        }
        self.arrows(drawing, frame);
        drawing.outline(frame, Stroke::axis());
        let bar = Plot { frame, x: Scale::linear(Some(Extent { low: 0.0, high: 1.0 })), y: self.scale };
        bar.right_axis(drawing, &self.scale, label);
    }

    /// Triangles at the ends beyond which values lie.
    fn arrows(&self, drawing: &mut Drawing, frame: Frame) {
        let middle = frame.centre().0;
        let ends = [(self.beyond.0, frame.bottom, 1.8, 0.0), (self.beyond.1, frame.top, -1.8, 1.0)];
        for (present, y, reach, share) in ends {
            if present {
                let corners = vec![(frame.left, y), (frame.right, y), (middle, y + reach)];
                let closed = [&corners[..], &corners[..2]].concat();
                drawing.area(corners, (self.map)(share));
                drawing.line(&closed, Stroke::axis());
            }
        }
    }
}

/// Fills a plot with cells and draws its axes; cells without a value stay hatched.
pub(crate) fn draw(drawing: &mut Drawing, plot: &Plot, cells: &Cells, colours: &ColourScale, labels: Labels) {
    let no_values = cells.measured().next().is_none();
    if cells.shows_blanks() {
        drawing.fill(plot.frame, BLANK);
        drawing.hatch(plot.frame);
    }
    for column in 0..cells.values.nrows() {
        fill_column(drawing, plot, cells, colours, column);
    }
    let shown = if no_values { Plot { y: Scale::linear(None), ..*plot } } else { *plot };
    shown.map_axes(drawing, labels);
}

/// The cells of one column, runs of one colour as one rectangle.
fn fill_column(drawing: &mut Drawing, plot: &Plot, cells: &Cells, colours: &ColourScale, column: usize) {
    let colour_of = |row: usize| cells.values[[column, row]].and_then(|value| colours.colour(value));
    let n_rows = cells.values.ncols();
    let mut row = 0;
    while row < n_rows {
        let colour = colour_of(row);
        let end = (row + 1..n_rows).find(|&next| colour_of(next) != colour).unwrap_or(n_rows);
        if let Some(fill) = colour {
            // Reach under the run above and the column to the right, which are drawn later, so that viewers show no
            // seams between them.
            let hidden = end < n_rows && colour_of(end).is_some();
            let low = plot.spot(cells.x_edges[column], cells.y_edges[row]);
            let high = plot.spot(cells.x_edges[column + 1], cells.y_edges[end]);
            let overlap = (HIDDEN_MM, if hidden { HIDDEN_MM } else { 0.0 });
            if let (Some(low), Some(high)) = (low, high) {
                fill_run(drawing, plot.frame, (low, high), overlap, fill);
            }
        }
        row = end;
    }
}

fn fill_run(drawing: &mut Drawing, within: Frame, (low, high): (Spot, Spot), overlap: Spot, fill: Rgb) {
    let frame = Frame {
        left: low.0.max(within.left),
        right: (high.0 + overlap.0).min(within.right),
        top: (high.1 - overlap.1).max(within.top),
        bottom: low.1.min(within.bottom),
    };
    if frame.width() > 0.0 && frame.height() > 0.0 {
        drawing.fill(frame, fill);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_recording_becomes_means_of_neighbours() {
        let times_s: Vec<f64> = (0..1000).map(f64::from).collect();
        let values = Array2::from_shape_fn((2, 1000), |(n, i)| (i % 4 != 1 && n == 0).then_some(i as f64));
        let cells = Cells::over_time(&times_s, &values.view(), 2.0, Summary::Mean);
        assert_eq!(cells.values.dim(), (2, 250));
        // Samples 0, 2 and 3, times two; the sum of small whole numbers is exact.
        assert_eq!(cells.values[[0, 0]], Some(2.0 * 5.0 / 3.0));
        assert_eq!(cells.values[[1, 0]], None);
        let picked = Cells::over_time(&times_s, &values.view(), 2.0, Summary::Middle);
        assert_eq!(picked.values[[0, 0]], Some(4.0));
        assert_eq!(cells.y_edges.len(), 251);
        assert_eq!((cells.y_edges[0], cells.y_edges[1]), (-500.0, 3500.0));
    }

    #[test]
    fn a_group_never_reaches_beyond_the_last_sample() {
        assert_eq!(groups(7, 3), [0, 3, 6, 7]);
        assert_eq!(groups(3, 300), [0, 1, 2, 3]);
        assert_eq!(groups(0, 300), [0]);
        for count in 0..2000 {
            assert!(groups(count, 300).len() <= 301);
        }
    }

    #[test]
    fn a_few_outliers_lie_beyond_the_colours() {
        let mut values: Vec<f64> = (0..10_000).map(|i| f64::from(i) * 1e-3).collect();
        values.push(1e6);
        let colours = ColourScale::covering(values, crate::colour::sequential);
        assert_eq!(colours.beyond, (false, true));
        assert!(colours.scale.extent().unwrap().high < 11.0);
    }
}
