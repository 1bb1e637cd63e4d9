//! Peak potential energy along the chain, with and without damping, and what took it (the paper's Fig. 4).

use serde::{Deserialize, Serialize};

use crate::colour::{CHAIN, DAMPING, DISPERSION, EXPERIMENT, Rgb, WHITE};
use crate::drawing::{Anchor, Columns, Drawing};
use crate::figure::{Draw, Figure};
use crate::geometry::{PageRect, Spot};
use crate::legend::{self, LegendEntry, LegendKey};
use crate::plot::{self, Labels, Plot};
use crate::scale::{Extent, Scale};
use crate::series::{DataPoint, Look, MarkerShape, PlotMarker};
use crate::stroke::{Dash, Stroke};
use crate::ticks::fixed;
use crate::{FigureError, Style};

const HEIGHT_MM: f64 = 58.0;
const BAR_MM: f64 = 4.5;
/// Room for the bar of shares with its gap and names, in em of the names besides what is fixed.
const NAMES_EM: f64 = 8.3;
const BAR_GAP_MM: f64 = 3.0;
/// Height of a line of the bar's names, in em.
const LINE_EM: f64 = 1.24;
const GAPS: &str = "gap number $n$";
const MEASURED: Look =
    Look::Markers(PlotMarker { shape: MarkerShape::Diamond, colour: EXPERIMENT, hollow: false });

/// What the energy that enters the chain is lost to, as shares of the peak energy of gap 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EnergyShares {
    /// The drop without damping, 0 to 1.
    pub dispersion: f64,
    /// Damping: what it adds to the drop, 0 to 1.
    pub damping: f64,
    /// The gap whose energy is shared, where it is to be named.
    #[serde(default)]
    pub gap: Option<usize>,
    /// Whether the drop without damping is named for dispersion and rarefaction, which it is due to in a chain whose bodies and gaps are all alike and
    /// free of the ground. In another one it also goes where the chain changes, or into the ground's springs.
    #[serde(default = "yes")]
    pub is_of_uniform_chain: bool,
}

/// What figures that were kept by earlier versions say.
fn yes() -> bool {
    true
}

/// Peak potential energy of each gap relative to the input energy, or to that of a gap.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PeakEnergy {
    /// Measured ratio against gap number.
    pub measured: Vec<DataPoint>,
    /// Computed ratio with damping: gap number and ratio.
    pub damped: Vec<(f64, f64)>,
    /// Computed ratio without damping: gap number and ratio.
    pub undamped: Vec<(f64, f64)>,
    /// The shares for the bar, if known.
    pub shares: Option<EnergyShares>,
    /// The gap whose measured energy the ratios are to, where no model tells the input.
    #[serde(default)]
    pub relative_to_gap: Option<usize>,
}

impl PeakEnergy {
    /// What the ratios are to, as mathematics.
    fn ratio(&self) -> String {
        match self.relative_to_gap {
            Some(gap) => format!("$Ψ(n)$ / $Ψ({gap})$"),
            None => "$Ψ(n)$ / input".into(),
        }
    }

    /// The name of the ordinate.
    fn label(&self) -> String {
        format!("peak energy {}", self.ratio())
    }
}

impl Draw for PeakEnergy {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        layout(style, self).map(Figure::new)
    }
}

fn layout(style: &Style, energy: &PeakEnergy) -> Result<Drawing, FigureError> {
    check_shares(energy.shares)?;
    let enlarged = enlarged_extent(energy);
    let columns = if enlarged.is_some() && energy.shares.is_some() { Columns::Two } else { Columns::One };
    let mut drawing = Drawing::new(style, columns)?;
    // Two columns are more than the curves need.
    drawing.width_mm = drawing.width_mm.min(1.5 * style.column_mm);
    let (y, page) = (energy_scale(energy), drawing.width_mm);
    let left = plot::side_margin_mm(&drawing, &y, HEIGHT_MM);
    let names = BAR_GAP_MM + BAR_MM + 1.2 + NAMES_EM * drawing.label_mm();
    let width = page - left - if energy.shares.is_some() { names } else { 1.5 };
    let top = legend::draw(&mut drawing, &entries(energy), (left, page), 1.0) + 1.5;
    let x = Scale::whole(gap_extent(energy).map(|extent| extent.padded(0.02)));
    let plot = Plot::new(PageRect::new(left, top, width, HEIGHT_MM), x, y);
    draw_curves(&mut drawing, &plot, energy);
    if let Some(shares) = energy.shares {
        draw_shares(&mut drawing, &plot, shares);
    }
    if let Some(extent) = enlarged {
        let curves = [&energy.damped, &energy.undamped].into_iter().flat_map(|curve| plot.pieces(curve));
        let measured = energy.measured.iter().filter_map(|point| plot.spot(point.x.value, point.y.value));
        let lines: Vec<Vec<Spot>> = curves.chain(measured.map(|spot| vec![spot])).collect();
        let axes = (Scale::whole(Some(extent.padded(0.05))), enlarged_scale(energy, extent));
        if let Some(inset) = plot.inset(&mut drawing, axes, (0.6 * width, 0.56 * HEIGHT_MM), &lines) {
            draw_curves(&mut drawing, &inset, energy);
            inset.axes(&mut drawing, Labels { x: "$n$", y: &energy.ratio() });
        }
    }
    plot.axes(&mut drawing, Labels { x: GAPS, y: &energy.label() });
    record(&mut drawing, energy);
    drawing.extend_to(top + HEIGHT_MM + plot::bottom_margin_mm(&drawing));
    Ok(drawing)
}

/// Keeps the numbers for the figure's table.
fn record(drawing: &mut Drawing, energy: &PeakEnergy) {
    let exact = |curve: &[(f64, f64)]| curve.iter().map(|&(n, psi)| DataPoint::exact(n, psi)).collect();
    let damped: Vec<DataPoint> = exact(&energy.damped);
    let undamped: Vec<DataPoint> = exact(&energy.undamped);
    for (name, points) in [(NAMES[0], &energy.measured), (NAMES[1], &damped), (NAMES[2], &undamped)] {
        plot::record(drawing, "", name, Labels { x: GAPS, y: &energy.label() }, points);
    }
}

fn check_shares(shares: Option<EnergyShares>) -> Result<(), FigureError> {
    let Some(EnergyShares { dispersion, damping, .. }) = shares else { return Ok(()) };
    // The margin lets shares that were computed as differences round.
    let valid = |share: f64| (-1e-9..=1.0 + 1e-9).contains(&share);
    if valid(dispersion) && valid(damping) && valid(dispersion + damping) {
        return Ok(());
    }
    Err(FigureError::Value {
        figure: "peak energy",
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
    let reach = energy.measured.iter().flat_map(DataPoint::y_reach);
    let extent = Extent::of(computed.chain(reach)).map(|extent| extent.including(0.0).including(1.0));
    Scale::linear(extent.map(|Extent { low, high }| Extent { low, high: high + 0.05 * (high - low) }))
}

/// The energies of the measured gaps and of the models there.
fn enlarged_scale(energy: &PeakEnergy, gaps: Extent) -> Scale {
    let inside = |n: f64| (gaps.low..=gaps.high).contains(&n);
    let computed = energy.damped.iter().chain(&energy.undamped).filter(|point| inside(point.0));
    let reach = energy.measured.iter().flat_map(DataPoint::y_reach);
    Scale::linear(Extent::of(computed.map(|point| point.1).chain(reach)).map(|extent| extent.padded(0.08)))
}

fn damped_stroke() -> Stroke {
    Stroke::new(1.2, CHAIN, Dash::Solid)
}

fn undamped_stroke() -> Stroke {
    Stroke::new(1.2, CHAIN, Dash::Dotted)
}

/// Names of the measured, damped and undamped energies.
const NAMES: [&str; 3] = ["experiment", "chain model", "chain model without damping"];

fn entries(energy: &PeakEnergy) -> Vec<LegendEntry> {
    let entries = [
        (energy.measured.is_empty(), LegendEntry::new(NAMES[0], MEASURED)),
        (energy.damped.is_empty(), LegendEntry::new(NAMES[1], LegendKey::Line(damped_stroke()))),
        (energy.undamped.is_empty(), LegendEntry::new(NAMES[2], LegendKey::Line(undamped_stroke()))),
    ];
    entries.into_iter().filter(|(empty, _)| !empty).map(|(_, entry)| entry).collect()
}

fn draw_curves(drawing: &mut Drawing, plot: &Plot, energy: &PeakEnergy) {
    plot.line(drawing, &energy.undamped, undamped_stroke());
    plot.line(drawing, &energy.damped, damped_stroke());
    plot.series(drawing, &energy.measured, MEASURED);
}

/// One part of the bar, from one ordinate down to another.
struct BarPart {
    from: f64,
    to: f64,
    fill: Rgb,
    lines: Vec<String>,
}

fn parts(style: &Style, shares: EnergyShares) -> [BarPart; 3] {
    let EnergyShares { dispersion, damping, gap, is_of_uniform_chain } = shares;
    let percent = |share: f64| format!("{} %", style.decimals(&fixed(100.0 * share, 1)));
    let (first, second) = (1.0 - dispersion, 1.0 - dispersion - damping);
    let wave = match is_of_uniform_chain {
        true => vec!["dispersion".into(), "and rarefaction".into(), percent(dispersion)],
        false => vec!["without damping".into(), percent(dispersion)],
    };
    let kept = gap.map_or_else(|| "kept".into(), |gap| format!("kept in gap {gap}"));
    [
        BarPart { from: 1.0, to: first, fill: DISPERSION, lines: wave },
        BarPart { from: first, to: second, fill: DAMPING, lines: vec!["damping".into(), percent(damping)] },
        BarPart { from: second, to: 0.0, fill: WHITE, lines: vec![kept, percent(second.max(0.0))] },
    ]
}

/// The bar stands beside the plot on the same ordinate, so its borders continue the ends of the curves.
fn draw_shares(drawing: &mut Drawing, plot: &Plot, shares: EnergyShares) {
    let height = |value: f64| {
        let share = plot.y.share(value).unwrap_or(0.0).clamp(0.0, 1.0);
        plot.frame.bottom - share * plot.frame.height()
    };
    let left = plot.frame.right + BAR_GAP_MM;
    let (em, line_mm) = (drawing.label_mm(), LINE_EM * drawing.label_mm());
    let parts = parts(&drawing.style, shares);
    let names: Vec<(f64, f64)> = parts
        .iter()
        .map(|part| (0.5 * (height(part.from) + height(part.to)), line_mm * part.lines.len() as f64))
        .collect();
    let centres = plot::spread(&names, (plot.frame.top, plot.frame.bottom), 0.8);
    for (part, (centre, (_, size))) in parts.iter().zip(centres.iter().zip(&names)) {
        let bar = PageRect { left, right: left + BAR_MM, top: height(part.from), bottom: height(part.to) };
        if bar.height() > 0.0 {
            drawing.fill(bar, part.fill);
            drawing.outline(bar, Stroke::axis());
        }
        for (i, line) in part.lines.iter().enumerate() {
            let y = centre - 0.5 * size + (i as f64 + 0.5) * line_mm;
            drawing.text(line, (left + BAR_MM + 1.2, y), em, Anchor::Start);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chainwave_measurement::Estimate;

    fn energy(n_gaps: i32, shares: EnergyShares) -> PeakEnergy {
        let curve = |rate: f64| (1..=n_gaps).map(f64::from).map(move |n| (n, (-rate * (n - 1.0)).exp()));
        PeakEnergy {
            measured: (1..=20).map(|n| DataPoint::measured(f64::from(n), Estimate::new(0.7, 0.02))).collect(),
            damped: curve(0.02).collect(),
            undamped: curve(0.006).collect(),
            shares: Some(shares),
            relative_to_gap: None,
        }
    }

    fn shares(dispersion: f64, damping: f64) -> EnergyShares {
        EnergyShares { dispersion, damping, gap: None, is_of_uniform_chain: true }
    }

    #[test]
    fn labels_are_there_and_nothing_overlaps_for_any_shares() {
        for (dispersion, damping) in [(0.768, 0.193), (0.0, 0.0), (1.0, 0.0), (0.01, 0.98), (0.0, 1.0)] {
            for n_gaps in [25, 250] {
                let shares = EnergyShares { gap: Some(167), ..shares(dispersion, damping) };
                let energy = energy(n_gaps, shares);
                let drawing = layout(&Style::default(), &energy).unwrap();
                drawing.assert_readable();
                assert!(drawing.says("peak energy Ψ(n) / input"));
                assert!(drawing.says(&format!("{:.1} %", 100.0 * dispersion)), "{:?}", drawing.labels());
                // Only of the long chain the measured gaps are enlarged.
                assert_eq!(drawing.says("Ψ(n) / input"), n_gaps == 250);
            }
        }
    }

    #[test]
    fn impossible_shares_are_refused_and_no_values_say_so() {
        for (dispersion, damping) in [(0.9, 0.2), (-0.1, 0.2), (f64::NAN, 0.1)] {
            let energy = energy(25, shares(dispersion, damping));
            assert!(layout(&Style::default(), &energy).is_err());
        }
        let nothing = PeakEnergy {
            measured: vec![],
            damped: vec![],
            undamped: vec![],
            shares: None,
            relative_to_gap: None,
        };
        let drawing = layout(&Style::default(), &nothing).unwrap();
        assert!(drawing.says("no data"));
    }

    #[test]
    fn what_the_bar_and_the_axis_are_of_is_named() {
        let of_other = EnergyShares { is_of_uniform_chain: false, gap: Some(17), ..shares(0.5, 0.2) };
        let drawing = layout(&Style::default(), &energy(25, of_other)).unwrap();
        drawing.assert_readable();
        assert!(drawing.says("without damping") && drawing.says("kept in gap 17"), "{:?}", drawing.labels());
        assert!(!drawing.says("dispersion"));
        let measured = PeakEnergy { relative_to_gap: Some(2), shares: None, ..energy(25, shares(0.5, 0.2)) };
        let measured = PeakEnergy { damped: vec![], undamped: vec![], ..measured };
        let drawing = layout(&Style::default(), &measured).unwrap();
        assert!(drawing.says("peak energy Ψ(n) / Ψ(2)"), "{:?}", drawing.labels());
    }
}
