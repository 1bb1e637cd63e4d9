//! The self-test of the ladder on a recording that it knows only by its reference.

mod support;

use chainwave_correlation::{
    CorrelationError, Interpolation, Method, ReferenceFrames, Settings, Shape, ShapeChoice, SizeReason,
    cheapest_within, self_test, subset_size,
};
use chainwave_measurement::MemoryRecording;
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
