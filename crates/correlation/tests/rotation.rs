//! The angle by which a match says that its subset is turned: right, as exact as its noise lets it be, and within its interval.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, and shows what it measured")]

mod support;

use std::f64::consts::PI;
use std::num::NonZero;

use chainwave_correlation::{
    FieldGrid, Reference, ReferenceFrames, Settings, Shape, ShapeChoice, Window, Workspace, correlate, track,
};
use chainwave_measurement::Region;
use support::{SIZE, Speckle, Wrong, assert_coverage, grid, moments, prepare, recorded, sense, subset};

const CENTRE: [f64; 2] = [210.0, 210.0];

/// The plane turned about the middle of the picture, from right towards down, and stretched before that by `1 + stretch` along x.
#[derive(Clone, Copy)]
struct Turned {
    degrees: f64,
    stretch: f64,
}

impl Turned {
    fn place(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.degrees.to_radians().sin_cos();
        let (dx, dy) = ((1.0 + self.stretch) * (x - CENTRE[0]), y - CENTRE[1]);
        [CENTRE[0] + 0.3 + cos * dx - sin * dy, CENTRE[1] - 0.2 + sin * dx + cos * dy]
    }

    fn source(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.degrees.to_radians().sin_cos();
        let (dx, dy) = (x - CENTRE[0] - 0.3, y - CENTRE[1] + 0.2);
        [CENTRE[0] + (cos * dx + sin * dy) / (1.0 + self.stretch), CENTRE[1] - sin * dx + cos * dy]
    }
}

/// Errors of angles in radians, and over their sigmas, of subsets of 33 x 33 px.
fn errors(turned: Turned, noise: f64, shape: Shape) -> [Vec<f64>; 2] {
    const N_FRAMES: u64 = 6;
    let speckle = Speckle::new(5, Speckle::RADIUS_PX);
    // Half the light: what is clipped is not turned.
    let dim = |image: Vec<f64>| image.into_iter().map(|g| 0.5 * g).collect::<Vec<_>>();
    let still = dim(speckle.deformed(|place| place));
    let moved = dim(speckle.deformed(|place| turned.source(place)));
    let settings = Settings { shape, ..Settings::default() };
    let mut subsets = grid(20);
    subsets.retain(|one| (one.x_px - CENTRE[0]).hypot(one.y_px - CENTRE[1]) < 170.0);
    let (mut workspace, mut errors) = (Workspace::default(), [Vec::new(), Vec::new()]);
    for frame in 0..N_FRAMES {
        let reference = sense(&still, noise, 100 + frame);
        let target = sense(&moved, noise, 200 + frame);
        let window = Window::new(Region::whole(SIZE[0], SIZE[1]), &target, settings.interpolation).unwrap();
        for (subset, prepared) in subsets.iter().zip(prepare(&reference, &subsets, &settings)) {
            let start = turned.place([subset.x_px, subset.y_px]);
            let Ok(found) = prepared.match_in(&window, start, &mut workspace) else { continue };
            let theta = found.position.theta_rad.unwrap();
            let error = theta.value - turned.degrees.to_radians();
            errors[0].push(error);
            errors[1].push(error / theta.sigma);
        }
    }
    errors
}

#[test]
fn the_angle_is_right_within_its_interval() {
    for (degrees, stretch, shape) in [
        (0.0, 0.0, Shape::Rigid),
        (0.0, 0.0, Shape::Affine),
        (3.0, 0.0, Shape::Rigid),
        (-5.0, 0.0, Shape::Affine),
        (4.0, 0.05, Shape::Affine),
        (2.0, 0.0, Shape::Quadratic),
    ] {
        for noise in [0.01, 0.03] {
            let [errors, pulls] = errors(Turned { degrees, stretch }, noise, shape);
            let [mean, std] = moments(&errors).map(|value| 1e3 * value);
            println!(
                "{degrees:4} degrees, stretched by {stretch}, {shape:10}, noise {noise}: {mean:+.3} +- {std:.3} mrad, {:?} % of {}",
                support::coverage(&pulls),
                pulls.len()
            );
            // Each reference is new, so that no two errors of a subset share one.
            assert_coverage(&format!("{degrees} degrees, {shape}, {noise}"), &pulls, 1, Wrong::Both);
        }
    }
}

/// A rigid subset follows any rotation, however large: what a field of them leaves is no strain of cos - 1.
#[test]
fn a_field_of_rigid_subsets_turns_by_any_angle() {
    let speckle = Speckle::new(5, Speckle::RADIUS_PX);
    let seen = |image: Vec<f64>, seed: u64| {
        sense(&image.into_iter().map(|g| 0.5 * g).collect::<Vec<_>>(), 0.02, seed)
    };
    let whole = Region::whole(SIZE[0], SIZE[1]);
    let settings = Settings::default();
    let grid = FieldGrid { step_px: 12, half_px: 16 };
    for degrees in [5.0, 30.0, 90.0, 170.0] {
        let turned = Turned { degrees, stretch: 0.0 };
        let reference = Reference::new(whole, seen(speckle.deformed(|place| place), 1), 1).unwrap();
        let target = seen(speckle.deformed(|place| turned.source(place)), 2);
        let window = Window::new(whole, &target, settings.interpolation).unwrap();
        let rigid = ShapeChoice::Named(Shape::Rigid);
        let field =
            correlate(&reference, &window, grid, &settings, rigid, NonZero::<usize>::MIN, &|_| ()).unwrap();
        let (mut n, mut n_held, mut farthest) = (0, 0, 0.0_f64);
        for point in &field.points {
            let Ok(found) = &point.found else { continue };
            let truth = turned.place([point.x_px, point.y_px]);
            for (at, truth) in [found.position.x_px, found.position.y_px].into_iter().zip(truth) {
                n += 1;
                n_held += usize::from((at.value - truth).abs() <= 1.96 * at.sigma);
                farthest = farthest.max((at.value - truth).abs());
            }
        }
        println!("{degrees} degrees: {n_held} of {n} hold, the farthest is {farthest:.3} px off");
        // Where the picture shows both, 600 points of some 1000, whose subsets share pixels: as many as 100 apart from each other, and four standard
        // deviations of their share are 0.09.
        assert!(n > 1000 && n_held as f64 > 0.86 * f64::from(n), "{degrees}: {n_held} of {n}");
        // Five standard deviations of some 0.02 px, at an edge twice that.
        assert!(farthest < 0.25, "{degrees}: {farthest}");
    }
}

/// Where the picture shows the reference smaller, several of its pixels share one pixel's noise.
#[test]
fn intervals_hold_where_the_picture_is_smaller() {
    let whole = Region::whole(SIZE[0], SIZE[1]);
    let settings = Settings::default();
    // Subsets that share no pixel.
    let grid = FieldGrid { step_px: 34, half_px: 16 };
    for scale in [0.5, 0.7, 1.0] {
        let (mut n, mut n_held) = (0, 0);
        for seed in 0..6 {
            let speckle = Speckle::new(50 + seed, Speckle::RADIUS_PX);
            let seen = |scale: f64, of: u64| {
                let image = speckle.deformed(|[x, y]| {
                    [CENTRE[0] + (x - CENTRE[0]) / scale, CENTRE[1] + (y - CENTRE[1]) / scale]
                });
                sense(&image.into_iter().map(|g| 0.5 * g).collect::<Vec<_>>(), 0.02, 2 * seed + of)
            };
            let reference = Reference::new(whole, seen(1.0, 0), 1).unwrap();
            let window = Window::new(whole, &seen(scale, 1), settings.interpolation).unwrap();
            let affine = ShapeChoice::Named(Shape::Affine);
            let field =
                correlate(&reference, &window, grid, &settings, affine, NonZero::<usize>::MIN, &|_| ());
            for point in &field.unwrap().points {
                let Ok(found) = &point.found else { continue };
                let at = [
                    (found.position.x_px, point.x_px, CENTRE[0]),
                    (found.position.y_px, point.y_px, CENTRE[1]),
                ];
                for (at, own, centre) in at {
                    n += 1;
                    n_held +=
                        usize::from((at.value - centre - scale * (own - centre)).abs() <= 1.96 * at.sigma);
                }
            }
        }
        println!("at {scale} of the length {n_held} of {n} hold");
        // Four standard deviations of a share of 95 % of a thousand are 2.8 %.
        assert!(n > 1000 && n_held as f64 > 0.922 * f64::from(n), "{scale}: {n_held} of {n}");
    }
}

#[test]
fn a_shift_is_no_rotation_and_tells_none() {
    let speckle = Speckle::new(5, Speckle::RADIUS_PX);
    let film = recorded((0..3).map(|frame| sense(&speckle.render(|p| p), 0.01, frame)).collect());
    let subsets = [subset(200.0, 200.0, 16)];
    for (shape, tells) in [(Shape::Translation, false), (Shape::Rigid, true), (Shape::Affine, true)] {
        let settings = Settings { shape, ..Settings::default() };
        let tracks = track(&film, &subsets, &ReferenceFrames::Single(0), &settings, &|_| ()).unwrap();
        for position in tracks[0].positions.iter().map(|position| position.unwrap()) {
            assert_eq!(position.theta_rad.is_some(), tells, "{shape}");
            // Sigma is that of an angle: the centre's over about half the subset's half width, 13.5 px for a square of 33 px.
            let expected = position.x_px.sigma.hypot(position.y_px.sigma) / 2_f64.sqrt() / 13.5;
            assert!(position.theta_rad.is_none_or(|theta| (theta.sigma / expected - 1.0).abs() < 0.3));
        }
    }
}

#[test]
fn a_body_that_turns_round_is_followed_through_its_renewals() {
    let speckle = Speckle::new(5, Speckle::RADIUS_PX);
    let turned = |frame: usize| Turned { degrees: 12.0 * frame as f64, stretch: 0.0 };
    let frame = |frame: usize| {
        let image = speckle.deformed(|place| turned(frame).source(place));
        sense(&image.into_iter().map(|g| 0.5 * g).collect::<Vec<_>>(), 0.01, frame as u64)
    };
    let film = recorded((0..20).map(frame).collect());
    let subsets = [subset(CENTRE[0], CENTRE[1], 16)];
    let settings = Settings { shape: Shape::Rigid, ..Settings::default() };
    let tracks = track(&film, &subsets, &ReferenceFrames::Single(0), &settings, &|_| ()).unwrap();
    for (frame, position) in tracks[0].positions.iter().enumerate() {
        let theta = position.unwrap().theta_rad.unwrap();
        let truth = turned(frame).degrees.to_radians();
        let off = (theta.value - truth + PI).rem_euclid(2.0 * PI) - PI;
        // Twenty readings: 4 sigma, which one in 800 films would exceed.
        assert!(
            off.abs() < 4.0 * theta.sigma && theta.sigma < 2e-3,
            "frame {frame}: {theta:?}, off by {off}"
        );
    }
}
