//! Whether light moves across the picture, as a shadow's edge does: bodies lose or gain light one after the other while they hardly move.
//!
//! Light that does not change with time, however uneven, gives a body what its place gives it: a body that keeps its place keeps its
//! light. Light that changes everywhere at once, as lamps flicker, gives all bodies of a frame the same. Neither a lens out of focus
//! nor a reflection changes contrast and mean of grey values in one proportion, as less light does. So a shadow is what changes both by
//! more than still light could over the way that the body went meanwhile, and not so for the other bodies of the frame that went no farther.

use std::num::NonZero;

use chainwave_measurement::{Position, Recording, Region, map_in_parallel, median, robust_sigma_about_zero};

use crate::finding::Finding;
use crate::setup::Setup;
use crate::tracked::{Tracked, TrackedRecording};
use crate::tracks::{FollowedBody, RecordingTracks};

/// What a finding of this kind is called.
pub(crate) const MOVING_LIGHT: &str = "moving_light";
/// Recordings that are looked at, spread evenly over all.
const MOST_RECORDINGS: usize = 64;
/// Frames of each, spread evenly.
const MOST_FRAMES: usize = 48;
/// Subsets in all of them together.
const MOST_READ: usize = 8192;
/// Still light changes by less than this share (in its logarithm) over a quarter of a subset's half size: more would be an edge by which
/// the subset's own grey values differ by half from one side to the other.
const MOST_STILL: f64 = 0.1;
/// Standard deviations of a change from one frame that is looked at to the next; the largest of a thousand pairs of frames, as many as 48
/// frames have, exceeds it by chance in one of a million bodies.
const TOLD_SIGMAS: f64 = 6.0;
/// Of two differences that should be in one proportion, the smaller one is at least this share of it.
const IN_PROPORTION: f64 = 0.5;

/// Light that moves across the pictures, where any recording shows it.
pub(crate) fn moving_light(setup: &Setup, tracked: &Tracked, n_threads: NonZero<usize>) -> Option<Finding> {
    let n = tracked.recordings.len().min(MOST_RECORDINGS);
    let chosen: Vec<&TrackedRecording> =
        (0..n).map(|i| &tracked.recordings[i * tracked.recordings.len() / n]).collect();
    let tracking = &setup.experiment.tracking;
    let half_px = [tracking.half_width_px, tracking.half_height_px];
    let found = map_in_parallel(n, n_threads, |i| {
        let one = chosen[i];
        let recording = setup.open(&one.trial).ok()?;
        LightChange::largest(recording.as_ref(), &one.tracks, half_px, MOST_READ / n)
    });
    let told = || found.iter().zip(&chosen).filter_map(|(found, one)| Some((found.as_ref()?, one)));
    let (largest, one) = told().max_by(|a, b| a.0.excess.total_cmp(&b.0.excess))?;
    let (n_told, moved_px) = (told().count(), largest.moved_px);
    Some(Finding {
        code: MOVING_LIGHT,
        subject: "the light".into(),
        text: format!(
            "a shadow, or a lamp's light, moves across the pictures of {n_told} of {n} recordings: body {} of {} has {:.0} % of its light at {:.3} ms \
             as compared with {:.3} ms, while it moved by {moved_px:.1} px and others did not change as much. At its edge places are shifted, \
             bodies at rest too, as if the camera moved, and pictures differ from those at rest (hint: steady light, or frames before it comes)",
            largest.body,
            one.trial.recording,
            100.0 * largest.log_ratio.exp(),
            1e3 * largest.times_s[1],
            1e3 * largest.times_s[0],
        ),
    })
}

/// How a body's light changed between two frames.
#[derive(Debug, Clone, PartialEq)]
struct LightChange {
    body: usize,
    times_s: [f64; 2],
    /// Logarithm of the second frame's light over the first's.
    log_ratio: f64,
    moved_px: f64,
    /// How many times the most is that still light could have changed.
    excess: f64,
}

impl LightChange {
    /// The change of a recording that exceeds most what still or common light could do; `None` where none does.
    fn largest(
        recording: &dyn Recording,
        tracks: &RecordingTracks,
        half_px: [usize; 2],
        most_read: usize,
    ) -> Option<Self> {
        let n_frames = tracks.times_s.len();
        let n = MOST_FRAMES.min(most_read / tracks.bodies.len().max(1)).min(n_frames);
        let frames: Vec<usize> = (0..n).map(|i| i * n_frames / n).collect();
        let mut lit: Vec<Vec<Option<Lit>>> = vec![Vec::new(); tracks.bodies.len()];
        for frame in &frames {
            for (body, readings) in tracks.bodies.iter().zip(&mut lit) {
                let position = body.positions.get(*frame).and_then(|found| found.as_ref().ok());
                readings.push(position.and_then(|at| Lit::of(recording, *frame, at, half_px)));
            }
        }
        let lit: Vec<Vec<Option<Lit>>> = lit.iter().map(|readings| without_spikes(readings)).collect();
        let quarter_px = 0.25 * half_px[0].min(half_px[1]) as f64;
        let of_body = |(index, followed): (usize, &FollowedBody)| {
            let moved_px = |body: usize, [first, second]: [usize; 2]| {
                Some(lit[body][first]?.apart_px(&lit[body][second]?, half_px))
            };
            // Bodies that went farther have changed their light by themselves.
            let relative = |pair: [usize; 2]| {
                let own_px = moved_px(index, pair)?.max(quarter_px);
                let is_beside = |other: &usize| {
                    *other != index && moved_px(*other, pair).is_some_and(|moved| moved <= own_px)
                };
                let others =
                    (0..lit.len()).filter(is_beside).filter_map(|other| log_ratio(&lit[other], pair));
                Some(log_ratio(&lit[index], pair)? - median(others.collect())?)
            };
            let steps = (1..n).filter_map(|j| relative([j - 1, j]));
            // Still light may have changed on this body and, the other way, on those beside.
            let least = 2.0 * MOST_STILL + TOLD_SIGMAS * robust_sigma_about_zero(steps)?;
            let of_pair = |pair: [usize; 2]| {
                let [first, second] = pair.map(|k| lit[index][k]);
                let (first, second) = (first?, second?);
                let (own, beside) = (log_ratio(&lit[index], pair)?, relative(pair)?);
                let moved_px = first.apart_px(&second, half_px);
                let excess = beside.abs() / (least * (moved_px / quarter_px).max(1.0));
                let is_light = own / beside > IN_PROPORTION && first.is_relit(&second, own);
                (excess > 1.0 && is_light).then(|| Self {
                    body: followed.body,
                    times_s: pair.map(|k| tracks.times_s[frames[k]]),
                    log_ratio: own,
                    moved_px,
                    excess,
                })
            };
            let pairs = (0..n).flat_map(|j| (0..j).map(move |i| [i, j]));
            pairs.filter_map(of_pair).max_by(|a, b| a.excess.total_cmp(&b.excess))
        };
        let changes = tracks.bodies.iter().enumerate().filter_map(of_body);
        changes.max_by(|a, b| a.excess.total_cmp(&b.excess))
    }
}

/// What a frame shows of a body's light.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Lit {
    place_px: [f64; 2],
    turn_rad: f64,
    /// Mean of its grey values, in counts.
    mean: f64,
    /// Covariance of neighbouring grey values, which has no share of the pixels' noise, in squared counts.
    contrast: f64,
}

impl Lit {
    /// By weights that fall to nothing towards the edge of the subset, and move with it by fractions of a pixel. `None` where it lies partly
    /// outside, or has no contrast.
    fn of(recording: &dyn Recording, frame: usize, at: &Position, half_px: [usize; 2]) -> Option<Self> {
        let place_px = [at.x_px.value, at.y_px.value];
        let first = [0, 1].map(|axis| place_px[axis].floor() as i64 - half_px[axis] as i64);
        let size = half_px.map(|half| 2 * half + 2);
        let [x, y] = first.map(|first| usize::try_from(first).ok());
        let region = Region { x: x?, y: y?, width: size[0], height: size[1] };
        let mut pixels = vec![0.0_f32; region.n_pixels()];
        recording.read_region(frame, region, &mut pixels).ok()?;
        let weight = |axis: usize, k: usize| {
            let from_middle = (first[axis] + k as i64) as f64 - place_px[axis];
            (1.0 - (from_middle / (half_px[axis] as f64 + 1.0)).powi(2)).powi(2)
        };
        let weights = [0, 1].map(|axis| (0..size[axis]).map(|k| weight(axis, k)).collect::<Vec<f64>>());
        let grey = |column: usize, row: usize| f64::from(pixels[row * size[0] + column]);
        let sum = |of: &dyn Fn(usize, usize) -> f64| -> f64 {
            (0..size[1])
                .map(|row| weights[1][row] * (0..size[0]).map(|k| weights[0][k] * of(k, row)).sum::<f64>())
                .sum()
        };
        let of_all: f64 = weights.iter().map(|weights| weights.iter().sum::<f64>()).product();
        let mean = sum(&grey) / of_all;
        let beside = |column: usize, row: usize| {
            let here = grey(column, row) - mean;
            let right = grey((column + 1).min(size[0] - 1), row) - mean;
            let below = grey(column, (row + 1).min(size[1] - 1)) - mean;
            0.5 * here * (right + below)
        };
        let contrast = sum(&beside) / of_all;
        let turn_rad = at.theta_rad.map_or(0.0, |turn| turn.value);
        (contrast > 0.0).then_some(Self { place_px, turn_rad, mean, contrast })
    }

    /// How far a subset went between two frames, at its edge where it turned as well.
    fn apart_px(&self, other: &Self, half_px: [usize; 2]) -> f64 {
        let [x, y] = [0, 1].map(|axis| other.place_px[axis] - self.place_px[axis]);
        let radius_px = half_px[0].max(half_px[1]) as f64;
        x.hypot(y) + radius_px * (other.turn_rad - self.turn_rad).abs()
    }

    /// Whether the mean changed with the contrast as light does: bright and dark grey values lie above black by more than they differ.
    fn is_relit(&self, other: &Self, log_ratio: f64) -> bool {
        let of_light = (log_ratio.exp() - 1.0) * self.contrast.sqrt();
        (other.mean - self.mean) / of_light > IN_PROPORTION
    }
}

/// Logarithm of the light in the second of two frames over that in the first: contrast goes as its square.
fn log_ratio(of_body: &[Option<Lit>], [first, second]: [usize; 2]) -> Option<f64> {
    Some(0.5 * (of_body[second]?.contrast / of_body[first]?.contrast).ln())
}

/// Readings whose grey values are the medians of three in a row, so that one frame that is torn or covered counts for nothing; those at
/// both ends have no two neighbours and are left out.
fn without_spikes(readings: &[Option<Lit>]) -> Vec<Option<Lit>> {
    let around = |k: usize| -> Option<Lit> {
        let (before, here, after) =
            ((*readings.get(k.checked_sub(1)?)?)?, readings[k]?, (*readings.get(k + 1)?)?);
        let of_three = |of: fn(&Lit) -> f64| median(vec![of(&before), of(&here), of(&after)]);
        let (mean, contrast) = (of_three(|one| one.mean)?, of_three(|one| one.contrast)?);
        Some(Lit { mean, contrast, ..here })
    };
    (0..readings.len()).map(around).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use chainwave_analysis::probability::normal_beyond;
    use chainwave_measurement::{Estimate, MemoryRecording};
    use chainwave_synthetic::pictures::{Surface, counts, picture_by_samples};
    use ndarray::Array2;

    use super::*;

    const N_BODIES: usize = 5;
    const N_FRAMES: usize = 120;
    const SIZE_PX: [usize; 2] = [320, 64];
    const HALF_PX: [usize; 2] = [8, 8];

    /// What is filmed: bodies that go off one after the other, 0.2 px a frame, drawn in closed form.
    struct Film {
        /// Turn of a body while it moves, in radians a frame.
        turn_rad: f64,
        /// The camera's own motion along the chain in a frame, in pixels.
        camera_px: fn(f64) -> f64,
        /// The tone that the camera sees of a tone at a column and row in a frame.
        light: fn(f64, [f64; 2], f64) -> f64,
        /// Whether pictures lose their focus more and more.
        blurs: bool,
    }

    const SOUND: Film = Film { turn_rad: 0.0, camera_px: |_| 0.0, light: |_, _, tone| tone, blurs: false };

    impl Film {
        fn change(&self) -> Option<LightChange> {
            let mut frames = Vec::new();
            let mut bodies: Vec<FollowedBody> = (1..=N_BODIES)
                .map(|body| FollowedBody { body, method: String::new(), positions: Vec::new() })
                .collect();
            for frame in 0..N_FRAMES {
                let t = frame as f64;
                let of_body = |k: usize| {
                    let since = (t - 20.0 * (k + 1) as f64).max(0.0);
                    let shift = [0.2 * since + (self.camera_px)(t), 0.0];
                    let (centre, turn) = ([40.0 + 56.0 * k as f64, 32.0], self.turn_rad * since);
                    let surface = Surface {
                        tone: 0.6,
                        contrast: 0.4,
                        ..Surface::turned_disc(k as u64, 4.5, (centre, 24.0), turn, shift)
                    };
                    (surface, [centre[0] + shift[0], centre[1]], turn)
                };
                let seen: Vec<_> = (0..N_BODIES).map(of_body).collect();
                let surfaces: Vec<Surface> = seen.iter().map(|(surface, ..)| surface.clone()).collect();
                let tones = picture_by_samples(SIZE_PX, &surfaces).unwrap();
                let tones = if self.blurs { blurred(&tones, 3.0 * t / N_FRAMES as f64) } else { tones };
                let lit = Array2::from_shape_fn(tones.dim(), |(row, column)| {
                    (self.light)(t, [column as f64, row as f64], tones[(row, column)])
                });
                frames.push(counts(&lit, 12, 0.01, 7, frame as u64).unwrap().into_raw_vec_and_offset().0);
                for (body, (_, [x_px, y_px], turn)) in bodies.iter_mut().zip(seen) {
                    let exact = |value: f64| Estimate::new(value, 0.01);
                    body.positions.push(Ok(Position {
                        x_px: exact(x_px),
                        y_px: exact(y_px),
                        theta_rad: Some(exact(turn)),
                        zncc: 0.99,
                        iterations: 3,
                    }));
                }
            }
            let times_s = (0..N_FRAMES).map(|frame| frame as f64 * 4e-5).collect();
            let recording = MemoryRecording::new(SIZE_PX[0], 12, frames);
            LightChange::largest(&recording, &RecordingTracks { times_s, bodies }, HALF_PX, MOST_READ)
        }
    }

    /// A mean over squares whose side grows: between 1 and 1 + `extra` pixels.
    fn blurred(tones: &Array2<f64>, extra: f64) -> Array2<f64> {
        let (height, width) = tones.dim();
        let at = |row: i64, column: i64| {
            tones[(row.clamp(0, height as i64 - 1) as usize, column.clamp(0, width as i64 - 1) as usize)]
        };
        let weight = |apart: i64| {
            if apart == 0 { 1.0 } else { 0.5 * (extra - 2.0 * (apart.abs() - 1) as f64).clamp(0.0, 2.0) }
        };
        Array2::from_shape_fn((height, width), |(row, column)| {
            let apart = || (-2..=2_i64).flat_map(|down| (-2..=2_i64).map(move |right| (down, right)));
            let sum: f64 = apart()
                .map(|(down, right)| {
                    weight(down) * weight(right) * at(row as i64 + down, column as i64 + right)
                })
                .sum();
            sum / apart().map(|(down, right)| weight(down) * weight(right)).sum::<f64>()
        })
    }

    #[test]
    fn a_shadow_that_moves_is_told() {
        // A soft edge that crosses the picture within the film, and one that comes when all bodies but the last have gone off.
        let crossing = Film {
            light: |t, [x, _], tone| tone * (1.0 - 0.4 * normal_beyond((x - 2.6 * t) / 16.0)),
            ..SOUND
        };
        let late = Film {
            light: |t, [x, _], tone| tone * (1.0 - 0.4 * normal_beyond((x - 8.0 * (t - 70.0)) / 16.0)),
            ..SOUND
        };
        // Light that goes on over the last body.
        let lamp = Film {
            light: |t, [x, _], tone| {
                tone * (1.0 + 0.4 * normal_beyond((50.0 - t) / 5.0) * normal_beyond((240.0 - x) / 10.0))
            },
            ..SOUND
        };
        for (film, share) in [(crossing, 0.6), (late, 0.6), (lamp, 1.4)] {
            let found = film.change().unwrap_or_else(|| panic!("a change to {share}"));
            // At most all of the shadow; what is told is a change between two frames in which the body hardly moves.
            let ratio = found.log_ratio.exp();
            assert!((ratio - 1.0) / (share - 1.0) > 0.5 && (ratio - 1.0) / (share - 1.0) < 1.1, "{found:?}");
        }
    }

    #[test]
    fn what_is_no_shadow_is_not_told() {
        let lamps_flicker: fn(f64, [f64; 2], f64) -> f64 =
            |t, _, tone| tone * (0.8 + 0.2 * (TAU * t / 37.0).sin());
        let glare: fn(f64, [f64; 2], f64) -> f64 =
            |_, [x, y], tone| tone + 0.12 * ((x / 9.0).sin() * (y / 11.0).cos()).powi(2);
        let uneven: fn(f64, [f64; 2], f64) -> f64 =
            |_, [x, _], tone| tone * (0.7 + 0.3 * (TAU * x / 90.0).sin());
        for (name, film) in [
            ("a sound camera", SOUND),
            ("lamps that flicker", Film { light: lamps_flicker, ..SOUND }),
            ("still reflections", Film { light: glare, ..SOUND }),
            ("light that is uneven and still", Film { light: uneven, ..SOUND }),
            ("a camera that moves", Film { camera_px: |t| 2.0 * (t / 9.0).sin(), ..SOUND }),
            ("bodies that turn", Film { turn_rad: 0.01, ..SOUND }),
            ("a lens that loses its focus", Film { blurs: true, ..SOUND }),
        ] {
            let found = film.change();
            assert!(found.is_none(), "{name}: {found:?}");
        }
    }
}
