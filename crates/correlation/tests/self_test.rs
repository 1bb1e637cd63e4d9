//! The self-test of the ladder on a recording that it knows only by its reference.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod support;

use chainwave_correlation::{
    CorrelationError, Interpolation, Method, ReferenceFrames, Settings, Shape, ShapeChoice, SizeReason,
    cheapest_within, film_test, self_test, subset_size,
};
use chainwave_measurement::{MemoryRecording, Subset, Track};
use chainwave_synthetic::pictures::{Deformation, Surface, Texture, counts, picture};
use support::{SIZE, Speckle, grid, moments, recorded, sense, subset};

const FIRST: ReferenceFrames = ReferenceFrames::Single(0);

/// Frame k has moved by (k - 1)/10 px; the first two show the plane at rest.
fn film(noise: f64) -> MemoryRecording {
    let speckle = Speckle::new(17, Speckle::RADIUS_PX);
    let frame = |k: i32| {
        let way = 0.1 * f64::from((k - 1).max(0));
        let image = speckle.render(|[x, y]| [x + way, y - 3.0 * way]);
        sense(&image, noise, 40 + k as u64)
    };
    recorded((0..12).map(frame).collect())
}

fn method(interpolation: Interpolation) -> Method {
    Method::IcGn { interpolation, shape: ShapeChoice::Named(Shape::Affine) }
}

#[test]
fn the_error_that_a_self_test_foresees_is_the_error_made() {
    for (noise, interpolation) in
        [(0.0, Interpolation::Linear), (0.0, Interpolation::Cubic), (0.02, Interpolation::CubicMoms)]
    {
        let film = film(noise);
        let subsets = grid(40);
        let methods = [method(interpolation)];
        let foreseen = self_test(&methods, &film, &subsets, &FIRST, &Settings::default()).unwrap()[0];
        let tracks = methods[0].track(&film, &subsets, &FIRST, &Settings::default(), &|_| ()).unwrap();
        let errors: Vec<f64> = tracks
            .iter()
            .zip(&subsets)
            .flat_map(|(track, subset)| {
                let error = |frame: usize| {
                    track.positions[frame].unwrap().x_px.value - subset.x_px - 0.1 * (frame - 1) as f64
                };
                (1..12).map(error).collect::<Vec<_>>()
            })
            .collect();
        let [mean, std] = moments(&errors);
        let made = mean.hypot(std);
        let foreseen_px = foreseen.error_px.unwrap();
        println!("{interpolation} at {noise}: foreseen {foreseen_px:.5}, made {made:.5} px");
        // Six patches of many, and the reference's own noise as scene; rounding and saturation of speckles are not foreseen.
        assert!(
            (foreseen_px - made).abs() < 0.25 * made + 5e-5,
            "{interpolation}: {foreseen:?}, made {made}"
        );
        assert_eq!(foreseen.n_lost, 0);
    }
}

#[test]
fn noise_is_not_taken_for_an_error_of_the_method() {
    for interpolation in Interpolation::ALL.into_iter().filter(|one| *one != Interpolation::Linear) {
        let bias = |noise: f64| {
            let found =
                self_test(&[method(interpolation)], &film(noise), &grid(40), &FIRST, &Settings::default());
            let found = found.unwrap()[0];
            (found.bias_px, found.error_px.unwrap())
        };
        let ((alone_px, _), (noisy_px, error_px)) = (bias(0.0), bias(0.02));
        println!("{interpolation}: {alone_px:.6} without noise, {noisy_px:.6} of {error_px:.5} px with it");
        // Linear noise cancels in pairs. What is left is the reference's own noise, whose blur by interpolation changes with the shift: the
        // less, the better it interpolates (a blur of some per cent of the finest texture by cubic splines). Without pairs, the means of
        // six patches scattered by 1/sqrt(12) of the noise, 3.1 times that from peak to peak over ten shifts: 0.9 of it.
        assert!(
            (noisy_px - alone_px).abs() < 0.1 * error_px,
            "{interpolation}: {alone_px} {noisy_px} {error_px}"
        );
    }
}

#[test]
fn an_accuracy_takes_the_cheapest_rung_that_has_it() {
    let film = film(0.0);
    let subsets = grid(40);
    let offered: Vec<Method> = Interpolation::ALL.map(method).into();
    let cheapest =
        |error_px: f64| cheapest_within(error_px, &offered, &film, &subsets, &FIRST, &Settings::default());
    assert_eq!(cheapest(0.05).unwrap(), method(Interpolation::Linear));
    assert_eq!(cheapest(0.0005).unwrap(), method(Interpolation::Cubic));
    let refused = cheapest(1e-6).unwrap_err();
    assert!(matches!(refused, CorrelationError::AccuracyNotReached { .. }), "{refused}");
}

#[test]
fn subsets_at_the_edge_of_the_frame_are_tested_too() {
    let far = SIZE[0] as f64 - 17.0;
    let subsets = [subset(16.0, 16.0, 16), subset(far, far, 16), subset(16.0, far, 16)];
    let tested =
        self_test(&[method(Interpolation::Cubic)], &film(0.01), &subsets, &FIRST, &Settings::default());
    assert_eq!(tested.unwrap()[0].n_lost, 0);
}

#[test]
fn the_smallest_subset_that_the_noise_allows_is_as_good_as_promised() {
    let film = film(0.02);
    let half_at = |place: [f64; 2], error_px: f64| subset_size(&film, place, &[], &FIRST, error_px);
    let half = half_at([200.0, 210.0], 0.012).unwrap().half_width_px;
    let sigma = |half: usize| {
        let subsets = [subset(200.0, 210.0, half)];
        let tracks =
            method(Interpolation::Quintic).track(&film, &subsets, &FIRST, &Settings::default(), &|_| ());
        let position = tracks.unwrap()[0].positions[5].unwrap();
        position.x_px.sigma.max(position.y_px.sigma)
    };
    // The noise in the gradients costs 4 % more than the floor; the residual tells its own noise to 5 %. A size is met to an eighth.
    let [found, smaller] = [half, half - 3].map(sigma);
    assert!(found < 1.12 * 0.012 && smaller > 0.012, "{half}: {found} {smaller}");
    let hopeless = half_at([200.0, 210.0], 1e-9).unwrap();
    assert_eq!((hopeless.half_width_px, hopeless.reason), (60, SizeReason::Bounded));
    assert!(half_at([2.0, 210.0], 0.01).is_err());
}

/// A method that an accuracy leads to of those `offered`, on a film of surfaces; and its tracks.
fn chosen_of(
    offered: &[Method],
    film: &MemoryRecording,
    subsets: &[Subset],
    error_px: f64,
) -> (Method, Vec<Track>) {
    let settings = Settings::default();
    let chosen = cheapest_within(error_px, offered, film, subsets, &FIRST, &settings).unwrap();
    (chosen, chosen.track(film, subsets, &FIRST, &settings, &|_| ()).unwrap())
}

fn all_affine() -> Vec<Method> {
    Method::with_shape(ShapeChoice::Named(Shape::Affine))
}

fn shown(size_px: [usize; 2], frames: &[Vec<Surface>], noise: f64) -> MemoryRecording {
    let seen = |(number, surfaces): (u64, &Vec<Surface>)| {
        let seen = counts(&picture(size_px, surfaces).unwrap(), 12, noise, 9, number).unwrap();
        seen.into_raw_vec_and_offset().0
    };
    MemoryRecording::new(size_px[0], 12, (0..).zip(frames).map(seen).collect())
}

#[test]
fn an_accuracy_takes_what_follows_bodies_that_turn() {
    // Six bodies beside each other that turn by 13 to 21 degrees, one after the other, and stay so.
    let centre = |k: usize| [30.0 + 50.0 * k as f64, 30.0];
    let turn_rad = |k: usize, frame: usize| {
        let most = (13.0 + 1.6 * k as f64).to_radians();
        most * ((frame as f64 - 4.0 * k as f64) / 12.0).clamp(0.0, 1.0)
    };
    let bodies = |frame: usize| -> Vec<Surface> {
        (0..6)
            .map(|k| {
                Surface::turned_disc(60 + k as u64, 4.0, (centre(k), 23.0), turn_rad(k, frame), [0.0; 2])
            })
            .collect()
    };
    let film = shown([310, 60], &(0..40).map(bodies).collect::<Vec<_>>(), 0.01);
    let subsets: Vec<Subset> = (0..6).map(|k| subset(centre(k)[0], centre(k)[1], 14)).collect();
    // the template search takes less work than the quintic kernel
    let template_first = ["template-parabola", "icgn-quintic-affine"].map(|name| name.parse().unwrap());
    for (offered, error_px) in [(template_first.to_vec(), 0.2), (all_affine(), 0.05), (all_affine(), 0.02)] {
        let (chosen, tracks) = chosen_of(&offered, &film, &subsets, error_px);
        let readings = || {
            tracks
                .iter()
                .zip(&subsets)
                .flat_map(|(track, subset)| track.positions.iter().map(move |found| (found, subset)))
        };
        let n_lost = readings().filter(|(found, _)| found.is_err()).count();
        let errors: Vec<f64> = readings()
            .filter_map(|(found, subset)| found.as_ref().ok().map(|found| (found, subset)))
            .flat_map(|(found, subset)| [found.x_px.value - subset.x_px, found.y_px.value - subset.y_px])
            .collect();
        let [mean, std] = moments(&errors);
        println!("{error_px} px: {chosen}, {n_lost} of {} lost, {:.4} px off", 6 * 40, mean.hypot(std));
        assert_eq!(n_lost, 0, "{chosen} for {error_px}");
        // what noise adds to the positions that it was held against, some 0.01 px here
        assert!(mean.hypot(std) < error_px.hypot(0.01), "{chosen} for {error_px}");
    }
}

#[test]
fn an_accuracy_is_found_on_a_strip() {
    // half height 15 of 39 rows: nothing can be shifted by whole pixels across
    let texture = Texture::speckles(8, 4.0, [150.0, 19.0], [200.0, 60.0]);
    let strip = |frame: usize| {
        let shift = Deformation::rigid([150.0, 19.0], 0.0, [0.7 * frame as f64, 0.3]);
        vec![Surface::everywhere(texture.clone(), if frame == 0 { Deformation::NONE } else { shift })]
    };
    let film = shown([300, 39], &(0..20).map(strip).collect::<Vec<_>>(), 0.01);
    let at = |x_px: f64| Subset { half_height_px: 15, ..subset(x_px, 19.0, 18) };
    let subsets = [60.0, 140.0, 220.0].map(at);
    let (chosen, tracks) = chosen_of(&all_affine(), &film, &subsets, 0.02);
    let n_lost = tracks.iter().flat_map(|track| &track.positions).filter(|found| found.is_err()).count();
    assert_eq!(n_lost, 0, "{chosen}");
    let offered = [method(Interpolation::Cubic)];
    let refused = cheapest_within(1e-6, &offered, &film, &subsets, &FIRST, &Settings::default()).unwrap_err();
    assert!(refused.to_string().contains("the frame holds no larger subsets"), "{refused}");
}

#[test]
fn what_loses_turned_bodies_is_told_on_the_film() {
    let turned = |frame: usize| {
        let turn = (0.9 * frame as f64).to_radians();
        vec![Surface::turned_disc(5, 4.0, ([40.0, 40.0], 30.0), turn, [0.0; 2])]
    };
    let film = shown([80, 80], &(0..30).map(turned).collect::<Vec<_>>(), 0.01);
    let subsets = [subset(40.0, 40.0, 16)];
    let methods: Vec<Method> =
        ["template-parabola", "icgn-linear-affine"].map(|name| name.parse().unwrap()).into();
    let found = film_test(&methods, &film, &subsets, &FIRST, &Settings::default()).unwrap();
    assert!(
        found[0].n_lost > 5,
        "a template that does not turn loses what has turned by 26 degrees: {found:?}"
    );
    assert_eq!(found[1].n_lost, 0, "{found:?}");
    // the kernel's error, foreseen and taken off but for a seventh of its tens of millipixels
    assert!(found[1].error_px.unwrap() < 0.02, "{found:?}");
}

/// A subset without texture is lost by every method, and one that is hidden for most of a film in most of it: neither tells one from another.
#[test]
fn an_accuracy_is_found_where_some_subsets_are_bare_or_hidden() {
    let speckle = Speckle::new(23, Speckle::RADIUS_PX);
    let film = |covers: &dyn Fn(usize, [usize; 2]) -> Option<f64>| {
        let frame = |k: usize| {
            let mut image = speckle.render(|[x, y]| [x + 0.21 * k as f64, y]);
            for (i, grey) in image.iter_mut().enumerate() {
                *grey = covers(k, [i % SIZE[0], i / SIZE[0]]).unwrap_or(0.7 * *grey);
            }
            sense(&image, 0.005, 60 + k as u64)
        };
        recorded((0..30).map(frame).collect())
    };
    let bare = film(&|_, [x, _]| (x > 250).then_some(60.0));
    let hidden =
        film(&|k, [x, y]| (k > 10 && (60..360).contains(&x) && (80..320).contains(&y)).then_some(1500.0));
    let of_bare = [subset(80.0, 200.0, 16), subset(180.0, 200.0, 16), subset(330.0, 200.0, 16)];
    let of_hidden = [subset(150.0, 200.0, 16), subset(250.0, 200.0, 16)];
    for (film, subsets) in [(bare, of_bare.as_slice()), (hidden, of_hidden.as_slice())] {
        let chosen =
            cheapest_within(0.05, &all_affine(), &film, subsets, &FIRST, &Settings::default()).unwrap();
        let rungs = self_test(&[chosen], &film, subsets, &FIRST, &Settings::default()).unwrap();
        assert!(rungs[0].n_lost == 0 && rungs[0].error_px.unwrap() < 0.05, "{rungs:?}");
    }
}
