//! Sizes of subsets that pictures ask for by themselves, held against all others on pictures of known deformation.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, and shows what it measured")]

use std::num::NonZero;

use chainwave_correlation::{
    ChosenGrid, CorrelationError, Field, FieldGrid, PicturePair, Reference, Settings, Shape, ShapeChoice,
    Window, correlate,
};
use chainwave_measurement::{Lost, Region};
use chainwave_synthetic::pictures::{Deformation, Surface, Texture, counts, picture};

/// What is asked of a field where nothing is said, in pixels.
const GOAL_PX: f64 = 0.01;
/// How much worse than the best of all sizes, or than what was asked, a size may be. Noise falls as 1/side and what bending leaves grows as
/// its square: `e^2 = a/h^2 + b h^4` is least where a/h^2 = 2 b h^4, and 1.29 times as large in e one step of a square root of 2 beyond.
const NEAR: f64 = 1.3;
const AFFINE: ShapeChoice = ShapeChoice::Named(Shape::Affine);

/// Two pictures of a surface, before and after it deformed.
struct Pair {
    name: &'static str,
    size_px: [usize; 2],
    surface: Surface,
    deformation: Deformation,
    noise: f64,
}

impl Pair {
    fn pictures(&self) -> (Reference, Window) {
        let [before, after] = [Deformation::NONE, self.deformation]
            .map(|deformation| picture(self.size_px, &[self.surface.clone().deformed(deformation)]).unwrap());
        let seen =
            |tones, number| counts(&tones, 12, self.noise, 7, number).unwrap().into_raw_vec_and_offset().0;
        let whole = Region::whole(self.size_px[0], self.size_px[1]);
        let reference = Reference::new(whole, seen(before, 0), 1).unwrap().saturating_at(4095.0);
        (reference, Window::new(whole, &seen(after, 1), Settings::default().interpolation).unwrap())
    }

    /// Root mean square error along one axis, and the share of points found of those with texture that stay in the picture.
    fn errors(&self, field: &Field) -> (f64, f64) {
        let (mut square, mut n_found, mut n_lost) = (0.0, 0, 0);
        for point in &field.points {
            match &point.found {
                Ok(found) => {
                    let [x, y] = self.deformation.displaced_px([point.x_px, point.y_px]);
                    square +=
                        (found.position.x_px.value - x).powi(2) + (found.position.y_px.value - y).powi(2);
                    n_found += 1;
                }
                Err(Lost::OutOfView) => (),
                Err(_) => n_lost += 1,
            }
        }
        ((square / f64::from(2 * n_found)).sqrt(), f64::from(n_found) / f64::from((n_found + n_lost).max(1)))
    }
}

fn two() -> NonZero<usize> {
    NonZero::new(2).unwrap()
}

fn pairs() -> Vec<Pair> {
    let size_px = [200, 200];
    let middle = [99.5, 99.5];
    let speckles = |diameter: f64| {
        Surface::everywhere(Texture::speckles(3, diameter, middle, [125.0; 2]), Deformation::NONE)
    };
    let shift = Deformation::rigid(middle, 0.01, [1.3, -0.7]);
    // a jittered lattice of single spots, 14 px apart
    let places: Vec<[f64; 2]> = (0..16_u32)
        .flat_map(|j| (0..16_u32).map(move |i| (i, j)))
        .map(|(i, j)| {
            let jitter = |k: u32| f64::from(k.wrapping_mul(2_654_435_761) >> 20) / 4096.0 * 9.0;
            [
                14.0 * f64::from(i) + jitter(18 * j + i + 1),
                14.0 * f64::from(j) + jitter(7919 * (18 * j + i) + 5),
            ]
        })
        .collect();
    let sparse = Surface::everywhere(Texture::spots(&places, 4.0), Deformation::NONE);
    let weak = Surface { contrast: 0.06, ..speckles(4.5) };
    let pair =
        |name, surface: Surface, deformation, noise| Pair { name, size_px, surface, deformation, noise };
    let strip = |name, noise| {
        let texture = Texture::speckles(5, 4.0, [159.5, 19.5], [190.0, 50.0]);
        let surface = Surface::everywhere(texture, Deformation::NONE);
        let shift = Deformation::rigid(middle, 0.0, [1.3, 0.2]);
        Pair { size_px: [320, 39], ..pair(name, surface, shift, noise) }
    };
    let wave = |period_px: f64| Deformation::Wave { amplitude_px: [0.0, 0.5], along: [1.0, 0.0], period_px };
    vec![
        pair("speckles of 2.5 px", speckles(2.5), shift, 0.02),
        pair("speckles of 4.5 px", speckles(4.5), shift, 0.02),
        pair("speckles of 12 px", speckles(12.0), shift, 0.02),
        pair("single dots 14 px apart", sparse, shift, 0.02),
        pair("speckles of a ninth of the contrast, 1 % noise", weak, shift, 0.01),
        strip("strip 39 px high", 0.02),
        strip("the same, 5 % noise", 0.05),
        pair("a wave of 100 px and 0.5 px, 5 % noise", speckles(4.0), wave(100.0), 0.05),
        pair("a wave of 60 px and 0.5 px", speckles(4.0), wave(60.0), 0.02),
    ]
}

#[test]
fn the_grid_that_pictures_ask_for_is_near_the_best() {
    let mut failed = Vec::new();
    println!("count: pictures,chosen,rms_mpx,best,at_most,lost_at");
    for pair in pairs() {
        let (reference, target) = pair.pictures();
        let settings = Settings::default();
        let errors = |grid: FieldGrid| {
            pair.errors(&correlate(&reference, &target, grid, &settings, AFFINE, two(), &|_| ()).unwrap())
        };
        let by_texture = ChosenGrid::by_texture(&reference, GOAL_PX).unwrap();
        let compared = PicturePair {
            reference: &reference,
            target: &target,
            settings: &settings,
            choice: AFFINE,
            n_threads: two(),
            progress: &|_| (),
        };
        let (chosen, field) = by_texture.correlate(&compared, GOAL_PX).unwrap();
        let (rms_px, share) = pair.errors(&field);
        println!("{:<26} foreseen {:.4} px, {share:.3} found", pair.name, chosen.floor_px);
        let most = (pair.size_px[1] - 1) / 2 - 5;
        let sizes = [7, 10, 14, 20, 28, 40].into_iter().filter(|half| *half <= most);
        let tried: Vec<(usize, f64, f64)> = sizes
            .map(|half_px| {
                let (rms_px, share) = errors(FieldGrid { step_px: 14, half_px });
                (half_px, rms_px, share)
            })
            .collect();
        let is_found = |(_, _, share): &&(usize, f64, f64)| *share >= 0.95;
        let best = tried.iter().filter(is_found).min_by(|one, other| one.1.total_cmp(&other.1));
        let best_px = best.map_or(f64::INFINITY, |(_, rms_px, _)| *rms_px);
        let told = |one: Option<&(usize, f64, f64)>| {
            one.map_or(String::new(), |(half_px, rms_px, _)| format!("{:.1} mpx, {half_px} px", 1e3 * rms_px))
        };
        let lost: Vec<String> =
            tried.iter().filter(|one| !is_found(one)).map(|one| one.0.to_string()).collect();
        println!(
            "count: \"{}\",\"{}, {}\",{:.1},\"{}\",\"{}\",\"{}\"",
            pair.name,
            chosen.grid.half_px,
            chosen.reason,
            1e3 * rms_px,
            told(best),
            told(tried.last()),
            lost.join(", ")
        );
        if share < 0.95 || rms_px > NEAR * best_px.max(GOAL_PX) {
            failed.push(pair.name);
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

#[test]
fn a_picture_without_texture_is_refused_with_a_hint() {
    let whole = Region::whole(120, 100);
    let bare = Surface::everywhere(Texture::spots(&[], 4.0), Deformation::NONE);
    for number in 0..8 {
        let seen =
            counts(&picture([120, 100], std::slice::from_ref(&bare)).unwrap(), 12, 0.01, 3, number).unwrap();
        let reference = Reference::new(whole, seen.into_raw_vec_and_offset().0, 1).unwrap();
        let refused = ChosenGrid::by_texture(&reference, GOAL_PX).unwrap_err();
        assert!(matches!(refused, CorrelationError::NoTexture { .. }), "{refused}");
        assert!(refused.to_string().contains("hint: "), "{refused}");
    }
    let tiny = Reference::new(Region::whole(6, 6), vec![1.0; 36], 1).unwrap();
    assert!(matches!(ChosenGrid::by_texture(&tiny, GOAL_PX), Err(CorrelationError::GridTooLarge { .. })));
}
