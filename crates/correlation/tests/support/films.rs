//! Films of surfaces that jump, turn, stretch, repeat, hide or are replaced, drawn in closed form by a renderer that knows no matcher, and
//! what tracks say of them.

#![expect(unreachable_pub, reason = "a module of several test binaries")]

#[path = "outcome.rs"]
pub mod outcome;

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::time::Instant;

use chainwave_correlation::{Acceptance, Method, ReferenceFrames, Settings};
use chainwave_measurement::{Lost, MemoryRecording, Position, Subset, Track};
use chainwave_synthetic::pictures::{Deformation, Surface, Texture, counts, picture_by_spots};
use outcome::Outcome;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Columns and rows, and frames, of a film of the short tests and of the long count.
const SHORT: (usize, usize) = (176, 12);
const LONG: (usize, usize) = (240, 40);

/// A film: what each frame shows, and where its points lie in the first.
pub struct Shown {
    pub size_px: usize,
    pub frames: Vec<Vec<Surface>>,
    pub noise: f64,
    pub subsets: Vec<Subset>,
}

impl Shown {
    pub fn film(&self, seed: u64) -> MemoryRecording {
        let seen = |(number, surfaces): (u64, &Vec<Surface>)| {
            let tones = picture_by_spots([self.size_px; 2], surfaces).unwrap();
            counts(&tones, 12, self.noise, seed, number).unwrap().into_raw_vec_and_offset().0
        };
        MemoryRecording::new(self.size_px, 12, (0..).zip(&self.frames).map(seen).collect())
    }

    /// The topmost surface of the first frame at a point.
    fn surface_of(&self, at_px: [f64; 2]) -> Option<usize> {
        (0..self.frames[0].len()).rev().find(|&which| contains(&self.frames[0][which], at_px))
    }

    /// Which surfaces of the first frame each frame shows too.
    fn related(&self) -> Vec<Vec<bool>> {
        let of_frame = |frame: &Vec<Surface>| {
            let pairs = self.frames[0].iter().zip(frame);
            pairs.map(|(before, after)| before.texture == after.texture).collect()
        };
        self.frames.iter().map(of_frame).collect()
    }

    /// Where a point of the first frame lies in another; `None` where that shows another texture in its stead.
    fn truth(&self, related: &[Vec<bool>], frame: usize, at_px: [f64; 2]) -> Option<[f64; 2]> {
        let which = self.surface_of(at_px)?;
        related[frame][which].then(|| self.frames[frame][which].deformation.displaced_px(at_px))
    }

    /// Whether a frame shows the whole subset: its corners and middle belong to one surface, lie inside, and nothing lies over them.
    fn shows(&self, related: &[Vec<bool>], frame: usize, subset: &Subset) -> bool {
        let which = self.surface_of([subset.x_px, subset.y_px]);
        let reach = [subset.half_width_px, subset.half_height_px].map(|half| half as f64 + 1.0);
        let sides = [-1.0, 0.0, 1.0];
        sides.iter().flat_map(|x| sides.iter().map(move |y| [x * reach[0], y * reach[1]])).all(|[x, y]| {
            let at_px = [subset.x_px + x, subset.y_px + y];
            let Some(there) = self.truth(related, frame, at_px) else { return false };
            let covered = |over: &Surface| {
                over.deformation.source_px(there).is_some_and(|source| contains(over, source))
            };
            let over = which.map_or(0, |which| which + 1);
            self.surface_of(at_px) == which
                && there.iter().all(|value| (4.0..self.size_px as f64 - 5.0).contains(value))
                && !self.frames[frame][over..].iter().any(covered)
        })
    }

    /// What tracks say of the film.
    pub fn outcome(&self, subsets: &[Subset], tracks: &[Track]) -> Outcome {
        let related = self.related();
        let of_reading = |subset: &Subset, frame: usize, found: &Result<Position, Lost>| {
            let truth = self.truth(&related, frame, [subset.x_px, subset.y_px]);
            let outcome = Outcome::of(found.as_ref().ok(), truth, self.shows(&related, frame, subset));
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

/// Subsets `step` px apart all over a picture.
fn grid(size_px: usize, half: usize, step: usize) -> Vec<Subset> {
    let line = || (half + 8..size_px - half - 8).step_by(step);
    line().flat_map(|y| line().map(move |x| subset(x as f64, y as f64, half))).collect()
}

/// Subsets of 33 x 33 px in a film of the short tests.
pub fn large_subsets() -> Vec<Subset> {
    grid(SHORT.0, 16, 30)
}

/// Subsets of 11 x 11 px in a film of the short tests.
pub fn small_subsets() -> Vec<Subset> {
    grid(SHORT.0, 5, 13)
}

/// What a case is drawn by.
pub struct Draw {
    random: Pcg64Mcg,
    seed: u64,
    size_px: usize,
    n_frames: usize,
}

impl Draw {
    /// Of a short film.
    pub fn of(seed: u64) -> Self {
        Self::sized(seed, SHORT)
    }

    fn sized(seed: u64, (size_px, n_frames): (usize, usize)) -> Self {
        Self { random: Pcg64Mcg::seed_from_u64(seed), seed, size_px, n_frames }
    }

    fn middle_px(&self) -> [f64; 2] {
        [0.5 * (self.size_px as f64 - 1.0); 2]
    }

    /// Half of what a texture covers that fills the frames wherever it goes.
    fn half_size_px(&self) -> [f64; 2] {
        [0.5 * self.size_px as f64 + 102.0; 2]
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.random.random_range(low..high)
    }

    fn noise(&mut self) -> f64 {
        [0.0, 0.02, 0.05, 0.1][self.random.random_range(0..4)]
    }

    fn speckles(&mut self, seed: u64) -> Texture {
        let diameter = self.between(3.0, 5.0);
        Texture::speckles(1000 * self.seed + seed, diameter, self.middle_px(), self.half_size_px())
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
    for frame in 1..draw.n_frames {
        frames.push(vec![surface.clone().deformed(lies(draw, frame as f64))]);
    }
    let (noise, half, size_px) = (draw.noise(), draw.half(), draw.size_px);
    Shown { size_px, frames, noise, subsets: grid(size_px, half, 20) }
}

fn shifted(shift_px: [f64; 2]) -> Deformation {
    Deformation::rigid([0.0; 2], 0.0, shift_px)
}

fn jumps(draw: &mut Draw) -> Shown {
    plane(draw, |draw, _| shifted(draw.shift(35.0)))
}

fn turns(draw: &mut Draw) -> Shown {
    let step = draw.between(5.0, 30.0) * PI / 180.0;
    plane(draw, |draw, frame| Deformation::rigid(draw.middle_px(), step * frame, draw.shift(3.0)))
}

fn stretches(draw: &mut Draw) -> Shown {
    let most = [draw.between(-0.35, 0.5), draw.between(-0.35, 0.5)];
    plane(draw, |draw, frame| {
        Deformation::stretch(draw.middle_px(), most.map(|most| most * frame / draw.n_frames as f64))
    })
}

/// Another texture every fourth frame.
fn cuts(draw: &mut Draw) -> Shown {
    let mut scene = plane(draw, |draw, _| shifted(draw.shift(4.0)));
    for frame in (2..draw.n_frames).step_by(4) {
        scene.frames[frame] = vec![Surface::everywhere(draw.speckles(frame as u64), Deformation::NONE)];
    }
    scene
}

/// A textured disc that goes before a plane at rest or moving slowly, from the left to the right again and again.
fn hides(draw: &mut Draw) -> Shown {
    let v = draw.shift(2.0);
    let mut scene = plane(draw, |_, frame| shifted(v.map(|v| v * frame)));
    let (radius, row) = (draw.between(15.0, 40.0), draw.between(40.0, 130.0));
    let way = draw.size_px as f64 + 124.0;
    for (frame, surfaces) in scene.frames.iter_mut().enumerate() {
        let shift = [(25.0 * frame as f64) % way, 0.0];
        surfaces.push(Surface::turned_disc(7 + draw.seed, 4.5, ([-60.0, row], radius), 0.0, shift));
    }
    scene
}

/// Dots on a lattice, at rest or jumping.
fn repeats(draw: &mut Draw) -> Shown {
    let mut scene = plane(draw, |draw, _| shifted(draw.shift(20.0)));
    let pitch = draw.between(9.0, 14.0);
    let dots = Texture::dots(pitch, 0.4 * pitch, draw.middle_px(), draw.half_size_px());
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
        shifted([along * angle.cos(), along * angle.sin()])
    });
    let dots = Texture::dots(pitch, 0.4 * pitch, draw.middle_px(), draw.half_size_px());
    scene.frames.iter_mut().flatten().for_each(|surface| surface.texture = dots.clone());
    scene
}

/// Subsets of a dozen speckles that set out from rest and go to and fro; in the second half of the film another texture goes so.
pub fn few_speckles(draw: &mut Draw) -> Shown {
    let (way, angle) = (draw.between(3.0, 15.0), draw.between(0.0, 2.0 * PI));
    let mut scene = plane(draw, |_, frame| {
        let along = way * 0.5 * (1.0 - (2.0 * PI * (frame - 1.0).max(0.0) / 24.0).cos());
        shifted([along * angle.cos(), along * angle.sin()])
    });
    let mut speckles = |seed: u64| {
        let diameter = draw.between(5.0, 6.0);
        Texture::speckles(1000 * draw.seed + seed, diameter, draw.middle_px(), draw.half_size_px())
    };
    let (own, other) = (speckles(1), speckles(2));
    let n_frames = scene.frames.len();
    for (frame, surfaces) in scene.frames.iter_mut().enumerate() {
        let texture = if 2 * frame < n_frames { &own } else { &other };
        surfaces.iter_mut().for_each(|surface| surface.texture = texture.clone());
    }
    let (noise, size_px) = ([0.0, 0.005, 0.01][draw.random.random_range(0..3)], scene.size_px);
    Shown { noise, subsets: grid(size_px, 8, 20), ..scene }
}

/// Where the discs of a film lie.
fn places(size_px: usize) -> Vec<[f64; 2]> {
    if size_px == SHORT.0 {
        return vec![[40.0, 40.0], [130.0, 45.0], [45.0, 132.0], [134.0, 130.0]];
    }
    let n = size_px / 60;
    let line = |i: usize| 30.0 + 60.0 * i as f64;
    (0..n * n).map(|k| [line(k % n), line(k / n)]).collect()
}

/// Discs on black that turn by 30 degrees a frame and move by up to 60 px, some out of the picture and back.
fn bodies(draw: &mut Draw) -> Shown {
    let turn = draw.between(0.0, 30.0) * PI / 180.0;
    let centres = places(draw.size_px);
    let velocity = [draw.shift(60.0), draw.shift(60.0)];
    // half of them go to and fro, over the others and out of the picture
    let frames = (0..draw.n_frames).map(|frame| {
        let disc = |(k, centre): (usize, &[f64; 2])| {
            let away = [[0.0; 2], velocity[k % 2]][frame % 2];
            let shift = if 2 * k < centres.len() { away } else { [0.0; 2] };
            let seed = 50 * draw.seed + k as u64;
            Surface::turned_disc(seed, 4.0, (*centre, 22.0), turn * frame as f64, shift)
        };
        centres.iter().enumerate().rev().map(disc).collect()
    });
    let frames = frames.collect();
    let (noise, size_px) = (draw.noise(), draw.size_px);
    Shown { size_px, frames, noise, subsets: centres.iter().map(|&[x, y]| subset(x, y, 14)).collect() }
}

/// Small bodies on black as in a film of a chain: each goes to and fro along x by up to 60 px, out of the picture and back, turns by up to
/// five degrees, and passes behind a still disc in the middle of its row.
fn chain(draw: &mut Draw) -> Shown {
    let (n, row_px) = (draw.size_px / 60, 40.0);
    let n_rows = (draw.size_px as f64 / row_px) as usize;
    let line = |i: usize, pitch_px: f64| (i as f64 + 0.5) * pitch_px;
    let centres: Vec<[f64; 2]> = (0..n * n_rows).map(|k| [line(k % n, 60.0), line(k / n, row_px)]).collect();
    let motions: Vec<[f64; 4]> = (0..n_rows)
        .map(|_| {
            let (way_px, period) = (draw.between(-60.0, 60.0), draw.between(20.0, 80.0));
            [way_px, period, draw.between(-1.0, 1.0), draw.between(-0.09, 0.09)]
        })
        .collect();
    let diameter = draw.between(2.5, 5.0);
    let half = draw.random.random_range(7..12_usize);
    let radius = 1.5 * half as f64;
    let behind = draw.random.random_bool(0.3);
    let still: Vec<Surface> = (0..n_rows)
        .filter(|_| behind)
        .map(|row| ([line(n / 2, 60.0) + 30.0, line(row, row_px)], 5.0))
        .map(|disc| Surface::turned_disc(7, 4.0, disc, 0.0, [0.0; 2]))
        .collect();
    let bodies: Vec<Surface> = (0..)
        .zip(&centres)
        .map(|(k, &centre)| {
            Surface::turned_disc(500 * draw.seed + k, diameter, (centre, radius), 0.0, [0.0; 2])
        })
        .collect();
    let frames = (0..draw.n_frames).map(|frame| {
        let lies = |(k, body): (usize, &Surface)| {
            let [way_px, period, aside_px, turn_rad] = motions[k / n];
            let swing = 0.5 * (1.0 - (2.0 * PI * frame as f64 / period).cos());
            let shift_px = [way_px * swing, aside_px * swing];
            body.clone().deformed(Deformation::rigid(centres[k], turn_rad * swing, shift_px))
        };
        bodies.iter().enumerate().map(lies).chain(still.iter().cloned()).collect()
    });
    let frames = frames.collect();
    let (noise, size_px) = (draw.noise(), draw.size_px);
    let inside = |&[x, _]: &[f64; 2]| x - half as f64 > 8.0;
    let subsets = centres.iter().filter(|centre| inside(centre)).map(|&[x, y]| subset(x, y, half));
    Shown { size_px, frames, noise, subsets: subsets.collect() }
}

type Case = fn(&mut Draw) -> Shown;

/// Those that the short tests follow.
const CASES: [(&str, Case); 9] = [
    ("jumps of up to 50 px", jumps),
    ("turns of 5 to 30 degrees a frame", turns),
    ("stretches up to -0.35 .. 0.5", stretches),
    ("another texture every fourth frame", cuts),
    ("a disc goes before", hides),
    ("dots on a lattice, jumping", repeats),
    ("dots on a lattice, slow", repeats_slowly),
    ("discs turning, jumping 60 px", bodies),
    ("a dozen speckles, slow, then others", few_speckles),
];
/// That of the long count alone.
const CHAIN: [(&str, Case); 1] = [("small bodies of a chain on black", chain)];

/// Follows a film's subsets, each method every n-th of them, and adds what they say to a sum for each.
fn add<'a>(
    scene: &Shown,
    seed: u64,
    methods: &[(&'a str, usize)],
    acceptance: Acceptance,
    mut to: impl FnMut(&'a str, Outcome, usize),
) {
    let film = scene.film(seed);
    for &(method, every) in methods {
        let subsets: Vec<Subset> = scene.subsets.iter().step_by(every).cloned().collect();
        let settings = Settings { acceptance, ..Settings::default() };
        let by: Method = method.parse().unwrap();
        let tracks = by.track(&film, &subsets, &ReferenceFrames::Single(0), &settings, &|_| ()).unwrap();
        let outcome = scene.outcome(&subsets, &tracks);
        if outcome.n_wrong > 0 {
            println!("seed {seed}, {method}, noise {}: {outcome}", scene.noise);
        }
        to(method, outcome, subsets.len());
    }
}

/// Counts short films of every case, by methods that take every n-th subset, each with its n.
pub fn count(
    methods: &[(&str, usize)],
    seeds: std::ops::Range<u64>,
    acceptance: Acceptance,
) -> BTreeMap<(String, String), Outcome> {
    let mut all = BTreeMap::new();
    let only = std::env::var("CASE").unwrap_or_default();
    for (name, case) in CASES.iter().filter(|(name, _)| name.contains(&only)) {
        for seed in seeds.clone() {
            add(&case(&mut Draw::of(seed)), seed, methods, acceptance, |method, outcome, _| {
                let sum = all.entry((method.to_owned(), (*name).to_owned())).or_insert_with(Outcome::default);
                *sum = [*sum, outcome].into_iter().sum();
            });
        }
    }
    println!();
    for ((method, name), outcome) in &all {
        println!("{method:<26} {name:<36} {outcome}");
    }
    println!("in all {}", all.values().copied().sum::<Outcome>());
    all
}

/// The long count: less than one reading in a million is false. FILMS long films of every case from the seed FIRST on; with MIN_ZNCC, what
/// acceptance by that bound alone does to the same films.
pub fn count_a_million(methods: &[(&str, usize)]) {
    let number = |name: &str| std::env::var(name).ok().and_then(|number| number.parse::<u64>().ok());
    let (first, films) = (number("FIRST").unwrap_or(10_000), number("FILMS").unwrap_or(40));
    let least: Option<f64> = std::env::var("MIN_ZNCC").ok().and_then(|least| least.parse().ok());
    let acceptance = least.map_or(Acceptance::ByEvidence, Acceptance::Zncc);
    let only = std::env::var("CASE").unwrap_or_default();
    let mut n_wrong = 0;
    for (name, case) in CASES.iter().chain(&CHAIN).filter(|(name, _)| name.contains(&only)) {
        let begun = Instant::now();
        let mut all: BTreeMap<&str, (Outcome, usize)> = BTreeMap::new();
        for seed in first..first + films {
            let scene = case(&mut Draw::sized(seed, LONG));
            add(&scene, seed, methods, acceptance, |method, outcome, n_subsets| {
                let (sum, n) = all.entry(method).or_default();
                *sum = [*sum, outcome].into_iter().sum();
                *n += n_subsets;
            });
        }
        for (method, (outcome, n)) in &all {
            let seconds = begun.elapsed().as_secs_f64();
            println!(
                "COUNT {name:<36} {method:<24} films {films:5}  {outcome}  tracks {n:7}  {seconds:.1} s"
            );
            n_wrong += outcome.n_wrong;
        }
    }
    assert!(n_wrong == 0 || least.is_some(), "{n_wrong}");
}
