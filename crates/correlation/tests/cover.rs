//! Something that stands still before the subsets, such as a cable: found by the pixels that do not change, and left out.
//!
//! The films are drawn in closed form by a renderer that knows no matcher.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, and shows what it measured")]

mod support;

use chainwave_correlation::{Cover, ReferenceFrames, Settings, track};
use chainwave_measurement::{MemoryRecording, Subset, Track};
use support::{SIZE, Speckle, grid, recorded, sense};

const N_FRAMES: usize = 12;
/// Rows that the cable covers on each side of its middle, and the counts that it shows.
const HALF_PX: f64 = 3.0;
const CABLE: f64 = 160.0;
const REFERENCE: ReferenceFrames = ReferenceFrames::Single(0);

fn way_px(frame: usize) -> [f64; 2] {
    [1.3 * frame as f64, -0.45 * frame as f64]
}

/// A film of speckle that moves behind a cable that runs obliquely across, or behind none.
fn film(seed: u64, has_cable: bool) -> MemoryRecording {
    let speckle = Speckle::new(seed, Speckle::RADIUS_PX);
    let frame = |frame: usize| {
        let [dx, dy] = way_px(frame);
        let mut image = speckle.render(|[x, y]| [x + dx, y + dy]);
        for (i, value) in image.iter_mut().enumerate() {
            let (x, y) = ((i % SIZE[0]) as f64, (i / SIZE[0]) as f64);
            if has_cable && (y - 0.4 * x - 80.0).abs() < HALF_PX {
                *value = CABLE;
            }
        }
        sense(&image, 0.01, 100 * seed + frame as u64)
    };
    recorded((0..N_FRAMES).map(frame).collect())
}

fn followed(recording: &dyn chainwave_measurement::Recording, subsets: &[Subset]) -> Vec<Track> {
    let settings = Settings { surfaces_bend: true, ..Settings::default() };
    track(recording, subsets, &REFERENCE, &settings, &|_| ()).unwrap()
}

/// Readings of a subset that are called right and are more than half a pixel and six sigmas off.
fn false_readings(subset: &Subset, track: &Track) -> usize {
    let is_false = |(frame, found): (usize, &Result<chainwave_measurement::Position, _>)| {
        let [dx, dy] = way_px(frame);
        found.as_ref().is_ok_and(|found| {
            let errors = [(found.x_px, subset.x_px + dx), (found.y_px, subset.y_px + dy)];
            errors.iter().any(|(place, truth)| {
                let error = (place.value - truth).abs();
                error > 0.5 && error > 6.0 * place.sigma
            })
        })
    };
    track.positions.iter().enumerate().filter(|one| is_false(*one)).count()
}

#[test]
fn a_cable_is_found_and_left_out() {
    let subsets: Vec<Subset> = grid(40)
        .into_iter()
        .map(|subset| Subset { half_width_px: 12, half_height_px: 12, ..subset })
        .collect();
    let (mut before, mut around, mut squares, mut n) = (0, 0, 0.0, 0.0);
    for seed in 1..7 {
        let film = film(seed, true);
        let tracks = followed(&film, &subsets);
        let cover =
            Cover::find(&film, &subsets, &REFERENCE, &tracks.iter().collect::<Vec<_>>()).unwrap().unwrap();
        let covered: Vec<Subset> = cover.subsets().iter().map(|(index, _)| subsets[*index].clone()).collect();
        let again = followed(&cover.taken_from(&film), &covered);
        for ((&(index, share), subset), again) in cover.subsets().iter().zip(&covered).zip(&again) {
            let row_of_cable = 0.4 * subset.x_px + 80.0;
            let away_px = (subset.y_px - row_of_cable).abs();
            // A square of 25 px that was tracked 15 px up and to the right: what is farther away never saw the cable.
            assert!(
                away_px < 12.0 * 1.4 + HALF_PX + 7.0,
                "{}: {share:.2} of it, {away_px:.0} px off",
                subset.name
            );
            if !Cover::explains(&tracks[index], again) {
                continue;
            }
            before += false_readings(subset, &tracks[index]);
            around += false_readings(subset, again);
            for (frame, found) in again.positions.iter().enumerate().skip(1) {
                if let Ok(found) = found {
                    squares +=
                        ((found.x_px.value - subset.x_px - way_px(frame)[0]) / found.x_px.sigma).powi(2);
                    n += 1.0;
                }
            }
        }
    }
    println!(
        "{before} false readings before, {around} around, errors over sigmas {:.2} of {n}",
        (squares / n).sqrt()
    );
    assert!(before >= 8, "{before}: the film asks nothing");
    assert_eq!(around, 0);
    // Readings of a subset share what its mask leaves of the cable's edges; a third more than stated is a tenth of what they were.
    assert!((squares / n).sqrt() < 1.33);
}

#[test]
fn nothing_is_left_out_where_nothing_stands() {
    for seed in 1..4 {
        let film = film(seed, false);
        let tracks = followed(&film, &grid(40));
        let cover = Cover::find(&film, &grid(40), &REFERENCE, &tracks.iter().collect::<Vec<_>>()).unwrap();
        assert!(cover.is_none(), "{:?}", cover.map(|cover| cover.subsets().to_vec()));
    }
}
