//! Force over compression of one body, as measured and by the fitted contact law (the inset of the paper's Fig. 1).

use serde::{Deserialize, Serialize};

use crate::drawing::{Columns, Drawing};
use crate::figure::{Draw, Figure};
use crate::geometry::PageRect;
use crate::legend::{self, LegendEntry};
use crate::plot::{self, BARE_MARGIN_MM, Labels, Plot};
use crate::scale::{Extent, Scale};
use crate::series::{DataPoint, Look, Series, looks};
use crate::{FigureError, Style};

const HEIGHT_MM: f64 = 48.0;
const RESIDUAL_HEIGHT_MM: f64 = 18.0;

/// A quasi-static compression test and the law fitted to it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactCurve {
    /// Force in newtons against compression in metres: measured, of an elastic ring, and the fitted laws.
    pub series: Vec<Series>,
    /// Measured force less the fitted law's, in newtons, against compression in metres, for a panel below.
    pub residuals: Option<Series>,
}

impl Draw for ContactCurve {
    fn draw(&self, style: &Style) -> Result<Figure, FigureError> {
        layout(style, self).map(Figure::new)
    }
}

fn layout(style: &Style, curve: &ContactCurve) -> Result<Drawing, FigureError> {
    let mut drawing = Drawing::new(style, Columns::One)?;
    let page = drawing.width_mm;
    // Millimetres and newtons above, millimetres and millinewtons below.
    let series: Vec<Series> = curve.series.iter().map(|series| series.scaled(1e3, 1.0)).collect();
    let residuals: Vec<Series> = curve.residuals.iter().map(|series| series.scaled(1e3, 1e3)).collect();
    let points = || series.iter().flat_map(|series| &series.points);
    let x = Extent::of(points().map(|point| point.x.value)).map(|extent| extent.padded_from_zero(0.03));
    let y = Extent::of(points().flat_map(DataPoint::y_reach)).map(|extent| extent.padded_from_zero(0.06));
    let left_of = residuals.iter().flat_map(|series| &series.points).flat_map(DataPoint::y_reach);
    let residual_y = Scale::linear(Extent::of(left_of).map(|extent| extent.including(0.0).padded(0.1)));
    let (x, y) = (Scale::linear(x), Scale::linear(y));
    let left = plot::side_margin_mm(&drawing, &y, HEIGHT_MM).max(plot::side_margin_mm(
        &drawing,
        &residual_y,
        RESIDUAL_HEIGHT_MM,
    ));
    let looks_above = looks(&series);
    let entries: Vec<LegendEntry> =
        series.iter().zip(&looks_above).map(|(series, look)| LegendEntry::new(&series.name, *look)).collect();
    let top = legend::draw(&mut drawing, &entries, (left, page), 1.0) + 1.5;
    let upper = Plot::new(PageRect::new(left, top, page - left - 1.5, HEIGHT_MM), x, y);
    let labels = Labels { x: "compression $Δ$ (mm)", y: "force $F$ (N)" };
    // A test has so many readings that its markers would hide the law.
    for of_lines in [false, true] {
        let layer = series.iter().zip(&looks_above);
        for (series, look) in layer.filter(|(_, look)| matches!(look, Look::Line(_)) == of_lines) {
            upper.series(&mut drawing, &series.points, *look);
        }
    }
    for series in &series {
        plot::record(&mut drawing, "", &series.name, labels, &series.points);
    }
    let mut bottom = upper.frame.bottom;
    upper.axes(&mut drawing, Labels { x: if residuals.is_empty() { labels.x } else { "" }, ..labels });
    if !residuals.is_empty() {
        let frame = PageRect::new(left, bottom + BARE_MARGIN_MM, upper.frame.width(), RESIDUAL_HEIGHT_MM);
        let lower = Plot::new(frame, x, residual_y);
        let labels = Labels { y: "residual (mN)", ..labels };
        lower.level(&mut drawing, 0.0, plot::zero_line());
        lower.all(&mut drawing, "residual", labels, &residuals, &looks(&residuals));
        lower.axes(&mut drawing, labels);
        bottom = frame.bottom;
    }
    drawing.extend_to(bottom + plot::bottom_margin_mm(&drawing));
    Ok(drawing)
}

#[cfg(test)]
mod tests {
    use super::*;
    use chainwave_measurement::Estimate;

    #[test]
    fn curve_law_and_residuals_are_labelled_and_nothing_overlaps() {
        let force = |mm: f64| 60.1 * (mm + 2.27).powf(0.114) - 60.1 * 2.27_f64.powf(0.114);
        let places = || (0..100).map(|i| 1e-4 * f64::from(i));
        let measured =
            places().map(|x| DataPoint::measured(x, Estimate::new(force(1e3 * x), 5e-3))).collect();
        let law = Series::model("fitted law", places().map(|x| (x, force(1e3 * x))));
        let residuals = Series::model("experiment", places().map(|x| (x, 5e-3 * (2e4 * x).sin())));
        let curve = ContactCurve {
            series: vec![Series::measured("experiment", measured), law],
            residuals: Some(residuals),
        };
        let drawing = layout(&Style::default(), &curve).unwrap();
        drawing.assert_readable();
        for label in ["compression Δ (mm)", "force F (N)", "residual (mN)", "fitted law"] {
            assert!(drawing.says(label), "{label}");
        }
        // 9.9 mm, at the end of the table.
        assert!((drawing.data[0].rows[99].x.value - 9.9).abs() < 1e-12);
    }

    #[test]
    fn without_values_it_says_so() {
        let drawing = layout(&Style::default(), &ContactCurve { series: vec![], residuals: None }).unwrap();
        assert!(drawing.says("no data"));
    }
}
