//! The table of the book: intervals in fields that bend, at periods and noises.

use crate::intervals::Told;
use crate::{AFFINE, AUTO, cases, told, wave};

/// The table of docs/src/measured/correlation.md.
#[test]
#[ignore = "a table of the book, of several minutes"]
fn table() {
    println!(
        "count: field,affine_held,affine_sigma_mpx,affine_rms_mpx,auto_held,auto_sigma_mpx,auto_rms_mpx"
    );
    for period_px in [50.0, 70.0, 100.0, 150.0, 200.0, 400.0] {
        let cases = cases(wave(0.5, period_px), 4);
        for noise in [0.002, 0.01, 0.03] {
            let [affine, auto] = [AFFINE, AUTO].map(|choice| {
                let Told { inside, rms_px, sigma_px } = told(&cases, noise, choice);
                format!("{:.1} %,{:.1},{:.1}", 100.0 * inside, 1e3 * sigma_px, 1e3 * rms_px)
            });
            println!("count: \"{period_px} px, {:.1} %\",{affine},{auto}", 100.0 * noise);
        }
    }
}
