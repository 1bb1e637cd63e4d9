//! Something that stands still before the subsets, such as a cable, or behind them: found by the pixels that do not change, and left out.
//!
//! The films are drawn in closed form by a renderer that knows no matcher.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, and shows what it measured")]

mod support;

use chainwave_correlation::{Cover, ReferenceFrames, Settings, track};
use chainwave_measurement::{Lost, MemoryRecording, Position, Subset, Track};
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
    let is_false = |(frame, found): (usize, &Result<Position, _>)| {
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
        let positions: Vec<&[Result<Position, Lost>]> =
            tracks.iter().map(|track| track.positions.as_slice()).collect();
        assert!(Cover::ground(&film, &grid(40), &REFERENCE, &positions).unwrap().is_none());
    }
}

/// Half of a marker's side, and of a subset that is larger than it.
const MARKER_HALF_PX: f64 = 13.0;
const SUBSET_HALF_PX: usize = 16;

/// Markers 120 px apart that slide over ground of the same texture, by a third of a pixel a frame, after two frames at rest.
fn film_of_markers(seed: u64) -> (MemoryRecording, Vec<Subset>) {
    let [marker, ground] = [1, 2].map(|which| Speckle::new(10 * seed + which, Speckle::RADIUS_PX));
    let subsets: Vec<Subset> = grid(120)
        .into_iter()
        .map(|subset| Subset { half_width_px: SUBSET_HALF_PX, half_height_px: SUBSET_HALF_PX, ..subset })
        .collect();
    let frame = |frame: usize| {
        let gone_px = slid_px(frame);
        let on_ground = ground.render(|place| place);
        let mut image = marker.render(|[x, y]| [x + gone_px, y]);
        for (i, (value, ground)) in image.iter_mut().zip(on_ground).enumerate() {
            let (x, y) = ((i % SIZE[0]) as f64, (i / SIZE[0]) as f64);
            let is_within = |subset: &Subset| {
                (x - subset.x_px - gone_px).abs() <= MARKER_HALF_PX
                    && (y - subset.y_px).abs() <= MARKER_HALF_PX
            };
            if !subsets.iter().any(is_within) {
                *value = ground;
            }
        }
        sense(&image, 0.01, 100 * seed + frame as u64)
    };
    (recorded((0..40).map(frame).collect()), subsets)
}

fn slid_px(frame: usize) -> f64 {
    0.35 * frame.saturating_sub(1) as f64
}

#[test]
fn ground_in_a_subset_is_found_and_left_out() {
    let ([mut before, mut around], mut n, mut n_within) = ([0, 0], 0, 0);
    for seed in 1..2 {
        let (film, subsets) = film_of_markers(seed);
        let mut tracks = followed(&film, &subsets);
        before += tracks.iter().map(n_lost).sum::<usize>();
        let mut shares = Vec::new();
        // The first tracks are lost early; what they show of the ground lets the next ones go farther.
        for _ in 0..3 {
            let positions: Vec<&[Result<Position, Lost>]> =
                tracks.iter().map(|track| track.positions.as_slice()).collect();
            let ground = Cover::ground(&film, &subsets, &REFERENCE, &positions).unwrap().unwrap();
            shares = ground.subsets().to_vec();
            tracks = followed(&ground.taken_from(&film), &subsets);
        }
        // 27 x 27 of 33 x 33 pixels are the marker: 33 % are ground, some with as little texture as goes along with anything, and the marker's edge
        // belongs to both.
        let all = shares.iter().all(|(_, share)| (0.2..0.45).contains(share));
        assert!(shares.len() == subsets.len() && all, "{shares:?}");
        around += tracks.iter().map(n_lost).sum::<usize>();
        for (subset, track) in subsets.iter().zip(&tracks) {
            for (frame, found) in track.positions.iter().enumerate().skip(2) {
                let Ok(found) = found else { continue };
                n += 1;
                let error = found.x_px.value - subset.x_px - slid_px(frame);
                n_within += usize::from(error.abs() <= 1.96 * found.x_px.sigma);
            }
        }
    }
    let share = f64::from(u32::try_from(n_within).unwrap()) / f64::from(u32::try_from(n).unwrap());
    println!("{before} lost before, {around} around, {:.1} % of {n} within 1.96 sigma", 100.0 * share);
    assert!(before > 4 * around.max(10), "{before} lost before, {around} around");
    assert!(share > 0.9, "{share}");
}

fn n_lost(track: &Track) -> usize {
    track.positions.iter().filter(|found| found.is_err()).count()
}
