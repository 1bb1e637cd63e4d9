//! Pairs of pictures of surfaces that move, turn, stretch, bend, hide, repeat or are replaced, drawn by a renderer that knows no matcher, and
//! what fields say of them.

#![expect(unreachable_pub, reason = "a module of several test binaries")]

use std::cell::Cell;
use std::f64::consts::PI;
use std::num::NonZero;

use chainwave_correlation::{
    Acceptance, Field, FieldGrid, FieldPoint, Reference, Settings, Shape, ShapeChoice, Window, correlate,
};
use chainwave_measurement::Region;
use chainwave_synthetic::SyntheticError;
use chainwave_synthetic::pictures::{Deformation, Surface, Texture, counts, picture, picture_by_samples};
use ndarray::Array2;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::outcome::Outcome;

/// Makes a picture of surfaces.
pub type Renderer = fn([usize; 2], &[Surface]) -> Result<Array2<f64>, SyntheticError>;

/// Two pictures and where each point of the first has gone, if it is seen in the second.
pub struct Case {
    pub name: String,
    pub size_px: usize,
    pub before: Vec<Surface>,
    pub after: Vec<Surface>,
    pub noise: f64,
    pub grid: FieldGrid,
    pub renderer: Renderer,
}

impl Case {
    /// The usual case: 320 x 320 px, 2 % noise, subsets of 33 x 33 px.
    pub fn between(name: &str, before: Vec<Surface>, after: Vec<Surface>) -> Self {
        let grid = FieldGrid { step_px: 8, half_px: 16 };
        Self { name: name.into(), size_px: 320, before, after, noise: 0.02, grid, renderer: picture }
    }

    fn field(&self, acceptance: Acceptance) -> Field {
        let size_px = [self.size_px; 2];
        let [before, after] = [(&self.before, 0), (&self.after, 1)].map(|(surfaces, number)| {
            let seen = counts(&(self.renderer)(size_px, surfaces).unwrap(), 12, self.noise, 5, number);
            seen.unwrap().into_raw_vec_and_offset().0
        });
        let whole = Region::whole(size_px[0], size_px[1]);
        let settings = Settings { acceptance, ..Settings::default() };
        let reference = Reference::new(whole, before, 1).unwrap().saturating_at(4095.0);
        let target = Window::new(whole, &after, settings.interpolation).unwrap();
        let choice = ShapeChoice::Named(Shape::Affine);
        let n_threads = NonZero::<usize>::MIN;
        correlate(&reference, &target, self.grid, &settings, choice, n_threads, &|_| ()).unwrap()
    }

    /// Which surfaces of the first picture the second shows too.
    fn related(&self) -> Vec<bool> {
        self.before.iter().zip(&self.after).map(|(before, after)| before.texture == after.texture).collect()
    }

    /// Where a point of the first picture is seen in the second; `None` where it shows no surface, or another one there.
    fn truth(&self, related: &[bool], at_px: [f64; 2]) -> Option<[f64; 2]> {
        let which = self.surface_of(at_px)?;
        related[which].then(|| self.after[which].deformation.displaced_px(at_px))
    }

    /// Whether the second picture shows the whole subset around a point: its corners belong to the same surface, and go inside.
    fn shows(&self, related: &[bool], at_px: [f64; 2]) -> bool {
        let reach = self.grid.half_px as f64 + 1.0;
        let last = self.size_px as f64 - 5.0;
        let own = self.surface_of(at_px);
        [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]].into_iter().all(|[x, y]| {
            let corner = [at_px[0] + x * reach, at_px[1] + y * reach];
            let inside = |place: [f64; 2]| place.iter().all(|value| (4.0..last).contains(value));
            own == self.surface_of(corner) && self.truth(related, corner).is_some_and(inside)
        })
    }

    /// The topmost surface of the first picture at a point.
    fn surface_of(&self, at_px: [f64; 2]) -> Option<usize> {
        let inside = |surface: &Surface| {
            surface.disc.is_none_or(|([x, y], radius)| (at_px[0] - x).hypot(at_px[1] - y) <= radius)
        };
        (0..self.before.len()).rev().find(|which| inside(&self.before[*which]))
    }

    /// What a field says of the case.
    pub fn outcome(&self, acceptance: Acceptance) -> Outcome {
        let n_printed = Cell::new(0);
        let related = self.related();
        let of_point = |point: &FieldPoint| {
            let place = [point.x_px, point.y_px];
            let found = point.found.as_ref().ok().map(|found| &found.position);
            let truth = self.truth(&related, place);
            let outcome = Outcome::of(found, truth, self.shows(&related, place));
            if outcome.n_wrong > 0 && n_printed.replace(n_printed.get() + 1) < 5 {
                println!("{place:?}: {found:?}, truth {truth:?}");
            }
            outcome
        };
        self.field(acceptance).points.iter().map(of_point).sum()
    }

    /// The share of a subset that each point has for itself.
    pub fn own_share(&self) -> f64 {
        (self.grid.step_px as f64 / (2 * self.grid.half_px + 1) as f64).powi(2).min(1.0)
    }
}

/// What a pair of pictures is drawn by.
pub struct Draw {
    random: Pcg64Mcg,
    seed: u64,
    size_px: f64,
}

impl Draw {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.random.random_range(low..high)
    }

    fn shift(&mut self, most_px: f64) -> [f64; 2] {
        [self.between(-most_px, most_px), self.between(-most_px, most_px)]
    }

    fn middle_px(&self) -> [f64; 2] {
        [0.5 * (self.size_px - 1.0); 2]
    }

    /// Half of what a texture covers that fills the picture wherever it goes.
    fn half_size_px(&self) -> [f64; 2] {
        [0.5 * self.size_px + 60.0; 2]
    }

    /// Speckles that fill the picture; those of each layer are their own.
    fn speckles(&mut self, layer: u64) -> Surface {
        self.speckles_of(layer, 3.0, 6.0)
    }

    fn speckles_of(&mut self, layer: u64, least_px: f64, most_px: f64) -> Surface {
        let diameter_px = self.between(least_px, most_px);
        let seed = 100 * self.seed + layer;
        let texture = Texture::speckles(seed, diameter_px, self.middle_px(), self.half_size_px());
        Surface::everywhere(texture, Deformation::NONE)
    }

    fn disc(&mut self, layer: u64, disc: ([f64; 2], f64)) -> Surface {
        Surface::turned_disc(100 * self.seed + layer, 4.5, disc, 0.0, [0.0; 2])
    }

    fn lies(&mut self, most_rad: f64, most_px: f64) -> Deformation {
        let turn_rad = self.between(-most_rad, most_rad);
        Deformation::rigid(self.middle_px(), turn_rad, self.shift(most_px))
    }
}

/// A kind of pair.
pub type Pair = fn(&mut Draw) -> (Vec<Surface>, Vec<Surface>);

fn one(surface: Surface, deformation: Deformation) -> (Vec<Surface>, Vec<Surface>) {
    (vec![surface.clone()], vec![surface.deformed(deformation)])
}

pub fn moved(draw: &mut Draw) -> (Vec<Surface>, Vec<Surface>) {
    let lies = draw.lies(0.1, 60.0);
    one(draw.speckles(1), lies)
}

fn turned(draw: &mut Draw) -> (Vec<Surface>, Vec<Surface>) {
    let lies = draw.lies(PI, 20.0);
    one(draw.speckles(1), lies)
}

pub fn stretched(draw: &mut Draw) -> (Vec<Surface>, Vec<Surface>) {
    let relative = if draw.random.random_bool(0.5) {
        [draw.between(-0.5, 1.0), 0.0]
    } else {
        [draw.between(-0.5, 1.0); 2]
    };
    let middle_px = draw.middle_px();
    one(draw.speckles(1), Deformation::stretch(middle_px, relative))
}

fn unrelated(draw: &mut Draw) -> (Vec<Surface>, Vec<Surface>) {
    (vec![draw.speckles(1)], vec![draw.speckles(2)])
}

/// Discs of another texture before the second picture: as many as cover the same share of a larger one.
pub fn covered(draw: &mut Draw) -> (Vec<Surface>, Vec<Surface>) {
    let (mut before, mut after) = moved(draw);
    let [middle_px, _] = draw.middle_px();
    let n_discs = (3.0 * (draw.size_px / 320.0).powi(2)).round() as u64;
    for layer in 3..3 + n_discs {
        let centre_px = draw.shift(middle_px - 9.5).map(|apart| apart + middle_px);
        let radius_px = draw.between(15.0, 60.0);
        // far outside at first, where no point lies
        let disc = draw.disc(layer, ([-500.0, -500.0], radius_px));
        let shift_px = centre_px.map(|place| place + 500.0);
        after.push(disc.clone().deformed(Deformation::rigid([-500.0, -500.0], 0.0, shift_px)));
        before.push(disc);
    }
    (before, after)
}

fn dots(draw: &mut Draw) -> (Vec<Surface>, Vec<Surface>) {
    let pitch_px = draw.between(8.0, 20.0);
    let texture = Texture::dots(pitch_px, 0.4 * pitch_px, draw.middle_px(), draw.half_size_px());
    let lies = draw.lies(0.05, 30.0);
    one(Surface::everywhere(texture, Deformation::NONE), lies)
}

/// Bodies on black, each turned and moved in its own way: one on each square of 160 px.
fn bodies(draw: &mut Draw) -> (Vec<Surface>, Vec<Surface>) {
    let n = (draw.size_px / 160.0) as u64;
    let mut disc = |k: u64| {
        let centre_px = [80.0 + 160.0 * (k % n) as f64, 80.0 + 160.0 * (k / n) as f64];
        let (turn_rad, shift_px) = (draw.between(-PI, PI), draw.shift(10.0));
        let disc = draw.disc(10 + k, (centre_px, 60.0));
        (disc.clone(), disc.deformed(Deformation::rigid(centre_px, turn_rad, shift_px)))
    };
    (0..n * n).map(&mut disc).unzip()
}

/// A shear and a stretch in any direction, and a turn.
fn sheared(draw: &mut Draw) -> (Vec<Surface>, Vec<Surface>) {
    let mut entry = || draw.between(-0.3, 0.3);
    let gradient = [[entry(), entry()], [entry(), entry()]];
    let (centre_px, shift_px) = (draw.middle_px(), draw.shift(20.0));
    one(draw.speckles(1), Deformation::Affine { gradient, centre_px, shift_px })
}

/// A wave: strains of up to a fifth.
fn bent(draw: &mut Draw) -> (Vec<Surface>, Vec<Surface>) {
    let period_px = draw.between(60.0, 400.0);
    let most_px = 0.2 * period_px / (2.0 * PI);
    let angle_rad = draw.between(0.0, 2.0 * PI);
    let amplitude_px = draw.shift(most_px);
    let along = [angle_rad.cos(), angle_rad.sin()];
    one(draw.speckles(1), Deformation::Wave { amplitude_px, along, period_px })
}

/// Speckles of 3 to 12 px whose contrast is between all and a fifteenth.
fn faint(draw: &mut Draw) -> (Vec<Surface>, Vec<Surface>) {
    let lies = draw.lies(0.1, 40.0);
    let mut surface = draw.speckles_of(1, 3.0, 12.0);
    surface.contrast *= draw.between(-2.7, 0.0).exp();
    one(surface, lies)
}

/// Spots scattered by chance, one on 60 to 600 square pixels.
fn sparse(draw: &mut Draw) -> (Vec<Surface>, Vec<Surface>) {
    let lies = draw.lies(0.3, 40.0);
    let area_px2 = draw.between(60.0_f64.ln(), 600.0_f64.ln()).exp();
    let (diameter_px, [half_px, _], [middle_px, _]) =
        (draw.between(3.0, 8.0), draw.half_size_px(), draw.middle_px());
    let n = (4.0 * half_px * half_px / area_px2) as usize;
    let places: Vec<[f64; 2]> = (0..n).map(|_| draw.shift(half_px).map(|apart| apart + middle_px)).collect();
    one(Surface::everywhere(Texture::spots(&places, diameter_px), Deformation::NONE), lies)
}

/// Dots on a hexagonal lattice, or on a square one each of them off by up to a third of the pitch: patterns that repeat nearly.
fn nearly_periodic(draw: &mut Draw) -> (Vec<Surface>, Vec<Surface>) {
    let pitch_px = draw.between(8.0, 20.0);
    let hexagonal = draw.random.random_bool(0.5);
    let most_off_px = if hexagonal { 1e-9 } else { draw.between(0.0, 0.33) * pitch_px };
    let ([half_px, _], [middle_px, _]) = (draw.half_size_px(), draw.middle_px());
    let row_px = if hexagonal { 0.75_f64.sqrt() * pitch_px } else { pitch_px };
    let reach = |pitch_px: f64| (half_px / pitch_px) as i64;
    let mut places = Vec::new();
    for row in -reach(row_px)..=reach(row_px) {
        for column in -reach(pitch_px)..=reach(pitch_px) {
            let aside = if hexagonal && row % 2 != 0 { 0.5 } else { 0.0 };
            let off = draw.shift(most_off_px.max(1e-9));
            places.push([
                middle_px + (column as f64 + aside) * pitch_px + off[0],
                middle_px + row as f64 * row_px + off[1],
            ]);
        }
    }
    let lies = draw.lies(0.05, 30.0);
    one(Surface::everywhere(Texture::spots(&places, 0.4 * pitch_px), Deformation::NONE), lies)
}

/// How much of a kind of pair is counted: until so many readings are called ok, and no more pairs than that.
#[derive(Debug, Clone, Copy)]
pub struct Share {
    pub n_ok: usize,
    pub most_pairs: u64,
}

const fn until(n_ok: usize, most_pairs: u64) -> Share {
    Share { n_ok, most_pairs }
}

/// Every kind of pair, and how much of each is counted: most of what takes little time, and of what is searched for at all angles, or
/// shows nothing that can be told, some.
pub const PAIRS: [(&str, Pair, Share); 12] = [
    ("moved by up to 60 px", moved, until(1_250_000, 1000)),
    ("turned by up to 180 degrees", turned, until(300_000, 1000)),
    ("stretched by 0.5 to 2", stretched, until(350_000, 1000)),
    ("covered by discs", covered, until(30_000, 1000)),
    ("another texture", unrelated, until(1, 3)),
    ("dots on a lattice", dots, until(1, 8)),
    ("bodies turned on black", bodies, until(30_000, 1000)),
    ("sheared and stretched", sheared, until(400_000, 1000)),
    ("bent by a wave", bent, until(600_000, 1000)),
    ("faint or coarse texture", faint, until(30_000, 40)),
    ("sparse spots", sparse, until(40_000, 1000)),
    ("nearly periodic dots", nearly_periodic, until(60_000, 60)),
];

/// A pair of a kind, with noise and subsets that are drawn too.
pub fn random_case(kind: &str, pair: Pair, seed: u64, size_px: usize) -> Case {
    let mut draw = Draw { random: Pcg64Mcg::seed_from_u64(seed), seed, size_px: size_px as f64 };
    let (before, after) = pair(&mut draw);
    let noise = [0.0, 0.02, 0.05, 0.1][draw.random.random_range(0..4)];
    let half_px = draw.random.random_range(10..21);
    let step_px = if size_px == 320 { 8 } else { draw.random.random_range(8..25) };
    let grid = FieldGrid { step_px, half_px };
    Case { noise, grid, size_px, renderer: picture_by_samples, ..Case::between(kind, before, after) }
}
