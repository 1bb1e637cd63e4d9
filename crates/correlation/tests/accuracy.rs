//! Bias, standard deviation and stated uncertainty on analytic speckle with a known motion, 33 x 33 px, 12 bit.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, and shows what it measured")]

#[path = "support/plain.rs"]
mod plain;
mod support;

use chainwave_correlation::{Interpolation, PreparedSubset, Reference, Settings, Shape, Window, Workspace};
use chainwave_measurement::{Position, Region, Subset};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use support::{
    FULL_RANGE, Image, SIZE, Speckle, Wrong, affine_bounds_px, assert_coverage, bound_of_unknown_texture,
    coverage, error_of_std, floors_px, grid, moments, rms, sense, slopes,
};

fn settings(interpolation: Interpolation, shape: Shape) -> Settings {
    Settings { interpolation, shape, ..Settings::default() }
}

/// A position, with its error in x and y.
type Found = (Position, [f64; 2]);

/// The position of each subset in `target`; not of those that are refused or lost.
fn errors(
    settings: &Settings,
    reference: &Reference,
    target: &[f32],
    place: impl Fn([f64; 2]) -> [f64; 2],
) -> Vec<Found> {
    let window = Window::new(Region::whole(SIZE[0], SIZE[1]), target, settings.interpolation).unwrap();
    let mut workspace = Workspace::default();
    let mut find = |subset: &Subset| {
        let prepared = PreparedSubset::new(reference, subset, settings).ok()?;
        let truth = place([subset.x_px, subset.y_px]);
        let found = prepared.match_in(&window, truth.map(f64::round), &mut workspace).ok()?.position;
        Some((found, [found.x_px.value - truth[0], found.y_px.value - truth[1]]))
    };
    grid(16).iter().filter_map(&mut find).collect()
}

fn reference(image: Vec<f32>) -> Reference {
    Reference::new(Region::whole(SIZE[0], SIZE[1]), image, 1).unwrap()
}

/// Speckle with a little less light, so that hardly a spot saturates.
fn speckle_of_shifts() -> Image {
    let speckle = Speckle::new(1, Speckle::RADIUS_PX);
    Box::new(move |[u, v]| speckle.render(|[x, y]| [x + u, y + v]).iter().map(|g| 0.85 * g).collect())
}

/// Errors of each of some settings over so many sub-pixel shifts, each with its own noise.
fn errors_of_shifts(settings: &[Settings], noise: f64, n_shifts: u32) -> Vec<Vec<Found>> {
    let image = speckle_of_shifts();
    let still = image([0.0; 2]);
    let mut found = vec![Vec::new(); settings.len()];
    for step in 0..n_shifts {
        let shift = f64::from(step) / f64::from(n_shifts);
        let place = move |[x, y]: [f64; 2]| [x + shift, y - 3.7 * shift];
        let seed = u64::from(100 + 2 * step);
        let reference = reference(sense(&still, noise, seed));
        let target = sense(&image([shift, -3.7 * shift]), noise, seed + 1);
        for (settings, found) in settings.iter().zip(&mut found) {
            found.extend(errors(settings, &reference, &target, place));
        }
    }
    found
}

/// Difference of the largest and the smallest mean error over sub-pixel shifts without noise, and the mean standard
/// uncertainty, in pixels.
fn bias_px(interpolation: Interpolation, radius_px: f64) -> [f64; 2] {
    let speckle = Speckle::new(1, radius_px);
    // with a little less light, so that no speckle saturates: what is clipped has no place between pixels
    let render = |place: &dyn Fn([f64; 2]) -> [f64; 2]| -> Vec<f32> {
        let image: Vec<f64> = speckle.render(place).into_iter().map(|g| 0.7 * g).collect();
        sense(&image, 0.0, 0)
    };
    let reference = reference(render(&|spot| spot));
    let settings = settings(interpolation, Shape::Affine);
    let means = (0..10).map(|step| {
        let place = move |[x, y]: [f64; 2]| [x + 0.1 * f64::from(step), y - 0.3];
        let found = errors(&settings, &reference, &render(&place), place);
        let mean = |of: &dyn Fn(&Found) -> f64| moments(&found.iter().map(of).collect::<Vec<_>>())[0];
        [mean(&|found| found.1[0]), mean(&|found| found.0.x_px.sigma)]
    });
    let means: Vec<[f64; 2]> = means.collect();
    let (low, high) = means
        .iter()
        .fold((f64::MAX, f64::MIN), |(low, high), [error, _]| (low.min(*error), high.max(*error)));
    [high - low, means.iter().map(|[_, sigma]| sigma).sum::<f64>() / means.len() as f64]
}

#[test]
fn the_bias_of_a_shift_falls_with_the_degree_of_the_spline_and_lies_within_sigma() {
    // Autocorrelation 4.5 px wide (spots of 1.35 px standard deviation), or each spot (1.9 px).
    for radius_px in [Speckle::RADIUS_PX, 1.9] {
        let of = |interpolation| bias_px(interpolation, radius_px);
        let [linear, cubic, moms, quintic, quintic_moms] = Interpolation::ALL.map(of);
        println!("{radius_px}: {:?} px", [linear, cubic, moms, quintic, quintic_moms]);
        // Without noise sigma is that of what is left of the bias once the foreseen one is off, and of rounding. What is
        // left has one sign for one texture: it lies within 1.96 sigma to either side.
        for [bias, sigma] in [linear, cubic, moms, quintic, quintic_moms] {
            assert!(bias < 2.0 * 1.96 * sigma, "{radius_px}: {bias} px, sigma {sigma} px");
        }
        // Before it is taken off, the bias of a wave of w rad/px is about `w^n/(2 pi)^n` with n = 2 taps, 4 and 6: with w of 0.5
        // to 1 a step to the next degree takes a tenth and less of it.
        assert!(cubic[0] < 0.1 * linear[0] && quintic[1] < cubic[1], "{linear:?} {cubic:?} {quintic:?}");
        // 1 mpx on the default, 0.1 mpx on the most accurate rung: what the crate is made for
        assert!(cubic[0] < 1e-3 && quintic[0] < 1e-4 && quintic_moms[0] < 1e-4, "{cubic:?} {quintic:?}");
    }
}

#[test]
fn the_standard_deviation_is_that_of_the_noise_floor() {
    let settings = settings(Interpolation::Cubic, Shape::Affine);
    let image = speckle_of_shifts();
    let (still, slopes) = (image([0.0; 2]), slopes(&image));
    let contrast = moments(&still)[1] / FULL_RANGE;
    for noise in [0.01, 0.02, 0.05] {
        let found = errors_of_shifts(std::slice::from_ref(&settings), noise, 10).remove(0);
        let bounds = affine_bounds_px(&still, &slopes, noise, &grid(16));
        assert_eq!(found.len(), 10 * bounds.len(), "no point is lost");
        let over_bound = found.iter().zip(bounds.iter().cycle()).map(|(found, bound)| found.1[0] / bound[0]);
        let ratio = rms(&over_bound.collect::<Vec<_>>());
        // The Cramer-Rao bound of a texture that is known, and the same where it is known from a picture alone that is as noisy;
        // what the estimate itself may lose of that, and three standard errors of a standard deviation.
        let (unknown, loss) = (bound_of_unknown_texture(contrast, noise), 1.02);
        let error = 3.0 * error_of_std(found.len());
        println!("{noise}: {ratio:.3} of the bound of a known texture, {unknown:.3} that of an unknown one");
        assert!(
            (1.0 - error..unknown * loss + error).contains(&ratio),
            "{noise}: {ratio} of the bound, {unknown}"
        );
        let [mean, std] = moments(&found.iter().map(|found| found.1[0]).collect::<Vec<_>>());
        // Bias is not seen beyond 3 standard errors of the mean.
        assert!(mean.abs() < 3.0 * std / (found.len() as f64).sqrt(), "{noise}: bias {mean} px");
    }
}

#[test]
fn stated_intervals_cover_their_share_of_errors() {
    let shapes = Shape::ALL.map(|shape| settings(Interpolation::Cubic, shape));
    // what the linear kernel takes from the image, and the quintic one does not
    let kernels =
        [Interpolation::Linear, Interpolation::Quintic].map(|kernel| settings(kernel, Shape::Affine));
    let cases = [shapes.as_slice(), &kernels].concat();
    for noise in [0.002, 0.01, 0.02, 0.05, 0.1] {
        let mut noise_alone = Vec::new();
        for (settings, found) in cases.iter().zip(errors_of_shifts(&cases, noise, 20)) {
            let name = format!("{} {} at {noise}", settings.interpolation, settings.shape);
            // at 10 % noise the least contrasted subsets are refused or lost
            let share_found = found.len() as f64 / (20.0 * 121.0);
            assert!(share_found >= if noise < 0.1 { 1.0 } else { 0.97 }, "{name}: {share_found}");
            let pulls = pulls(&found);
            println!("{name}: {:.1?} %", coverage(&pulls));
            // The bias of linear interpolation is eight times the least noise, of which what is left differs from subset to subset.
            if settings.interpolation == Interpolation::Linear && noise < 0.01 {
                assert_coverage(&name, &pulls, 1, Wrong::TooNarrow);
                assert_not_wider_than_stated_bias(&name, &pulls, &found, &noise_alone);
            } else {
                assert_coverage(&name, &pulls, 1, Wrong::Both);
            }
            if settings.interpolation == Interpolation::Cubic && settings.shape == Shape::Affine {
                noise_alone = found;
            }
        }
    }
}

/// Errors over their sigma, along x and y.
fn pulls(found: &[Found]) -> Vec<f64> {
    let of = |(position, error): &Found| [error[0] / position.x_px.sigma, error[1] / position.y_px.sigma];
    found.iter().flat_map(of).collect()
}

/// Were nothing left of a bias that sigma has a share for, errors would be those of noise alone, and so much rarer than
/// stated beyond their limits: intervals are no wider than that, but for two standard errors.
fn assert_not_wider_than_stated_bias(name: &str, pulls: &[f64], found: &[Found], noise_alone: &[Found]) {
    let sigma = |found: &[Found]| rms(&found.iter().map(|found| found.0.x_px.sigma).collect::<Vec<_>>());
    let wide = sigma(found) / sigma(noise_alone);
    for (share, limit) in coverage(pulls).into_iter().zip([1.0, 1.96]) {
        let most = 100.0 * libm::erf(limit * wide / std::f64::consts::SQRT_2);
        let error = 2.0 * (most * (100.0 - most) / pulls.len() as f64).sqrt();
        assert!(
            share < most + error,
            "{name}: {share} % within {limit} sigma, at most {most} % were expected"
        );
    }
}

#[test]
fn noise_that_grows_with_the_light_is_in_sigma() {
    // Counts of electrons: 1.2 a count, so 3.6 % of full range at the brightest, and 8 counts of read noise.
    let speckle = Speckle::new(1, Speckle::RADIUS_PX);
    let still = speckle.render(|spot| spot);
    let expose = |image: &[f64], seed: u64| {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut count = |value: &f64| {
            let normal: f64 = StandardNormal.sample(&mut random);
            let sigma = (64.0 + 12.0 * value).sqrt();
            (value + sigma * normal).round().clamp(0.0, FULL_RANGE) as f32
        };
        image.iter().map(&mut count).collect::<Vec<f32>>()
    };
    let found: Vec<_> = (0..12)
        .flat_map(|step| {
            let place = move |[x, y]: [f64; 2]| [x + 0.083 * f64::from(step), y - 0.3];
            let seed = 300 + 2 * step as u64;
            let target = expose(&speckle.render(place), seed + 1);
            errors(&Settings::default(), &reference(expose(&still, seed)), &target, place)
        })
        .collect();
    assert_coverage("shot noise", &pulls(&found), 1, Wrong::Both);
}

#[test]
fn vectors_find_what_the_textbook_finds_pixel_by_pixel() {
    let speckle = Speckle::new(1, Speckle::RADIUS_PX);
    let lit = |image: Vec<f64>| image.into_iter().map(|g| 0.7 * g).collect::<Vec<_>>();
    let place = |[x, y]: [f64; 2]| [x + 0.37 + 1e-3 * (x - 210.0), y + 0.61];
    let images =
        [sense(&lit(speckle.render(|spot| spot)), 0.0, 1), sense(&lit(speckle.render(place)), 0.0, 2)];
    let splines = images.each_ref().map(|image| plain::Spline::through(SIZE[0], image));
    let window = Window::new(Region::whole(SIZE[0], SIZE[1]), &images[1], Interpolation::Cubic).unwrap();
    let prepared = reference(images[0].clone());
    for subset in grid(45) {
        let (start, settings) = ([subset.x_px + 0.5, subset.y_px + 0.5], Settings::default());
        let textbook = plain::Plain::new(&splines[0], [subset.x_px, subset.y_px], 16);
        let (found, _) = textbook.find(&splines[1], start).unwrap();
        let vectors = PreparedSubset::new(&prepared, &subset, &settings).unwrap();
        let ours = vectors.match_in(&window, start, &mut Workspace::default()).unwrap().position;
        // The textbook keeps the bias of interpolation, 0.9 mpx and what each texture adds, and both stop within 1 mpx.
        let apart = (ours.x_px.value - found[0]).hypot(ours.y_px.value - found[1]);
        assert!(apart < 3e-3, "{}: {apart}", subset.name);
    }
}

#[test]
fn light_that_changes_moves_nothing() {
    let speckle = Speckle::new(3, Speckle::RADIUS_PX);
    let place = |[x, y]: [f64; 2]| [x + 0.4, y + 0.2];
    let reference = reference(sense(&speckle.render(|spot| spot), 0.01, 1));
    let target = sense(&speckle.render(place), 0.01, 2);
    let dimmed: Vec<f32> = target.iter().map(|g| 0.8 * g + 409.5).collect();
    let settings = Settings::default();
    let bright = errors(&settings, &reference, &target, place);
    for ((a, _), (b, _)) in bright.iter().zip(errors(&settings, &reference, &dimmed, place)) {
        // f32 coefficients: 1e-7 of 4096 counts over slopes of 400 counts per pixel, and the same iterations
        assert!((a.x_px.value - b.x_px.value).abs() < 1e-5, "{a:?} {b:?}");
        assert!((a.zncc - b.zncc).abs() < 1e-5 && a.iterations == b.iterations);
        // Sigma is in pixels: the gain b = 0.8 divides out, but for the reference's noise. By eq. 1 and 2 of `uncertainty` the
        // dimmed picture, whose noise is dimmed as well, has (G + 1)/(G + b^2) (1 + b^2)/2 times the variance; the least G of the
        // cubic kernel is 0.36 along both axes, and each residual tells its noise to 2 %.
        let most = (1.36_f64 / (0.36 + 0.64) * 1.64 / 2.0).sqrt();
        let ratio = b.x_px.sigma / a.x_px.sigma;
        assert!((0.97..most + 0.03).contains(&ratio), "{ratio} of at most {most}");
    }
}

#[test]
fn a_rotation_is_followed_by_an_affine_subset() {
    // Round spots turn with the body, so the image is exactly that of a rotated body.
    let speckle = Speckle::new(4, Speckle::RADIUS_PX);
    let (sin, cos) = 2.0_f64.to_radians().sin_cos();
    let place = move |[x, y]: [f64; 2]| {
        let (x, y) = (x - 210.0, y - 210.0);
        [210.0 + cos * x - sin * y, 210.0 + sin * x + cos * y]
    };
    let reference = reference(sense(&speckle.render(|spot| spot), 0.0, 1));
    let target = sense(&speckle.render(place), 0.0, 2);
    let settings = Settings { convergence_px: 1e-5, ..settings(Interpolation::Quintic, Shape::Affine) };
    let found = errors(&settings, &reference, &target, place);
    let std_px = moments(&found.iter().map(|found| found.1[0]).collect::<Vec<_>>())[1];
    println!("{std_px} px");
    // A tenth of what 1 % noise makes of it: nothing that would be seen. (One pixel in a thousand is saturated, and
    // interpolation smears it.)
    assert!(std_px < 0.1 * floor_px(0.01), "{std_px}");
}

#[test]
fn the_mean_of_frames_at_rest_is_a_better_reference() {
    let speckle = Speckle::new(5, Speckle::RADIUS_PX);
    let still = speckle.render(|spot| spot);
    let place = |[x, y]: [f64; 2]| [x + 0.3, y - 0.3];
    let target = sense(&speckle.render(place), 0.02, 1);
    let frames: Vec<Vec<f32>> = (0..8).map(|frame| sense(&still, 0.02, 10 + frame)).collect();
    let film = support::recorded([frames, vec![target]].concat());
    let reference = chainwave_correlation::ReferenceFrames::Mean(0..8);
    let settings = settings(Interpolation::Quintic, Shape::Affine);
    let tracks = chainwave_correlation::track(&film, &grid(16), &reference, &settings, &|_| ()).unwrap();
    let found: Vec<_> = tracks
        .iter()
        .zip(grid(16))
        .map(|(track, subset)| {
            let position = track.positions[8].unwrap();
            (position, [position.x_px.value - subset.x_px - 0.3, position.y_px.value - subset.y_px + 0.3])
        })
        .collect();
    // The bound holds two noises of variance s^2, this one s^2 (1 + 1/8).
    let still: Vec<f64> = still.iter().map(|g| g.min(FULL_RANGE)).collect();
    let image: Image = Box::new(move |[u, v]| speckle.render(|[x, y]| [x + u, y + v]));
    let bounds = affine_bounds_px(&still, &slopes(&image), 0.02, &grid(16));
    let over = |of: &dyn Fn(&Found) -> f64| {
        let pairs = found.iter().zip(&bounds);
        rms(&pairs.map(|(found, bound)| of(found) / (0.75 * bound[0])).collect::<Vec<_>>())
    };
    let (errors, sigmas) = (over(&|found| found.1[0]), over(&|found| found.0.x_px.sigma));
    println!("errors {errors:.3} and sigmas {sigmas:.3} of the bound");
    assert!((errors - 1.0).abs() < 3.0 * error_of_std(found.len()), "{errors}");
    // 121 residuals of 1089 px tell their noise to 0.2 %; saturated pixels and the estimate's own loss are the rest
    assert!((0.99..1.05).contains(&sigmas), "{sigmas}");
}

/// Root mean square over the subsets of the noise floor along x, from the image without noise.
fn floor_px(noise: f64) -> f64 {
    let speckle = Speckle::new(1, Speckle::RADIUS_PX);
    let image: Image = Box::new(move |[u, v]| speckle.render(|[x, y]| [x + u, y + v]));
    rms(&floors_px(&slopes(&image), noise, &grid(16)).iter().map(|floor| floor[0]).collect::<Vec<_>>())
}
