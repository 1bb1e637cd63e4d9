//! Fields that bend: what the shape function cannot follow is taken off or stated, so that intervals hold on both sides.
//!
//! The pictures are drawn in closed form by a renderer that knows no matcher.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(clippy::print_stdout, reason = "what each case gave is a table to be read")]

use std::num::NonZero;

use chainwave_correlation::{
    Field, FieldGrid, FieldPoint, Reference, Settings, Shape, ShapeChoice, Window, correlate, strains,
};
use chainwave_measurement::Region;
use chainwave_synthetic::pictures::{Deformation, Surface, Texture, counts, picture};

const SIZE_PX: [usize; 2] = [360, 360];
const MIDDLE_PX: [f64; 2] = [179.5, 179.5];
const GRID: FieldGrid = FieldGrid { step_px: 8, half_px: 16 };
/// Subsets of 33 x 33 px that lie side by side in a picture, 9 x 9: neighbouring points share pixels.
const N_INDEPENDENT: f64 = 81.0;
const AFFINE: ShapeChoice = ShapeChoice::Named(Shape::Affine);
const AUTO: ShapeChoice = ShapeChoice::ByEvidence;

/// A surface before and after its deformation, without noise.
struct Pictures {
    deformation: Deformation,
    seed: u64,
    before: ndarray::Array2<f64>,
    after: ndarray::Array2<f64>,
}

impl Pictures {
    fn new(deformation: Deformation, seed: u64) -> Self {
        let texture = Texture::speckles(seed, 4.5, MIDDLE_PX, [230.0; 2]);
        let surface = Surface::everywhere(texture, Deformation::NONE);
        let before = picture(SIZE_PX, std::slice::from_ref(&surface)).unwrap();
        let after = picture(SIZE_PX, &[surface.deformed(deformation)]).unwrap();
        Self { deformation, seed, before, after }
    }

    fn field(&self, noise: f64, choice: ShapeChoice, n_threads: usize) -> Field {
        let [before, after] = [(&self.before, 0), (&self.after, 1)].map(|(tones, number)| {
            counts(tones, 12, noise, self.seed, number).unwrap().into_raw_vec_and_offset().0
        });
        let whole = Region::whole(SIZE_PX[0], SIZE_PX[1]);
        let settings = Settings::default();
        let reference = Reference::new(whole, before, 1).unwrap().saturating_at(4095.0);
        let target = Window::new(whole, &after, settings.interpolation).unwrap();
        let n_threads = NonZero::new(n_threads).unwrap();
        correlate(&reference, &target, GRID, &settings, choice, n_threads, &|_| ()).unwrap()
    }

    /// Error and sigma of each displacement along y, and how many points there are in all.
    fn errors(&self, noise: f64, choice: ShapeChoice) -> (Vec<[f64; 2]>, usize) {
        let points = self.field(noise, choice, 1).points;
        let error = |point: &FieldPoint| {
            let there = point.found.as_ref().ok()?.position.y_px;
            let [_, truth] = self.deformation.displaced_px([point.x_px, point.y_px]);
            Some([there.value - truth, there.sigma])
        };
        (points.iter().filter_map(error).collect(), points.len())
    }
}

/// What the errors along y of some fields say.
struct Told {
    inside: f64,
    rms_px: f64,
    sigma_px: f64,
}

fn told(pictures: &[Pictures], noise: f64, choice: ShapeChoice) -> Told {
    let mut errors = Vec::new();
    for one in pictures {
        let (found, n_points) = one.errors(noise, choice);
        // a point or two in a hundred may be lost where a subset leaves the picture
        assert!(found.len() * 50 >= n_points * 49, "{} of {n_points}", found.len());
        errors.extend(found);
    }
    let n = errors.len() as f64;
    let inside = errors.iter().filter(|[error, sigma]| error.abs() < 1.96 * sigma).count() as f64 / n;
    let rms_px = (errors.iter().map(|[error, _]| error * error).sum::<f64>() / n).sqrt();
    errors.sort_by(|a, b| a[1].total_cmp(&b[1]));
    Told { inside, rms_px, sigma_px: errors[errors.len() / 2][1] }
}

/// A wave of the displacement along y that runs along x.
fn wave(amplitude_px: f64, period_px: f64) -> Deformation {
    Deformation::Wave { amplitude_px: [0.0, amplitude_px], along: [1.0, 0.0], period_px }
}

fn cases(deformation: Deformation, n: u64) -> Vec<Pictures> {
    (1..=n).map(|seed| Pictures::new(deformation, seed)).collect()
}

/// The claim is 93 to 97 %, beyond which two standard errors of the independent subsets are left.
fn assert_both_sides(name: &str, told: &Told, n_cases: f64) {
    println!("{name}: {:.1} % of 95", 100.0 * told.inside);
    let standard_error = (0.95 * 0.05 / (n_cases * N_INDEPENDENT)).sqrt();
    assert!((told.inside - 0.95).abs() < 0.02 + 2.0 * standard_error, "{name}: {}", told.inside);
}

#[test]
fn by_evidence_intervals_hold_at_every_period() {
    for period_px in [50.0, 70.0, 100.0, 200.0, 400.0] {
        let cases = cases(wave(0.5, period_px), 2);
        assert_both_sides(&format!("period {period_px} px"), &told(&cases, 0.01, AUTO), 2.0);
    }
}

#[test]
fn a_star_pattern_is_held() {
    let star = Deformation::Star {
        amplitude_px: 0.5,
        row_px: 179.5,
        periods_px: [60.0, 300.0],
        width_px: SIZE_PX[0] as f64,
    };
    let cases = cases(star, 2);
    assert_both_sides("star", &told(&cases, 0.01, AUTO), 2.0);
}

#[test]
fn affine_subsets_hold_where_they_follow_and_are_never_sure_where_they_do_not() {
    for (period_px, follows) in [(60.0, false), (150.0, true), (300.0, true)] {
        let cases = cases(wave(0.5, period_px), 2);
        let told = told(&cases, 0.01, AFFINE);
        if follows {
            assert_both_sides(&format!("affine, period {period_px} px"), &told, 2.0);
        } else {
            println!("affine, period {period_px} px: {:.1} %", 100.0 * told.inside);
            assert!(told.inside > 0.93, "{}", told.inside);
        }
    }
}

#[test]
fn a_field_that_does_not_bend_is_stated_as_before() {
    let stretched = Deformation::stretch(MIDDLE_PX, [0.01, -0.01]);
    let cases = cases(stretched, 2);
    let told = told(&cases, 0.02, AFFINE);
    assert_both_sides("stretched", &told, 2.0);
    // 162 independent errors tell a standard deviation to 5.6 %, of which two
    assert!((told.sigma_px / told.rms_px - 1.0).abs() < 0.112, "{} {}", told.sigma_px, told.rms_px);
}

/// Strains over 7 x 7 points of waves of the displacement along x that run along it: u = A sin(k x), and of the Green-Lagrange strain
/// `g + g^2/2` of the gradient g.
#[test]
fn strains_state_what_their_plane_leaves() {
    for (period_px, noise) in STRAINED {
        let deformation = Deformation::Wave { amplitude_px: [0.5, 0.0], along: [1.0, 0.0], period_px };
        let mut pulls = Vec::new();
        for seed in [1, 2] {
            let field = Pictures::new(deformation, seed).field(noise, AUTO, 1);
            for (point, strain) in field.points.iter().zip(strains(&field, 3, NonZero::<usize>::MIN)) {
                let gradient = deformation.gradient([point.x_px, point.y_px])[0][0];
                let Some(strain) = strain else { continue };
                pulls.push((strain.xx.value - gradient - 0.5 * gradient * gradient) / strain.xx.sigma);
            }
        }
        let inside = pulls.iter().filter(|pull| pull.abs() < 1.96).count() as f64 / pulls.len() as f64;
        println!("| {period_px} px | {} % | {:.1} % |", 100.0 * noise, 100.0 * inside);
        // Windows of 81 px, 4 x 4 side by side in each of two pictures; where the truncation exceeds the noise it may be wider.
        let standard_error = (0.95 * 0.05 / 32.0_f64).sqrt();
        assert!(inside > 0.93 - 2.0 * standard_error, "{period_px} px, {noise}: {inside}");
    }
}

/// Periods and noises of strained waves.
const STRAINED: [(f64, f64); 4] = [(70.0, 0.01), (100.0, 0.002), (200.0, 0.02), (400.0, 0.01)];

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let one = Pictures::new(wave(0.7, 90.0), 3);
    let of_one = one.field(0.01, AUTO, 1);
    for n_threads in [2, 5] {
        assert_eq!(one.field(0.01, AUTO, n_threads), of_one);
    }
}

/// The table of docs/src/measured/correlation.md.
#[test]
#[ignore = "a table of the book, of several minutes"]
fn table() {
    println!(
        "count: field,affine_held,affine_sigma_mpx,affine_rms_mpx,auto_held,auto_sigma_mpx,auto_rms_mpx"
    );
    for period_px in [50.0, 70.0, 100.0, 150.0, 200.0, 400.0] {
        let cases = cases(wave(0.5, period_px), 4);
        for noise in [0.002, 0.01, 0.03] {
            let [affine, auto] = [AFFINE, AUTO].map(|choice| {
                let Told { inside, rms_px, sigma_px } = told(&cases, noise, choice);
                format!("{:.1} %,{:.1},{:.1}", 100.0 * inside, 1e3 * sigma_px, 1e3 * rms_px)
            });
            println!("count: \"{period_px} px, {:.1} %\",{affine},{auto}", 100.0 * noise);
        }
    }
}

/// Rows above which one body shows, in the deformed picture, and how both have moved.
const CRACK_ROW: usize = 150;
const ASUNDER_PX: [[f64; 2]; 2] = [[6.3, -1.7], [-5.8, 2.4]];

/// Where subsets lie on one side of a crack, matches are right and known as well as elsewhere, whatever lies across it.
#[test]
fn a_crack_moves_nothing_beside_it() {
    let noise = 0.01;
    for choice in [AFFINE, AUTO, ShapeChoice::Named(Shape::Translation)] {
        let [mut upper, lower] = ASUNDER_PX.map(|shift_px| {
            let moved = Deformation::Affine { gradient: [[0.0; 2]; 2], centre_px: [0.0; 2], shift_px };
            Pictures::new(moved, 7)
        });
        let rows = ndarray::s![CRACK_ROW.., ..];
        upper.after.slice_mut(rows).assign(&lower.after.slice(rows));
        let (mut wrong, mut inside, mut n, mut sigmas) = (0, 0_u32, 0, Vec::new());
        for point in upper.field(noise, choice, 1).points {
            let half = GRID.half_px as f64 + 1.0;
            // The side that the whole subset shows, with a pixel more; none where the crack goes through it or it leaves the picture.
            let rows_of =
                |side: usize| if side == 0 { 0.0..CRACK_ROW as f64 } else { CRACK_ROW as f64..360.0 };
            let shows = |side: &usize| {
                let y = point.y_px + ASUNDER_PX[*side][1];
                rows_of(*side).contains(&(y - half)) && rows_of(*side).contains(&(y + half))
            };
            let (Some(side), Ok(found)) = ((0..2).find(shows), &point.found) else { continue };
            let there = [found.position.x_px, found.position.y_px];
            for (axis, from) in [point.x_px, point.y_px].into_iter().enumerate() {
                let error = there[axis].value - from - ASUNDER_PX[side][axis];
                n += 1;
                wrong += usize::from(error.abs() > 0.5 && error.abs() > 5.0 * there[axis].sigma);
                inside += u32::from(error.abs() < 1.96 * there[axis].sigma);
                sigmas.push(there[axis].sigma);
            }
        }
        sigmas.sort_by(f64::total_cmp);
        let [usual, high] = [n / 2, n * 99 / 100].map(|k| sigmas[k]);
        let told = Told { inside: f64::from(inside) / n as f64, rms_px: f64::NAN, sigma_px: usual };
        assert_both_sides(&format!("beside a crack, {choice:?}"), &told, 1.0);
        assert_eq!(wrong, 0);
        // Subsets' textures differ by some tenths; what lies across would be a thousand times the noise.
        assert!(high < 2.0 * usual, "{high} px beside {usual}");
    }
}
