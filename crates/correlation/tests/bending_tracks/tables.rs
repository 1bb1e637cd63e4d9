//! The table of the book: intervals of tracks on surfaces that bend, at periods and noises.

use crate::intervals::Told;
use crate::{AFFINE, AUTO, Asked, Film, told};

/// The table of docs/src/measured/correlation.md; FILMS says of how many films.
#[test]
#[ignore = "a table of several minutes"]
fn table() {
    let n_films: u64 = std::env::var("FILMS").ok().and_then(|n| n.parse().ok()).unwrap_or(4);
    println!("count: film,affine_as_rigid,auto_as_rigid,affine,auto,affine_one_by_one,auto_one_by_one");
    for period_px in [50.0, 70.0, 100.0, 150.0, 200.0, 300.0, 400.0, 1e6] {
        let films: Vec<Film> = (1..=n_films).map(|seed| Film::wave(period_px, seed)).collect();
        for noise in [0.002, 0.01, 0.03] {
            let one = |asked: Asked| Asked { n_points: 1, ..asked };
            let before = |asked: Asked| Asked { surfaces_bend: false, ..asked };
            let cases = [before(AFFINE), before(AUTO), AFFINE, AUTO, one(AFFINE), one(AUTO)];
            let cells = cases.map(|asked| {
                let Told { inside, sigma_px, rms_px } = told(&films, noise, asked);
                format!("\"{:.1} %, {:.1}/{:.1} mpx\"", 100.0 * inside, 1e3 * sigma_px, 1e3 * rms_px)
            });
            let period = if period_px < 1e6 { format!("{period_px} px") } else { "none".to_owned() };
            println!("count: \"{period}, {:.1} %\",{}", 100.0 * noise, cells.join(","));
        }
    }
}
