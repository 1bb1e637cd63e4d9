//! Right, or lost for a named reason: fields between pictures of surfaces that stretch, turn, repeat or have nothing to do with each
//! other, drawn in closed form by a renderer that knows no matcher.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, and shows what it measured")]
#![expect(clippy::print_stdout, reason = "what each case gave is a table to be read")]

#[path = "support/outcome.rs"]
mod outcome;

use std::f64::consts::PI;
use std::num::NonZero;

use chainwave_correlation::{
    Field, FieldGrid, FieldPoint, Reference, Settings, Shape, ShapeChoice, Window, correlate,
};
use chainwave_measurement::Region;
use chainwave_synthetic::pictures::{Deformation, Surface, Texture, counts, picture};
use outcome::Outcome;

const SIZE_PX: [usize; 2] = [320, 320];
const MIDDLE_PX: [f64; 2] = [159.5, 159.5];
const HALF_PX: usize = 16;
const STEP_PX: usize = 8;

/// Two pictures and where each point of the first has gone, if it is seen in the second.
struct Case {
    name: String,
    before: Vec<Surface>,
    after: Vec<Surface>,
    noise: f64,
}

impl Case {
    fn of(name: &str, surface: Surface, deformation: Deformation) -> Self {
        let after = vec![surface.clone().deformed(deformation)];
        Self { name: name.into(), before: vec![surface], after, noise: 0.02 }
    }

    fn field(&self) -> Field {
        let [before, after] = [(&self.before, 0), (&self.after, 1)].map(|(surfaces, number)| {
            let seen = counts(&picture(SIZE_PX, surfaces).unwrap(), 12, self.noise, 5, number).unwrap();
            seen.into_raw_vec_and_offset().0
        });
        let whole = Region::whole(SIZE_PX[0], SIZE_PX[1]);
        let settings = Settings::default();
        let reference = Reference::new(whole, before, 1).unwrap().saturating_at(4095.0);
        let target = Window::new(whole, &after, settings.interpolation).unwrap();
        let grid = FieldGrid { step_px: STEP_PX, half_px: HALF_PX };
        let choice = ShapeChoice::Named(Shape::Affine);
        correlate(&reference, &target, grid, &settings, choice, NonZero::new(2).unwrap(), &|_| ()).unwrap()
    }

    /// Where a point of the first picture is seen in the second; `None` where it shows no surface, or another one there.
    fn truth(&self, at_px: [f64; 2]) -> Option<[f64; 2]> {
        let inside = |surface: &Surface, at_px: [f64; 2]| {
            surface.disc.is_none_or(|([x, y], radius)| (at_px[0] - x).hypot(at_px[1] - y) <= radius)
        };
        let which = (0..self.before.len()).rev().find(|which| inside(&self.before[*which], at_px))?;
        let related = self.before[which].texture == self.after[which].texture;
        related.then(|| self.after[which].deformation.displaced_px(at_px))
    }

    /// Whether the second picture shows the whole subset around a point: its corners belong to the same surface, and go inside.
    fn shows(&self, at_px: [f64; 2]) -> bool {
        let reach = HALF_PX as f64 + 1.0;
        let corner = |[x, y]: [f64; 2]| self.truth([at_px[0] + x * reach, at_px[1] + y * reach]);
        [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]].into_iter().all(|sides| {
            let same = corner(sides).is_some()
                && self.surface_of(at_px)
                    == self.surface_of([at_px[0] + sides[0] * reach, at_px[1] + sides[1] * reach]);
            let inside = |place: [f64; 2]| place.iter().all(|value| (4.0..315.0).contains(value));
            same && corner(sides).is_some_and(inside)
        })
    }

    fn surface_of(&self, at_px: [f64; 2]) -> Option<usize> {
        let inside = |surface: &Surface| {
            surface.disc.is_none_or(|([x, y], radius)| (at_px[0] - x).hypot(at_px[1] - y) <= radius)
        };
        (0..self.before.len()).rev().find(|which| inside(&self.before[*which]))
    }

    /// What a field says of the case.
    fn outcome(&self) -> Outcome {
        let of_point = |point: &FieldPoint| {
            let place = [point.x_px, point.y_px];
            let found = point.found.as_ref().ok().map(|found| &found.position);
            Outcome::of(found, self.truth(place), self.shows(place))
        };
        self.field().points.iter().map(of_point).sum()
    }
}

fn speckles(seed: u64) -> Surface {
    Surface::everywhere(Texture::speckles(seed, 4.5, MIDDLE_PX, [220.0; 2]), Deformation::NONE)
}

fn degrees(angle: f64) -> Deformation {
    Deformation::rigid(MIDDLE_PX, angle * PI / 180.0, [0.0; 2])
}

fn print(case: &Case, outcome: &Outcome) {
    println!("{:<32} {outcome}", case.name);
}

/// Every case has no wrong point, and finds at least a share of what is seen.
fn hold(cases: impl IntoIterator<Item = Case>, least_share: f64) {
    let mut failed = Vec::new();
    for case in cases {
        let outcome = case.outcome();
        print(&case, &outcome);
        let enough = outcome.n_found as f64 >= least_share * outcome.n_visible as f64;
        if outcome.n_wrong > 0 || !enough {
            failed.push(case.name);
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

#[test]
fn stretched_speckle_is_found() {
    let stretch = |relative: f64| {
        let deformation = Deformation::stretch(MIDDLE_PX, [relative, 0.0]);
        Case::of(&format!("stretched by {relative} along x"), speckles(1), deformation)
    };
    hold([-0.5, -0.25, 0.3, 0.45, 1.0].map(stretch), 0.99);
}

#[test]
fn scaled_speckle_is_found() {
    let scale = |factor: f64| {
        let deformation = Deformation::stretch(MIDDLE_PX, [factor - 1.0; 2]);
        Case::of(&format!("scaled by {factor}"), speckles(2), deformation)
    };
    hold([0.5, 0.75, 1.4, 2.0].map(scale), 0.99);
}

#[test]
fn turned_speckle_is_found() {
    let turn = |angle: f64| Case::of(&format!("turned by {angle} degrees"), speckles(3), degrees(angle));
    hold([30.0, 50.0, 90.0, 130.0, 170.0].map(turn), 0.99);
}

#[test]
fn bodies_on_black_are_all_found() {
    let disc = |k: u64, turn: f64, shift: [f64; 2]| {
        let centre = [80.0 + 160.0 * (k % 2) as f64, 80.0 + 160.0 * (k / 2) as f64];
        Surface::turned_disc(10 + k, 4.5, (centre, 60.0), turn * PI / 180.0, shift)
    };
    let before = (0..4).map(|k| disc(k, 0.0, [0.0; 2])).collect();
    let turns = [0.0, 25.0, -70.0, 160.0];
    let after = (0..4_u64).zip(turns).map(|(k, turn)| disc(k, turn, [3.3, -2.6])).collect();
    hold([Case { name: "four bodies turned on black".into(), before, after, noise: 0.02 }], 0.99);
}

#[test]
fn what_is_not_there_is_not_found() {
    let unrelated = |noise: f64| Case {
        name: format!("unrelated textures, {noise} noise"),
        before: vec![speckles(20)],
        after: vec![speckles(21)],
        noise,
    };
    let coarse = |seed: u64| {
        Surface::everywhere(Texture::speckles(seed, 12.0, MIDDLE_PX, [220.0; 2]), Deformation::NONE)
    };
    let blobs = Case {
        name: "unrelated coarse textures".into(),
        before: vec![coarse(22)],
        after: vec![coarse(23)],
        noise: 0.02,
    };
    hold([unrelated(0.0), unrelated(0.05), unrelated(0.1), blobs], 0.0);
}

#[test]
fn heavy_noise_loses_nothing() {
    let noisy = |noise: f64| Case {
        noise,
        ..Case::of(&format!("{noise} noise"), speckles(30), Deformation::rigid(MIDDLE_PX, 0.03, [5.3, -2.7]))
    };
    hold([0.0, 0.02, 0.05, 0.1].map(noisy), 0.97);
}

#[test]
fn a_pattern_that_repeats_is_right_or_ambiguous() {
    let dots = Surface::everywhere(Texture::dots(12.0, 5.0, MIDDLE_PX, [220.0; 2]), Deformation::NONE);
    let still = Case::of("dots against themselves", dots.clone(), Deformation::NONE);
    let moved = Case::of("dots moved by 20 px", dots, Deformation::rigid(MIDDLE_PX, 0.0, [20.0, 0.0]));
    for case in [&still, &moved] {
        let outcome = case.outcome();
        print(case, &outcome);
        assert_eq!(outcome.n_wrong, 0);
    }
}
