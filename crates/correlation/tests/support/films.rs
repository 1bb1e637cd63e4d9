//! Films of surfaces that jump, turn, stretch, repeat, hide or are replaced, drawn in closed form by a renderer that knows no matcher, and
//! what tracks say of them.

#![expect(unreachable_pub, reason = "a module of several test binaries")]

#[path = "outcome.rs"]
mod outcome;

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::num::NonZero;

use chainwave_correlation::{Acceptance, Method, ReferenceFrames, Settings};
use chainwave_measurement::{Lost, MemoryRecording, Position, Subset, Track};
use chainwave_synthetic::pictures::{Deformation, Surface, Texture, counts, picture};
use outcome::Outcome;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

const SIZE_PX: [usize; 2] = [176, 176];
const MIDDLE_PX: [f64; 2] = [87.5, 87.5];
const N_FRAMES: usize = 12;

/// A film: what each frame shows, and where its points lie in the first.
pub struct Shown {
    pub frames: Vec<Vec<Surface>>,
    pub noise: f64,
    pub subsets: Vec<Subset>,
}

impl Shown {
    pub fn film(&self, seed: u64) -> MemoryRecording {
        let seen = |(number, surfaces): (u64, &Vec<Surface>)| {
            let counts = counts(&picture(SIZE_PX, surfaces).unwrap(), 12, self.noise, seed, number).unwrap();
            counts.into_raw_vec_and_offset().0
        };
        MemoryRecording::new(SIZE_PX[0], 12, (0..).zip(&self.frames).map(seen).collect())
    }

    /// The topmost surface of the first frame at a point.
    fn surface_of(&self, at_px: [f64; 2]) -> Option<usize> {
        (0..self.frames[0].len()).rev().find(|&which| contains(&self.frames[0][which], at_px))
    }

    /// Where a point of the first frame lies in another; `None` where that shows another texture in its stead.
    fn truth(&self, frame: usize, at_px: [f64; 2]) -> Option<[f64; 2]> {
        let which = self.surface_of(at_px)?;
        let (before, after) = (&self.frames[0][which], &self.frames[frame][which]);
        (before.texture == after.texture).then(|| after.deformation.displaced_px(at_px))
    }

    /// Whether a frame shows the whole subset: its corners and middle belong to one surface, lie inside, and nothing lies over them.
    fn shows(&self, frame: usize, subset: &Subset) -> bool {
        let which = self.surface_of([subset.x_px, subset.y_px]);
        let reach = [subset.half_width_px, subset.half_height_px].map(|half| half as f64 + 1.0);
        let sides = [-1.0, 0.0, 1.0];
        sides.iter().flat_map(|x| sides.iter().map(move |y| [x * reach[0], y * reach[1]])).all(|[x, y]| {
            let at_px = [subset.x_px + x, subset.y_px + y];
            let Some(there) = self.truth(frame, at_px) else { return false };
            let covered = |over: &Surface| {
                over.deformation.source_px(there).is_some_and(|source| contains(over, source))
            };
            let over = which.map_or(0, |which| which + 1);
            self.surface_of(at_px) == which
                && there.iter().all(|value| (4.0..SIZE_PX[0] as f64 - 5.0).contains(value))
                && !self.frames[frame][over..].iter().any(covered)
        })
    }

    /// What tracks say of the film.
    pub fn outcome(&self, subsets: &[Subset], tracks: &[Track]) -> Outcome {
        let of_reading = |subset: &Subset, frame: usize, found: &Result<Position, Lost>| {
            let truth = self.truth(frame, [subset.x_px, subset.y_px]);
            let outcome = Outcome::of(found.as_ref().ok(), truth, self.shows(frame, subset));
            if outcome.n_wrong > 0 {
                println!("{} in frame {frame}: {found:?}, truth {truth:?}", subset.name);
            }
            outcome
        };
        let of_track = |(subset, track): (&Subset, &Track)| -> Outcome {
            (0..).zip(&track.positions).map(|(frame, found)| of_reading(subset, frame, found)).sum()
        };
        subsets.iter().zip(tracks).map(of_track).sum()
    }
}

fn contains(surface: &Surface, [x, y]: [f64; 2]) -> bool {
    surface.disc.is_none_or(|([u, v], radius)| (x - u).hypot(y - v) <= radius)
}

fn subset(x_px: f64, y_px: f64, half: usize) -> Subset {
    Subset::new(format!("{x_px} {y_px}"), x_px, y_px, half, half)
}

/// Subsets `step` px apart all over the picture.
pub fn grid(half: usize, step: usize) -> Vec<Subset> {
    let line = || (half + 8..SIZE_PX[0] - half - 8).step_by(step);
    line().flat_map(|y| line().map(move |x| subset(x as f64, y as f64, half))).collect()
}

/// What a case is drawn by.
pub struct Draw {
    random: Pcg64Mcg,
    seed: u64,
}

impl Draw {
    pub fn of(seed: u64) -> Self {
        Self { random: Pcg64Mcg::seed_from_u64(seed), seed }
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.random.random_range(low..high)
    }

    fn noise(&mut self) -> f64 {
        [0.0, 0.02, 0.05, 0.1][self.random.random_range(0..4)]
    }

    fn speckles(&mut self, seed: u64) -> Texture {
        let diameter = self.between(3.0, 5.0);
        Texture::speckles(1000 * self.seed + seed, diameter, MIDDLE_PX, [190.0; 2])
    }

    /// A shift in every direction by up to so many pixels along each axis.
    fn shift(&mut self, most: f64) -> [f64; 2] {
        [self.between(-most, most), self.between(-most, most)]
    }

    fn half(&mut self) -> usize {
        self.random.random_range(10..17)
    }
}

/// A surface that fills the pictures and lies differently in each.
fn plane(draw: &mut Draw, mut lies: impl FnMut(&mut Draw, f64) -> Deformation) -> Shown {
    let surface = Surface::everywhere(draw.speckles(1), Deformation::NONE);
    let mut frames = vec![vec![surface.clone()]];
    for frame in 1..N_FRAMES {
        frames.push(vec![surface.clone().deformed(lies(draw, frame as f64))]);
    }
    let (noise, half) = (draw.noise(), draw.half());
    Shown { frames, noise, subsets: grid(half, 20) }
}

fn jumps(draw: &mut Draw) -> Shown {
    plane(draw, |draw, _| Deformation::rigid(MIDDLE_PX, 0.0, draw.shift(35.0)))
}

fn turns(draw: &mut Draw) -> Shown {
    let step = draw.between(5.0, 30.0) * PI / 180.0;
    plane(draw, |draw, frame| Deformation::rigid(MIDDLE_PX, step * frame, draw.shift(3.0)))
}

fn stretches(draw: &mut Draw) -> Shown {
    let most = [draw.between(-0.35, 0.5), draw.between(-0.35, 0.5)];
    plane(draw, |_, frame| Deformation::stretch(MIDDLE_PX, most.map(|most| most * frame / N_FRAMES as f64)))
}

/// Another texture every fourth frame.
fn cuts(draw: &mut Draw) -> Shown {
    let mut scene = plane(draw, |draw, _| Deformation::rigid(MIDDLE_PX, 0.0, draw.shift(4.0)));
    for frame in (2..N_FRAMES).step_by(4) {
        scene.frames[frame] = vec![Surface::everywhere(draw.speckles(frame as u64), Deformation::NONE)];
    }
    scene
}

/// A textured disc that goes before a plane at rest or moving slowly.
fn hides(draw: &mut Draw) -> Shown {
    let v = draw.shift(2.0);
    let mut scene = plane(draw, |_, frame| Deformation::rigid(MIDDLE_PX, 0.0, v.map(|v| v * frame)));
    let (radius, row) = (draw.between(15.0, 40.0), draw.between(40.0, 130.0));
    for (frame, surfaces) in scene.frames.iter_mut().enumerate() {
        let shift = [25.0 * frame as f64, 0.0];
        surfaces.push(Surface::turned_disc(7 + draw.seed, 4.5, ([-60.0, row], radius), 0.0, shift));
    }
    scene
}

/// Dots on a lattice, at rest or jumping.
fn repeats(draw: &mut Draw) -> Shown {
    let mut scene = plane(draw, |draw, _| Deformation::rigid(MIDDLE_PX, 0.0, draw.shift(20.0)));
    let pitch = draw.between(9.0, 14.0);
    let dots = Texture::dots(pitch, 0.4 * pitch, MIDDLE_PX, [190.0; 2]);
    scene.frames.iter_mut().flatten().for_each(|surface| surface.texture = dots.clone());
    scene
}

/// Dots on a lattice that set out from rest and go to and fro, by less than half a period from frame to frame.
pub fn repeats_slowly(draw: &mut Draw) -> Shown {
    let pitch = draw.between(9.0, 14.0);
    let way = draw.between(0.5, 1.5) * pitch;
    let angle = draw.between(0.0, 2.0 * PI);
    let mut scene = plane(draw, |_, frame| {
        // from rest over one and a half periods of the way, the velocity changing by at most 4 pi^2/24^2 = 0.07 ways a frame
        let along = way * 0.5 * (1.0 - (2.0 * PI * (frame - 1.0).max(0.0) / 24.0).cos());
        Deformation::rigid(MIDDLE_PX, 0.0, [along * angle.cos(), along * angle.sin()])
    });
    let dots = Texture::dots(pitch, 0.4 * pitch, MIDDLE_PX, [190.0; 2]);
    scene.frames.iter_mut().flatten().for_each(|surface| surface.texture = dots.clone());
    scene
}

/// Discs on black that turn by 30 degrees a frame and move by up to 60 px, some out of the picture and back.
fn bodies(draw: &mut Draw) -> Shown {
    let turn = draw.between(0.0, 30.0) * PI / 180.0;
    let centres = [[40.0, 40.0], [130.0, 45.0], [45.0, 132.0], [134.0, 130.0]];
    let velocity = [draw.shift(60.0), draw.shift(60.0)];
    // two of them go to and fro, over the others and out of the picture
    let frames = (0..N_FRAMES).map(|frame| {
        let disc = |k: u64| {
            let centre = centres[k as usize];
            let away = [[0.0; 2], velocity[(k % 2) as usize]][frame % 2];
            let shift = if k < 2 { away } else { [0.0; 2] };
            Surface::turned_disc(50 * draw.seed + k, 4.0, (centre, 22.0), turn * frame as f64, shift)
        };
        [3, 2, 1, 0].map(disc).to_vec()
    });
    let frames = frames.collect();
    let noise = draw.noise();
    Shown { frames, noise, subsets: centres.iter().map(|&[x, y]| subset(x, y, 14)).collect() }
}

type Case = fn(&mut Draw) -> Shown;

const CASES: [(&str, Case); 8] = [
    ("jumps of up to 50 px", jumps),
    ("turns of 5 to 30 degrees a frame", turns),
    ("stretches up to -0.35 .. 0.5", stretches),
    ("another texture every fourth frame", cuts),
    ("a disc goes before", hides),
    ("dots on a lattice, jumping", repeats),
    ("dots on a lattice, slow", repeats_slowly),
    ("discs turning, jumping 60 px", bodies),
];

/// Counts films of every case, by methods of which each takes every so manieth subset.
pub fn count(
    methods: &[(&str, usize)],
    seeds: std::ops::Range<u64>,
    acceptance: Acceptance,
) -> BTreeMap<(String, String), Outcome> {
    let mut all = BTreeMap::new();
    let only = std::env::var("CASE").unwrap_or_default();
    for (name, case) in CASES.iter().filter(|(name, _)| name.contains(&only)) {
        for seed in seeds.clone() {
            let scene = case(&mut Draw::of(seed));
            let film = scene.film(seed);
            for &(method, every) in methods {
                let subsets: Vec<Subset> = scene.subsets.iter().step_by(every).cloned().collect();
                let n_threads = NonZero::new(2).unwrap();
                let settings = Settings { n_threads, acceptance, ..Settings::default() };
                let by: Method = method.parse().unwrap();
                let tracks =
                    by.track(&film, &subsets, &ReferenceFrames::Single(0), &settings, &|_| ()).unwrap();
                let outcome = scene.outcome(&subsets, &tracks);
                if outcome.n_wrong > 0 {
                    println!("seed {seed}, {name}, {method}, noise {}: {outcome:?}", scene.noise);
                }
                let sum = all.entry((method.to_owned(), (*name).to_owned())).or_insert_with(Outcome::default);
                *sum = [*sum, outcome].into_iter().sum();
            }
        }
    }
    println!();
    for ((method, name), outcome) in &all {
        println!("{method:<26} {name:<36} {outcome}");
    }
    println!("in all {}", all.values().copied().sum::<Outcome>());
    all
}

/// The long count: less than one reading in a million is false. FILMS films of every case; with MIN_ZNCC, what acceptance by that bound
/// alone does to the same films.
pub fn count_a_million(methods: &[(&str, usize)]) {
    let films: u64 = std::env::var("FILMS").ok().and_then(|films| films.parse().ok()).unwrap_or(40);
    let least: Option<f64> = std::env::var("MIN_ZNCC").ok().and_then(|least| least.parse().ok());
    let acceptance = least.map_or(Acceptance::ByEvidence, Acceptance::Zncc);
    let counted = count(methods, 100..100 + films, acceptance);
    let wrong: usize = counted.values().map(|outcome| outcome.n_wrong).sum();
    assert!(wrong == 0 || least.is_some(), "{wrong}");
}
