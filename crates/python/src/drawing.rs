//! Figures for Python: what they show is kept, and drawn when it is asked for.

use chainwave_analysis::Measurement;
use chainwave_experiment::{ResultTable, Values};
use chainwave_figures::{BodyMotion, DataRow, Draw, Figure, Format, Picture, StrainMapPanel, Style};
use chainwave_measurement::ChainMotion;
use pyo3::prelude::*;

use crate::failure::Failure;
use crate::table::ArrowTable;

/// A figure that is drawn when it is asked for.
#[pyclass(frozen, module = "chainwave._chainwave")]
pub(crate) struct Drawing {
    picture: Picture,
}

/// Figures by their names.
pub(crate) type Drawings = Vec<(&'static str, Drawing)>;

/// Panel, name in the legend, what stands along both axes and what colours mean, and the numbers.
type Shown = (String, String, String, String, String, ArrowTable);

#[pymethods]
impl Drawing {
    /// The figure as an SVG document.
    fn svg(&self, py: Python<'_>) -> PyResult<String> {
        let drawn = py.detach(|| Ok::<_, Failure>(self.drawn()?.bytes(Format::Svg)?));
        Ok(String::from_utf8_lossy(&drawn?).into_owned())
    }

    /// The numbers that it shows, curve by curve and map by map, in the units of its axes.
    fn data(&self, py: Python<'_>) -> PyResult<Vec<Shown>> {
        let drawn = py.detach(|| self.drawn())?;
        let shown = drawn.data().iter().cloned().map(|set| {
            let numbers = |of: fn(&DataRow) -> f64| Values::from(set.rows.iter().map(of).collect::<Vec<_>>());
            let columns = vec![
                ("x", numbers(|row| row.x.value)),
                ("sigma_x", numbers(|row| row.x.sigma)),
                ("y", numbers(|row| row.y.value)),
                ("sigma_y", numbers(|row| row.y.sigma)),
                ("colour", set.rows.iter().map(|row| row.colour).collect::<Vec<_>>().into()),
            ];
            Ok((set.panel, set.series, set.x, set.y, set.colour, ArrowTable::of(ResultTable { columns })?))
        });
        shown.collect()
    }
}

impl Drawing {
    fn drawn(&self) -> Result<Figure, Failure> {
        Ok(self.picture.draw(&Style::default())?)
    }
}

/// The figures that follow from a motion: displacements of some bodies, and the strain map, beside which those of models stand.
pub(crate) fn drawings(motion: &ChainMotion, measurements: &[(&str, &Measurement)]) -> Drawings {
    let panel = |(title, measurement): &(&str, &Measurement)| {
        let fronts = measurement.fronts.iter().flatten();
        let fronts = fronts
            .map(|front| (front.gap, front.peak_time_s.value, front.edge_time_s.map(|edge| edge.value)));
        StrainMapPanel::new(*title, &measurement.strain.times_s, &measurement.strain.strain, fronts)
    };
    let bodies = BodyMotion::spread_over(motion);
    vec![
        ("displacements", Drawing { picture: Picture::Displacements(bodies) }),
        ("strain-map", Drawing { picture: Picture::StrainMap(measurements.iter().map(panel).collect()) }),
    ]
}
