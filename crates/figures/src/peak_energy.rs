use std::path::Path;

use crate::colour::{BLACK, BLUE, ORANGE, Rgb, SKY_BLUE, VERMILLION, WHITE};
use crate::drawing::{Anchor, Dash, Drawing, LABEL_MM, Stroke};
use crate::geometry::Frame;
use crate::legend::{self, Entry, Key};
use crate::plot::{self, BOTTOM_MARGIN_MM, Labels, Plot};
use crate::scale::{Extent, Scale};
use crate::series::{Look, Marker, MarkerShape, Point};
use crate::ticks::fixed;
use crate::{FigureError, output};

const HEIGHT_MM: f64 = 52.0;
const TITLE_MM: f64 = 5.2;
const BAR_MM: f64 = 4.5;
/// Room for the bar of shares with its gap and names.
const SHARES_MM: f64 = 3.0 + BAR_MM + 1.2 + 22.0;
const LINE_MM: f64 = 3.5;
const MEASURED: Look = Look::Markers(Marker { shape: MarkerShape::Diamond, colour: BLUE, hollow: false });

/// What the energy that enters the chain is lost to, as shares of the peak energy of gap 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnergyShares {
    /// Dispersion and rarefaction: the drop without damping, 0 to 1.
    pub dispersion: f64,
    /// Damping: what it adds to the drop, 0 to 1.
    pub damping: f64,
}

/// Peak potential energy of each gap relative to the input energy.
#[derive(Debug, Clone, PartialEq)]
pub struct PeakEnergy {
    /// Measured ratio against gap number.
    pub measured: Vec<Point>,
    /// Computed ratio with damping: gap number and ratio.
    pub damped: Vec<(f64, f64)>,
    /// Computed ratio without damping: gap number and ratio.
    pub undamped: Vec<(f64, f64)>,
    /// The shares for the bar, if known.
    pub shares: Option<EnergyShares>,
}

/// Draws the peak potential energy along the chain, with and without damping, and a bar of the shares (the paper's
/// Fig. 4). When the measured gaps are less than half of the computed ones, a second panel shows them enlarged.
///
/// # Errors
/// [`FigureError`] when the shares are not between 0 and 1 or add up to more than 1, or a file cannot be written.
pub fn peak_energy(stem: &Path, energy: &PeakEnergy) -> Result<(), FigureError> {
    output::write(stem, &layout(stem, energy)?)
}

fn layout(stem: &Path, energy: &PeakEnergy) -> Result<Drawing, FigureError> {
    check_shares(stem, energy.shares)?;
    let enlarged = enlarged_extent(energy);
    let page_width = if enlarged.is_some() { Drawing::TWO_COLUMNS_MM } else { Drawing::ONE_COLUMN_MM };
    let mut drawing = Drawing::new(page_width)?;
    let y = energy_scale(energy);
    let left = plot::side_margin_mm(&drawing, &y, HEIGHT_MM);
    let shares_width = if energy.shares.is_some() { SHARES_MM } else { 1.5 };
    let rest = page_width - left - shares_width - 1.5;
    let width = if enlarged.is_some() { 0.5 * (rest - left) } else { rest };
    let mut top = legend::draw(&mut drawing, &entries(energy), (left, page_width), 1.0) + 1.5;
    top += if enlarged.is_some() { TITLE_MM } else { 0.0 };
    let x = Scale::whole(gap_extent(energy).map(|extent| extent.padded(0.02)));
    let whole = Plot { frame: Frame::new(left, top, width, HEIGHT_MM), x, y };
    draw_curves(&mut drawing, &whole, energy);
    if let Some(shares) = energy.shares {
        draw_shares(&mut drawing, &whole, shares);
    }
    if let Some(extent) = enlarged {
        let start = page_width - 1.5 - width;
        let frame = Frame::new(start, top, width, HEIGHT_MM);
        draw_curves(&mut drawing, &Plot { frame, x: Scale::whole(Some(extent.padded(0.03))), y }, energy);
        plot::title(&mut drawing, whole.frame, "(a)");
        plot::title(&mut drawing, frame, "(b) measured gaps, enlarged");
    }
    drawing.extend_to(top + HEIGHT_MM + BOTTOM_MARGIN_MM);
    Ok(drawing)
}

fn check_shares(stem: &Path, shares: Option<EnergyShares>) -> Result<(), FigureError> {
    let Some(EnergyShares { dispersion, damping }) = shares else { return Ok(()) };
    // The margin lets shares that were computed as differences round.
    let valid = |share: f64| (-1e-9..=1.0 + 1e-9).contains(&share);
    if valid(dispersion) && valid(damping) && valid(dispersion + damping) {
        return Ok(());
    }
    Err(FigureError::Value {
        stem: stem.into(),
        what: "shares of the energy".into(),
        expected: "two numbers from 0 to 1 that add up to 1 at most".into(),
        found: format!("dispersion {dispersion}, damping {damping}"),
    })
}

fn gap_extent(energy: &PeakEnergy) -> Option<Extent> {
    let computed = energy.damped.iter().chain(&energy.undamped).map(|point| point.0);
    Extent::of(computed.chain(energy.measured.iter().map(|point| point.x.value)))
}

/// The measured gaps, when they are a small part of all.
fn enlarged_extent(energy: &PeakEnergy) -> Option<Extent> {
    let all = gap_extent(energy)?;
    let measured = Extent::of(energy.measured.iter().map(|point| point.x.value))?;
    (measured.high - all.low < 0.5 * (all.high - all.low)).then_some(measured)
}

fn energy_scale(energy: &PeakEnergy) -> Scale {
    let computed = energy.damped.iter().chain(&energy.undamped).map(|point| point.1);
    let reach = energy.measured.iter().flat_map(Point::y_reach);
    let extent = Extent::of(computed.chain(reach)).map(|extent| extent.including(0.0).including(1.0));
    Scale::linear(extent.map(|Extent { low, high }| Extent { low, high: high + 0.05 * (high - low) }))
}

fn damped_stroke() -> Stroke {
    Stroke::new(1.2, VERMILLION, Dash::Solid)
}

fn undamped_stroke() -> Stroke {
    Stroke::new(1.2, BLACK, Dash::Dotted)
}

fn entries(energy: &PeakEnergy) -> Vec<Entry> {
    let entries = [
        (energy.measured.is_empty(), Entry::new("measured", MEASURED)),
        (energy.damped.is_empty(), Entry::new("model", Key::Line(damped_stroke()))),
        (energy.undamped.is_empty(), Entry::new("model without damping", Key::Line(undamped_stroke()))),
    ];
    entries.into_iter().filter(|(empty, _)| !empty).map(|(_, entry)| entry).collect()
}

fn draw_curves(drawing: &mut Drawing, plot: &Plot, energy: &PeakEnergy) {
    plot.line(drawing, &energy.undamped, undamped_stroke());
    plot.line(drawing, &energy.damped, damped_stroke());
    plot.series(drawing, &energy.measured, MEASURED);
    plot.axes(drawing, Labels { x: "gap number n", y: "peak energy Ψ(n) / input" });
}

/// One part of the bar, from one ordinate down to another.
struct Part {
    from: f64,
    to: f64,
    fill: Rgb,
    lines: Vec<String>,
}

fn parts(EnergyShares { dispersion, damping }: EnergyShares) -> [Part; 3] {
    let percent = |share: f64| format!("{} %", fixed(100.0 * share, 1));
    let (first, second) = (1.0 - dispersion, 1.0 - dispersion - damping);
    let wave = vec!["dispersion".into(), "and rarefaction".into(), percent(dispersion)];
    [
        Part { from: 1.0, to: first, fill: SKY_BLUE, lines: wave },
        Part { from: first, to: second, fill: ORANGE, lines: vec!["damping".into(), percent(damping)] },
        Part { from: second, to: 0.0, fill: WHITE, lines: vec!["kept".into(), percent(second.max(0.0))] },
    ]
}

/// The bar stands beside the plot on the same ordinate, so its borders continue the ends of the curves.
fn draw_shares(drawing: &mut Drawing, plot: &Plot, shares: EnergyShares) {
    let height = |value: f64| {
        let share = plot.y.share(value).unwrap_or(0.0).clamp(0.0, 1.0);
        plot.frame.bottom - share * plot.frame.height()
    };
    let left = plot.frame.right + 3.0;
    let parts = parts(shares);
    let names: Vec<(f64, f64)> = parts
        .iter()
        .map(|part| (0.5 * (height(part.from) + height(part.to)), LINE_MM * part.lines.len() as f64))
        .collect();
    let centres = spread(&names, (plot.frame.top, plot.frame.bottom));
    for (part, (centre, (_, size))) in parts.iter().zip(centres.iter().zip(&names)) {
        let bar = Frame { left, right: left + BAR_MM, top: height(part.from), bottom: height(part.to) };
        if bar.height() > 0.0 {
            drawing.fill(bar, part.fill);
            drawing.outline(bar, Stroke::axis());
        }
        for (i, line) in part.lines.iter().enumerate() {
            let y = centre - 0.5 * size + (i as f64 + 0.5) * LINE_MM;
            drawing.text(line, (left + BAR_MM + 1.2, y), LABEL_MM, Anchor::Start);
        }
    }
}

/// Moves blocks of text (centre, height), ordered from the top, apart and between two heights.
fn spread(blocks: &[(f64, f64)], (top, bottom): (f64, f64)) -> Vec<f64> {
    let gap = 0.8;
    let mut centres = Vec::with_capacity(blocks.len());
    let mut free = top;
    for &(centre, height) in blocks {
        let placed = centre.max(free + 0.5 * height);
        free = placed + 0.5 * height + gap;
        centres.push(placed);
    }
    let mut limit = bottom;
    for (centre, (_, height)) in centres.iter_mut().zip(blocks).rev() {
        *centre = centre.min(limit - 0.5 * height);
        limit = *centre - 0.5 * height - gap;
    }
    centres
}

#[cfg(test)]
mod tests {
    use super::*;
    use chainwave_measurement::Estimate;

    fn energy(n_gaps: i32, shares: EnergyShares) -> PeakEnergy {
        let curve = |rate: f64| (1..=n_gaps).map(f64::from).map(move |n| (n, (-rate * (n - 1.0)).exp()));
        PeakEnergy {
            measured: (1..=20).map(|n| Point::measured(f64::from(n), Estimate::new(0.7, 0.02))).collect(),
            damped: curve(0.02).collect(),
            undamped: curve(0.006).collect(),
            shares: Some(shares),
        }
    }

    #[test]
    fn labels_are_there_and_nothing_overlaps_for_any_shares() {
        for (dispersion, damping) in [(0.768, 0.193), (0.0, 0.0), (1.0, 0.0), (0.01, 0.98), (0.0, 1.0)] {
            for n_gaps in [25, 250] {
                let energy = energy(n_gaps, EnergyShares { dispersion, damping });
                let drawing = layout(Path::new("x"), &energy).unwrap();
                drawing.assert_readable();
                let texts: Vec<String> = drawing.text_frames().into_iter().map(|(text, _)| text).collect();
                assert!(texts.contains(&"peak energy Ψ(n) / input".into()));
                assert!(texts.contains(&format!("{:.1} %", 100.0 * dispersion)), "{texts:?}");
            }
        }
    }

    #[test]
    fn impossible_shares_are_refused_and_no_values_say_so() {
        for (dispersion, damping) in [(0.9, 0.2), (-0.1, 0.2), (f64::NAN, 0.1)] {
            let energy = energy(25, EnergyShares { dispersion, damping });
            assert!(layout(Path::new("x"), &energy).is_err());
        }
        let nothing = PeakEnergy { measured: vec![], damped: vec![], undamped: vec![], shares: None };
        let drawing = layout(Path::new("x"), &nothing).unwrap();
        assert!(drawing.text_frames().iter().any(|(text, _)| text == "no data"));
    }
}
