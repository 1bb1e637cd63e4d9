//! Pictures of the DIC Challenge, in the folder that `CHAINWAVE_REFERENCE_DATA` names, through the command.

use chainwave_testkit::reference_data;
use tempfile::TempDir;

use crate::support::command::{chainwave, succeed};
use crate::support::table::Table;

/// A strip of CFRP with a hole of 75 px in its middle, pulled along y more and more: no truth is known, but theory.
#[test]
fn the_strain_beside_the_hole_of_sample_12_is_concentrated() {
    let Some(folder) = reference_data("dic/sample12") else { return };
    let results = TempDir::new().expect("a temporary folder can be made");
    let mut elongations = Vec::new();
    for load in ["01", "05", "11"] {
        let field = results.path().join(format!("{load}.parquet"));
        let mut correlate = chainwave();
        correlate.arg("correlate").arg(folder.join("oht_cfrp_00.tiff"));
        correlate.arg(folder.join(format!("oht_cfrp_{load}.tiff")));
        succeed(correlate.args(["--step", "10", "--half-size", "12", "--out"]).arg(&field));
        assert!(field.with_extension("png").is_file(), "a picture of the field is written");
        let [far, beside, above, measured] = strains(&Table::read(&field));
        // Six of the 37 columns of points lie beside the strip, which leaves 0.84; the hole with the bare rim around it takes a thirtieth
        // of these, and two of the 101 rows leave the picture as it is pulled: 0.795.
        assert!(measured > 0.79, "{load}: {measured} of the points are found");
        // Beside a hole elongation is 2 to 3 times that far away (E. G. Kirsch, 1898), less in a mean over 30 px, and above it
        // next to none.
        assert!((1.8..3.2).contains(&(beside / far)), "{load}: {beside} beside the hole, {far} far away");
        assert!(above < 0.8 * far, "{load}: {above} above the hole, {far} far away");
        elongations.push(far);
    }
    assert!(elongations.is_sorted() && elongations[0] > 3e-4, "the load grows: {elongations:?}");
}

/// Mean elongation along y far from the hole, beside it and above it; and the share of points with a position.
fn strains(table: &Table) -> [f64; 4] {
    let [x, y, strain] = ["x_px", "y_px", "strain_yy"].map(|name| table.numbers(name));
    let mean = |within: &dyn Fn(f64, f64) -> bool| {
        let place = |i: usize| x[i].zip(y[i]).is_some_and(|(x, y)| within(x, y));
        let values: Vec<f64> = (0..strain.len()).filter(|&i| place(i)).filter_map(|i| strain[i]).collect();
        values.iter().sum::<f64>() / values.len() as f64
    };
    let n_found = table.numbers("u_px").iter().flatten().count();
    [
        mean(&|_, y| !(240.0..840.0).contains(&y)),
        mean(&|x, y| {
            (525.0..565.0).contains(&y) && ((115.0..145.0).contains(&x) || (250.0..280.0).contains(&x))
        }),
        mean(&|x, y| {
            (170.0..220.0).contains(&x) && ((440.0..480.0).contains(&y) || (600.0..640.0).contains(&y))
        }),
        n_found as f64 / strain.len() as f64,
    ]
}
