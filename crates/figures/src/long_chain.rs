//! Strain over a long chain at several times in one panel (the paper's Fig. 3 a).

use serde::{Deserialize, Serialize};

use crate::drawing::{Anchor, Columns, Drawing};
use crate::figure::{Draw, Figure};
use crate::geometry::PageRect;
use crate::plot::{self, Labels, Plot};
use crate::scale::{Extent, Scale};
use crate::series::DataPoint;
use crate::stroke::{Dash, Stroke};
use crate::ticks::trimmed;
use crate::{FigureError, Style};

const HEIGHT_MM: f64 = 48.0;
const LABELS: Labels = Labels { x: "gap number $n$", y: "compressive strain $−u_n$ (%)" };

/// Strain over the chain at several times.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LongChain {
    /// Times in seconds, each with gap number and strain (negative in compression).
    pub profiles: Vec<(f64, Vec<(f64, f64)>)>,
}

impl Draw for LongChain {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        layout(style, self).map(Figure::new)
    }
}

fn layout(style: &Style, chain: &LongChain) -> Result<Drawing, FigureError> {
    let mut drawing = Drawing::new(style, Columns::Two)?;
    let page = drawing.width_mm;
    let percent = |(n, strain): &(f64, f64)| (*n, -100.0 * strain);
    let curves: Vec<(f64, Vec<(f64, f64)>)> =
        chain.profiles.iter().map(|(t_s, profile)| (*t_s, profile.iter().map(percent).collect())).collect();
    let points = || curves.iter().flat_map(|(_, curve)| curve);
    let x = Extent::of(points().map(|point| point.0)).map(|extent| extent.padded(0.01));
    // Room above the highest peak for its name.
    let y = Extent::of(points().map(|point| point.1)).map(|extent| {
        let Extent { low, high } = extent.including(0.0).padded(0.06);
        Extent { low, high: high + 0.14 * (high - low) }
    });
    let (x, y) = (Scale::whole(x), Scale::linear(y));
    let left = plot::side_margin_mm(&drawing, &y, HEIGHT_MM);
    let plot = Plot::new(PageRect::new(left, 2.0, page - left - 2.0, HEIGHT_MM), x, y);
    plot.level(&mut drawing, 0.0, plot::zero_line());
    for (index, (t_s, curve)) in curves.iter().enumerate() {
        plot.line(
            &mut drawing,
            curve,
            Stroke::new(1.2, style.colour_map.ordered(index, curves.len()), Dash::Solid),
        );
        let numbers: Vec<DataPoint> = curve.iter().map(|&(x, y)| DataPoint::exact(x, y)).collect();
        plot::record(&mut drawing, "", &format!("t = {t_s} s"), LABELS, &numbers);
    }
    for (t_s, curve) in &curves {
        name_peak(&mut drawing, &plot, *t_s, curve);
    }
    plot.axes(&mut drawing, LABELS);
    drawing.extend_to(plot.frame.bottom + plot::bottom_margin_mm(&drawing));
    Ok(drawing)
}

/// The time above the peak, moved up where another name stands.
fn name_peak(drawing: &mut Drawing, plot: &Plot, t_s: f64, curve: &[(f64, f64)]) {
    let drawable = curve.iter().filter(|point| point.1.is_finite());
    let Some(&(n, peak)) = drawable.max_by(|a, b| a.1.total_cmp(&b.1)) else { return };
    let Some((x, mut y)) = plot.spot(n, peak) else { return };
    let em = drawing.number_mm();
    let name = drawing.style.decimals(&format!("{} ms", trimmed(1e3 * t_s, 2)));
    let width = drawing.text_width(&name, em);
    let x = x.clamp(plot.frame.left + 0.5 * width + 1.5, plot.frame.right - 0.5 * width - 1.5);
    y -= em;
    let covers = |y: f64| PageRect::new(x - 0.5 * width, y - 0.6 * em, width, 1.2 * em);
    while drawing.text_frames().iter().any(|(_, frame)| frame.meets(&covers(y))) && y > plot.frame.top + em {
        y -= 0.5 * em;
    }
    if drawing.text_frames().iter().all(|(_, frame)| !frame.meets(&covers(y))) {
        drawing.text(&name, (x, y), em, Anchor::Middle);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_profile_is_named_by_its_time() {
        let profile = |t_ms: f64| {
            let strain =
                move |n: f64| -0.05 * (20.0 / t_ms).sqrt() * (-((n - 1.8 * t_ms) / 9.0).powi(2)).exp();
            (1e-3 * t_ms, (1..=300).map(f64::from).map(|n| (n, strain(n))).collect())
        };
        let chain = LongChain { profiles: [20.0, 52.0, 84.0, 116.0, 148.0].map(profile).to_vec() };
        let drawing = layout(&Style::default(), &chain).unwrap();
        drawing.assert_readable();
        for label in ["20 ms", "148 ms", "gap number n"] {
            assert!(drawing.says(label), "{label}");
        }
        assert_eq!(drawing.data.len(), 5);
    }

    #[test]
    fn without_profiles_it_says_so() {
        let drawing = layout(&Style::default(), &LongChain { profiles: vec![(1.0, vec![])] }).unwrap();
        assert!(drawing.says("no data"));
    }
}
