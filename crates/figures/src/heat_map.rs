//! Maps: cells over two axes in colours, the bar that explains them, and hatching where nothing was measured.

use chainwave_measurement::Estimate;
use ndarray::{Array2, ArrayView2};

use crate::FigureError;
use crate::colour::{BLANK, Rgb, diverging};
use crate::data::{DataRow, DataSet};
use crate::drawing::{Drawing, Raster};
use crate::geometry::PageRect;
use crate::plot::{Labels, Plot, side_margin_mm};
use crate::rich_text::plain;
use crate::scale::{Extent, Scale, is_drawable};
use crate::stroke::Stroke;
use crate::style::ColourMap;

/// Most columns and rows of a map: finer ones cannot be seen in print and only make the file large.
const MOST_COLUMNS: usize = 300;
const MOST_ROWS: usize = 300;
const BAR_GAP_MM: f64 = 3.0;
const BAR_MM: f64 = 2.8;
/// Pixels of a map's picture per millimetre: 500 per inch.
const PIXELS_PER_MM: f64 = 500.0 / 25.4;

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
    /// A map without cells.
    pub(crate) fn none() -> Self {
        Self { x_edges: Vec::new(), y_edges: Vec::new(), values: Array2::from_elem((0, 0), None) }
    }

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

    /// The value at a place of the map's axes.
    #[cfg(test)]
    fn at(&self, x: f64, y: f64) -> Option<f64> {
        self.values[[cell_of(&self.x_edges, x)?, cell_of(&self.y_edges, y)?]]
    }

    /// The middles of the cells and their values.
    fn rows(&self) -> Vec<DataRow> {
        let middle = |edges: &[f64], i: usize| Estimate::new(0.5 * (edges[i] + edges[i + 1]), 0.0);
        let cells = self.values.indexed_iter();
        let row = |((column, row), &colour): ((usize, usize), &Option<f64>)| DataRow {
            x: middle(&self.x_edges, column),
            y: middle(&self.y_edges, row),
            colour,
        };
        cells.map(row).collect()
    }

    /// Whether some cells, but not all, have no value: these are hatched.
    pub(crate) fn shows_blanks(&self) -> bool {
        self.values.iter().any(Option::is_none) && self.measured().next().is_some()
    }
}

/// The cell between whose edges, which rise or fall, a place lies.
fn cell_of(edges: &[f64], place: f64) -> Option<usize> {
    let falls = edges.first() > edges.last();
    let n_before = edges.partition_point(|&edge| if falls { edge >= place } else { edge <= place });
    (1..edges.len()).contains(&n_before).then(|| n_before - 1)
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
    figure: &'static str,
    times_s: &[f64],
    values: &ArrayView2<Option<f64>>,
) -> Result<(), FigureError> {
    if values.ncols() != times_s.len() {
        return Err(FigureError::Length {
            figure,
            what: "columns of a map, one for each time".into(),
            expected: times_s.len(),
            found: values.ncols(),
        });
    }
    let rising = |pair: &&[f64]| pair[0].is_finite() && pair[1].is_finite() && pair[0] < pair[1];
    match times_s.windows(2).position(|pair| !rising(&pair)) {
        None => Ok(()),
        Some(i) => Err(FigureError::Value {
            figure,
            what: format!("times_s[{}]", i + 1),
            expected: format!("a time after {} s", times_s[i]),
            found: format!("{} s", times_s[i + 1]),
        }),
    }
}

/// How shares of a scale become colours.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Hues {
    /// From the low end of the scale to its high end.
    Sequential(ColourMap),
    /// White at zero, full colour at this size to either side.
    Diverging(f64),
}

/// From values to colours.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ColourScale {
    /// The range that the bar shows.
    pub(crate) scale: Scale,
    hues: Hues,
    /// Whether values lie below and above the scale; they take its end colours and the bar says so.
    beyond: (bool, bool),
}

impl ColourScale {
    /// A scale over nearly all values: the share `spare` at each end may lie beyond it.
    pub(crate) fn covering(mut values: Vec<f64>, spare: f64, map: ColourMap) -> Self {
        values.sort_by(f64::total_cmp);
        let extent = inner_extent(&values, spare).map(rounded);
        Self::over(Scale::linear(extent), &values, Hues::Sequential(map))
    }

    /// A scale for values with a sign: white at zero, colours of equal strength for equal sizes, over nearly all values as in
    /// [`ColourScale::covering`].
    pub(crate) fn signed(values: Vec<f64>, spare: f64) -> Self {
        Self::signed_from(values, spare, f64::NEG_INFINITY)
    }

    /// The same that reaches no lower than to `lowest`.
    pub(crate) fn signed_from(mut values: Vec<f64>, spare: f64, lowest: f64) -> Self {
        values.sort_by(f64::total_cmp);
        let bounded = |Extent { low, high }: Extent| {
            rounded(Extent { low: low.max(lowest).min(high), high }).including(0.0)
        };
        let extent = inner_extent(&values, spare).map(bounded);
        let size = extent.map_or(1.0, |Extent { low, high }| high.max(-low));
        Self::over(Scale::linear(extent), &values, Hues::Diverging(size))
    }

    /// A scale symmetric around zero that holds 99 % of the values, and at least 3 to each side.
    pub(crate) fn symmetric(values: &[f64]) -> Self {
        let mut sizes: Vec<f64> = values.iter().map(|value| value.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let size = sizes.get(sizes.len() * 99 / 100).map(|size| size.ceil().max(3.0));
        let extent = size.map(|size| Extent { low: -size, high: size });
        Self::over(Scale::linear(extent), values, Hues::Diverging(size.unwrap_or(1.0)))
    }

    /// Colours in order along any scale.
    pub(crate) fn along(scale: Scale, map: ColourMap, beyond: (bool, bool)) -> Self {
        Self { scale, hues: Hues::Sequential(map), beyond }
    }

    fn over(scale: Scale, values: &[f64], hues: Hues) -> Self {
        let beyond = scale.extent().map_or((false, false), |extent| {
            (values.iter().any(|&v| v < extent.low), values.iter().any(|&v| v > extent.high))
        });
        Self { scale, hues, beyond }
    }

    fn colour(&self, value: f64) -> Option<Rgb> {
        self.scale.share(value).map(|share| self.colour_at(share.clamp(0.0, 1.0)))
    }

    /// The colour at a share of the bar.
    fn colour_at(&self, share: f64) -> Rgb {
        match (self.hues, self.scale.extent()) {
            (Hues::Diverging(size), Some(Extent { low, high })) => {
                diverging(0.5 + 0.5 * (low + share * (high - low)) / size)
            }
            (Hues::Sequential(map), _) => map.colour(share),
            (Hues::Diverging(_), None) => diverging(share),
        }
    }

    /// Room for the bar right of a frame of the given height.
    pub(crate) fn bar_margin_mm(&self, drawing: &Drawing, height_mm: f64) -> f64 {
        BAR_GAP_MM + BAR_MM + side_margin_mm(drawing, &self.scale, height_mm)
    }

    /// The bar that explains the colours, right of a frame.
    pub(crate) fn bar(&self, drawing: &mut Drawing, beside: PageRect, label: &str) {
        let frame = PageRect::new(beside.right + BAR_GAP_MM, beside.top, BAR_MM, beside.height());
        let n_steps = 256;
        if !self.scale.is_empty() {
            let colour = |step: usize| self.colour_at(1.0 - (step as f64 + 0.5) / n_steps as f64);
            let pixels = (0..n_steps).map(colour).collect();
            drawing.picture(frame, Raster { width_px: 1, height_px: n_steps, pixels });
        }
        self.arrows(drawing, frame);
        drawing.outline(frame, Stroke::axis());
        let bar = Plot::new(frame, Scale::linear(Some(Extent { low: 0.0, high: 1.0 })), self.scale);
        bar.right_axis(drawing, &self.scale, label);
    }

    /// Triangles at the ends beyond which values lie.
    fn arrows(&self, drawing: &mut Drawing, frame: PageRect) {
        let middle = frame.centre().0;
        let ends = [(self.beyond.0, frame.bottom, 1.8, 0.0), (self.beyond.1, frame.top, -1.8, 1.0)];
        for (present, y, reach, share) in ends {
            if present {
                let corners = vec![(frame.left, y), (frame.right, y), (middle, y + reach)];
                let closed = [&corners[..], &corners[..2]].concat();
                drawing.area(corners, self.colour_at(share));
                drawing.line(&closed, Stroke::axis());
            }
        }
    }
}

/// The range of sorted values without the share `spare` at each end.
pub(crate) fn inner_extent(values: &[f64], spare: f64) -> Option<Extent> {
    let spare = (spare * values.len() as f64) as usize;
    let inner = values.get(spare).copied().zip(values.iter().rev().nth(spare).copied());
    inner.map(|(low, high)| Extent { low, high })
}

/// A range widened to round numbers.
fn rounded(extent: Extent) -> Extent {
    let Extent { low, high } = extent.padded(0.0);
    let step = 0.1 * 10.0_f64.powf((high - low).log10().floor());
    Extent { low: (low / step).floor() * step, high: (high / step).ceil() * step }
}

/// Fills a plot with cells and draws its axes; where there is no value, it is hatched.
pub(crate) fn draw(drawing: &mut Drawing, plot: &Plot, cells: &Cells, colours: &ColourScale, labels: Labels) {
    if cells.measured().next().is_none() {
        return Plot::new(plot.frame, plot.x, Scale::linear(None)).map_axes(drawing, labels);
    }
    let n_px = |length_mm: f64| (length_mm * PIXELS_PER_MM).round().max(1.0) as usize;
    let (width_px, height_px) = (n_px(plot.frame.width()), n_px(plot.frame.height()));
    // Where the cells of each column and row of pixels lie, so that uneven cells keep their sizes.
    let cells_along = |scale: &Scale, edges: &[f64], n_px: usize, turned: bool| -> Vec<Option<usize>> {
        let places: Vec<Option<f64>> = edges.iter().map(|&edge| scale.share(edge)).collect();
        let places: Vec<f64> = places.into_iter().flatten().collect();
        let share = |i: usize| (i as f64 + 0.5) / n_px as f64;
        (0..n_px).map(|i| cell_of(&places, if turned { 1.0 - share(i) } else { share(i) })).collect()
    };
    let columns = cells_along(&plot.x, &cells.x_edges, width_px, false);
    let rows = cells_along(&plot.y, &cells.y_edges, height_px, true);
    let inks = cells.values.mapv(|value| value.and_then(|value| colours.colour(value)));
    let ink = |row: Option<usize>, column: Option<usize>| inks[[column?, row?]];
    let mut pixels = Vec::with_capacity(width_px * height_px);
    for &row in &rows {
        pixels.extend(columns.iter().map(|&column| ink(row, column).unwrap_or(BLANK)));
    }
    drawing.picture(plot.frame, Raster { width_px, height_px, pixels });
    let at = |along: &[Option<usize>], share: f64| {
        along[((share * along.len() as f64) as usize).min(along.len() - 1)]
    };
    drawing.hatch(plot.frame, |x, y| ink(at(&rows, y), at(&columns, x)).is_none());
    plot.map_axes(drawing, labels);
}

/// Keeps a map's values for the figure's table.
pub(crate) fn record(drawing: &mut Drawing, panel: &str, cells: &Cells, labels: Labels, colour: &str) {
    let [panel, x, y, colour] = [panel, labels.x, labels.y, colour].map(plain);
    drawing.data.push(DataSet { panel, series: "map".into(), x, y, colour, rows: cells.rows() });
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
        let colours = ColourScale::covering(values, 1e-3, ColourMap::Viridis);
        assert_eq!(colours.beyond, (false, true));
        assert!(colours.scale.extent().unwrap().high < 11.0);
    }

    #[test]
    fn zero_is_white_and_equal_sizes_are_equally_strong_however_lopsided_the_values_are() {
        let values: Vec<f64> = (-100..=600).map(|i| f64::from(i) * 0.01).collect();
        let colours = ColourScale::signed(values, 0.0);
        assert_eq!(colours.scale.extent(), Some(Extent { low: -1.0, high: 6.0 }));
        assert_eq!(colours.colour(0.0), Some(diverging(0.5)));
        assert_eq!(colours.colour(6.0), Some(diverging(1.0)));
        assert_eq!(colours.colour(-1.0), Some(diverging(0.5 - 0.5 / 6.0)));
    }

    #[test]
    fn each_place_has_the_value_of_its_cell() {
        let values = Array2::from_shape_fn((2, 3), |(column, row)| Some((10 * column + row) as f64));
        let cells = Cells { x_edges: vec![0.0, 1.0, 4.0], y_edges: vec![3.0, 2.0, 1.0, 0.0], values };
        assert_eq!(cells.at(0.5, 2.5), Some(0.0));
        assert_eq!(cells.at(3.9, 0.1), Some(12.0));
        assert_eq!(cells.at(4.1, 0.1), None);
        assert_eq!(cells.at(0.5, 3.1), None);
        // The middle of 1 and 4 is exact.
        assert_eq!((cells.rows()[5].x, cells.rows()[5].colour), (Estimate::new(2.5, 0.0), Some(12.0)));
    }
}
