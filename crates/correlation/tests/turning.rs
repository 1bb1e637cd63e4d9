//! Methods that only shift a subset, on films of hard-edged discs that turn or leave the picture: within their intervals, or lost.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, and shows what it measured")]
#![expect(clippy::print_stdout, reason = "what each film gave is a table to be read")]

use chainwave_correlation::{Method, ReferenceFrames, Settings};
use chainwave_measurement::{MemoryRecording, Subset};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

const SIZE: [usize; 2] = [300, 200];
const N_FRAMES: usize = 10;
const RADIUS_PX: f64 = 3.0;
/// Light of the ground, of discs, and the standard deviation of the noise, in counts of 12 bit.
const COUNTS: [f64; 3] = [800.0, 3200.0, 200.0];

/// Where each frame shows a point of the first one.
type Motion = fn([f64; 2], usize) -> [f64; 2];

/// A turn by 5.7 degrees a frame about the middle.
fn turning([x, y]: [f64; 2], frame: usize) -> [f64; 2] {
    let (sin, cos) = (0.1 * frame as f64).sin_cos();
    let (x, y) = (x - 150.0, y - 100.0);
    [150.0 + cos * x - sin * y, 100.0 + sin * x + cos * y]
}

/// Half a picture to the right in nine frames.
fn leaving([x, y]: [f64; 2], frame: usize) -> [f64; 2] {
    let k = frame as f64;
    [x + 17.3 * k, y - 4.0 * k.sin()]
}

/// Discs that cover three fifths of the ground around the picture too, so that wherever the surface goes there are discs.
fn film(motion: Motion, seed: u64) -> MemoryRecording {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let around = 200.0;
    let area = (SIZE[0] as f64 + 2.0 * around) * (SIZE[1] as f64 + 2.0 * around);
    let n_discs = (0.6 * area / (std::f64::consts::PI * RADIUS_PX * RADIUS_PX)) as usize;
    let discs: Vec<[f64; 2]> =
        (0..n_discs).map(|_| SIZE.map(|side| random.random_range(-around..side as f64 + around))).collect();
    let normal = |random: &mut Pcg64Mcg| {
        // the sum of twelve has the variance 1
        (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>()
    };
    let frame = |frame: usize| {
        let mut covered = vec![0.0_f64; SIZE[0] * SIZE[1]];
        for disc in &discs {
            let [x, y] = motion(*disc, frame);
            let near = |at: f64, side: usize| {
                let ends =
                    [at - RADIUS_PX - 1.0, at + RADIUS_PX + 2.0].map(|end| end.clamp(0.0, side as f64));
                ends[0] as usize..ends[1] as usize
            };
            for row in near(y, SIZE[1]) {
                for column in near(x, SIZE[0]) {
                    let away = (column as f64 - x).hypot(row as f64 - y);
                    let pixel = &mut covered[row * SIZE[0] + column];
                    *pixel = pixel.max((RADIUS_PX + 0.5 - away).clamp(0.0, 1.0));
                }
            }
        }
        let [ground, light, noise] = COUNTS;
        covered
            .into_iter()
            .map(|share| (ground + (light - ground) * share + noise * normal(&mut random)).round() as f32)
            .collect()
    };
    MemoryRecording::new(SIZE[0], 12, (0..N_FRAMES).map(frame).collect())
}

/// Readings, those that are far from the truth and sure of it, and coordinates within 1.96 sigma.
fn counted(motion: Motion, seed: u64, method: &str) -> [usize; 3] {
    let places = (0..5)
        .flat_map(|row| (0..8).map(move |column| [40.0 + 20.0 * column as f64, 40.0 + 20.0 * row as f64]));
    let subsets: Vec<Subset> = places.map(|[x, y]| Subset::new(format!("{x} {y}"), x, y, 10, 10)).collect();
    let settings = Settings { surfaces_bend: true, ..Settings::default() };
    let by: Method = method.parse().unwrap();
    let film = film(motion, seed);
    let tracks = by.track(&film, &subsets, &ReferenceFrames::Single(0), &settings, &|_| ()).unwrap();
    let mut counts = [0; 3];
    for (subset, track) in subsets.iter().zip(&tracks) {
        for (frame, position) in track.positions.iter().enumerate().skip(1) {
            let Ok(position) = position else { continue };
            let truth = motion([subset.x_px, subset.y_px], frame);
            let errors = [position.x_px.value - truth[0], position.y_px.value - truth[1]];
            let sigmas = [position.x_px.sigma, position.y_px.sigma];
            let away = errors[0].hypot(errors[1]);
            let is_far = away > (6.0 * sigmas[0].max(sigmas[1])).max(0.5);
            if is_far {
                println!("{} in frame {frame} {away:.2} px off: {position:?}", subset.name);
            }
            counts[0] += 1;
            counts[1] += usize::from(is_far);
            counts[2] +=
                errors.iter().zip(sigmas).filter(|(error, sigma)| error.abs() <= 1.96 * sigma).count();
        }
    }
    counts
}

#[test]
fn what_only_shifts_is_right_or_lost_where_the_surface_turns_or_leaves() {
    const SEEDS: std::ops::Range<u64> = 1..4;
    for (motion, name) in [(turning as Motion, "turning"), (leaving, "leaving")] {
        for method in ["icgn-linear-translation", "template-parabola"] {
            let mut sums = [0; 3];
            for seed in SEEDS {
                let counts = counted(motion, seed, method);
                sums.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
            }
            let [n, n_far, n_held] = sums;
            let held = n_held as f64 / (2 * n) as f64;
            println!(
                "{name}, {method}: {n} readings, {n_far} far, {:.1} % of coordinates hold",
                100.0 * held
            );
            assert_eq!(n_far, 0, "{name}, {method}");
            // Readings of one subset share its texture, so that there are as many independent ones as subsets, or fewer where few are found: three
            // standard errors of 95 %.
            let n_independent = (n as f64).min(40.0 * SEEDS.count() as f64);
            assert!(held > 0.95 - 3.0 * (0.95 * 0.05 / n_independent).sqrt(), "{name}, {method}: {held}");
        }
    }
}
