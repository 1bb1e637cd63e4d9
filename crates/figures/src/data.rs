//! The numbers of a figure as they were drawn, in the units of its axes, and their table.

use chainwave_measurement::Estimate;

use crate::rich_text::plain;
use crate::series::DataPoint;

/// Numbers that one curve, one set of markers or one map of a figure shows.
#[derive(Debug, Clone, PartialEq)]
pub struct DataSet {
    /// Title of the panel; empty where a figure has one panel without a title.
    pub panel: String,
    /// Name in the legend.
    pub series: String,
    /// Quantity and unit along the abscissa.
    pub x: String,
    /// Quantity and unit along the ordinate.
    pub y: String,
    /// Quantity and unit of the colours of a map; empty for curves and markers.
    pub colour: String,
    /// The points, or the middles of a map's cells.
    pub rows: Vec<DataRow>,
}

/// One point of a [`DataSet`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DataRow {
    /// Abscissa with its standard uncertainty (0 where none was given).
    pub x: Estimate,
    /// Ordinate with its standard uncertainty (0 where none was given).
    pub y: Estimate,
    /// The value that a map shows there; `None` where nothing was measured, and for curves and markers.
    pub colour: Option<f64>,
}

impl DataSet {
    /// A curve or markers.
    pub(crate) fn of_points(panel: &str, series: &str, axes: (&str, &str), points: &[DataPoint]) -> Self {
        let rows = points.iter().map(|point| DataRow { x: point.x, y: point.y, colour: None }).collect();
        let (x, y) = (plain(axes.0), plain(axes.1));
        Self { panel: plain(panel), series: plain(series), x, y, colour: String::new(), rows }
    }
}

/// The names of the columns of a figure's table, a line that no other table begins with.
pub const CSV_COLUMNS: &str = "panel,series,x_quantity,x,sigma_x,y_quantity,y,sigma_y,colour_quantity,colour";

/// The table of all sets, one row a point, as comma-separated values; a point that has no place is left out.
pub(crate) fn csv(sets: &[DataSet]) -> String {
    let mut table = format!("{CSV_COLUMNS}\n");
    for set in sets {
        let [panel, series, x, y, colour] =
            [&set.panel, &set.series, &set.x, &set.y, &set.colour].map(|name| quoted(name));
        for row in set.rows.iter().filter(|row| row.x.value.is_finite() && row.y.value.is_finite()) {
            let value = row.colour.map_or_else(String::new, |value| value.to_string());
            let fields = [
                &*panel,
                &series,
                &x,
                &row.x.value.to_string(),
                &row.x.sigma.to_string(),
                &y,
                &row.y.value.to_string(),
                &row.y.sigma.to_string(),
                &colour,
                &value,
            ];
            table.push_str(&fields.join(","));
            table.push('\n');
        }
    }
    table
}

/// A field as RFC 4180 wants it.
fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_with_a_comma_stays_one_field_and_no_number_is_lost() {
        let points = [DataPoint::measured(1.5, Estimate::new(-2.25, 0.125)), DataPoint::exact(f64::NAN, 1.0)];
        let set = DataSet::of_points("(a)", "rings, \"N\" = 300", ("time (ms)", "$u_n$"), &points);
        let table = csv(&[set]);
        let rows: Vec<&str> = table.lines().collect();
        assert_eq!(rows.len(), 2);
        assert_eq!(rows[1], "(a),\"rings, \"\"N\"\" = 300\",time (ms),1.5,0,u_n,-2.25,0.125,,");
    }
}
