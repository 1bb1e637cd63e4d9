//! Shape functions on deformations of known truth: the image of a deformed plane is sampled from the speckle's formula.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test fails by panicking, and shows what it measured"
)]

mod support;

use chainwave_correlation::{Interpolation, Settings, Shape, Window, Workspace};
use chainwave_measurement::Region;
use support::{SIZE, Speckle, grid, moments, prepare, sense};

const CENTRE: [f64; 2] = [210.0, 210.0];

/// A displacement of the plane: `deform(x)` where the point x of the reference is seen, found by its inverse.
struct Deformation {
    gradient: [f64; 4],
    curvature: [f64; 6],
}

impl Deformation {
    fn affine(gradient: [f64; 4]) -> Self {
        Self { gradient, curvature: [0.0; 6] }
    }

    fn rotation(degrees: f64) -> Self {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Self::affine([cos - 1.0, -sin, sin, cos - 1.0])
    }

    fn apply(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let ([ux, uy, vx, vy], [uxx, uxy, uyy, vxx, vxy, vyy]) = (self.gradient, self.curvature);
        let (dx, dy) = (x - CENTRE[0], y - CENTRE[1]);
        [
            x + 0.3 + ux * dx + uy * dy + uxx * dx * dx + uxy * dx * dy + uyy * dy * dy,
            y - 0.2 + vx * dx + vy * dy + vxx * dx * dx + vxy * dx * dy + vyy * dy * dy,
        ]
    }

    /// The point of the reference that is seen at a place, by fixed-point iteration on the affine inverse.
    fn source(&self, place: [f64; 2]) -> [f64; 2] {
        let [ux, uy, vx, vy] = self.gradient;
        let determinant = (1.0 + ux) * (1.0 + vy) - uy * vx;
        let mut point = place;
        for _ in 0..60 {
            let there = self.apply(point);
            let [dx, dy] = [place[0] - there[0], place[1] - there[1]];
            point[0] += ((1.0 + vy) * dx - uy * dy) / determinant;
            point[1] += ((1.0 + ux) * dy - vx * dx) / determinant;
        }
        point
    }
}

/// Standard deviation of the errors in x without noise, in mpx, and how many subsets there were; none may be lost.
fn std_mpx(deformation: &Deformation, shape: Shape, reach_px: f64) -> (f64, usize) {
    let speckle = Speckle::new(21, Speckle::RADIUS_PX);
    // Half the light, so that no pixel is saturated: what is clipped is not what the shape function describes.
    let dim = |image: Vec<f64>| image.into_iter().map(|g| 0.5 * g).collect::<Vec<_>>();
    let reference = sense(&dim(speckle.deformed(|place| place)), 0.0, 0);
    let target = sense(&dim(speckle.deformed(|place| deformation.source(place))), 0.0, 0);
    let interpolation = Interpolation::QuinticMoms;
    let settings = Settings { shape, interpolation, convergence_px: 1e-4, ..Settings::default() };
    let window = Window::new(Region::whole(SIZE[0], SIZE[1]), &target, interpolation).unwrap();
    let mut subsets = grid(20);
    subsets.retain(|s| (s.x_px - CENTRE[0]).abs() < reach_px && (s.y_px - CENTRE[1]).abs() < reach_px);
    let mut workspace = Workspace::default();
    let mut errors = Vec::new();
    for (subset, prepared) in subsets.iter().zip(prepare(&reference, &subsets, &settings)) {
        let truth = deformation.apply([subset.x_px, subset.y_px]);
        let found = prepared.match_in(&window, truth.map(f64::round), &mut workspace);
        let position = found.unwrap_or_else(|lost| panic!("{}: {lost:?}", subset.name)).position;
        errors.push(position.x_px.value - truth[0]);
    }
    (1e3 * moments(&errors)[1], errors.len())
}

#[test]
fn each_shape_function_follows_what_it_describes() {
    // Rounding to counts is noise of 0.29 counts; half the light makes its floor 0.07 mpx, twice that where a curvature is found as
    // well. As much again is left to interpolation.
    let curvature = [2e-4, -1e-4, 1e-4, -1e-4, 2e-4, 1e-4];
    let quadratic = Deformation { gradient: [0.01, 0.0, 0.0, -0.01], curvature };
    for (name, deformation, shape, limit_mpx) in [
        ("strain 0.5 %", Deformation::affine([0.005, 0.0, 0.0, 0.0]), Shape::Affine, 0.15),
        ("strain 2 %", Deformation::affine([0.02, 0.0, 0.0, 0.0]), Shape::Affine, 0.15),
        ("strain 5 %", Deformation::affine([0.05, 0.0, 0.0, 0.0]), Shape::Affine, 0.15),
        ("strain -20 %", Deformation::affine([-0.2, 0.0, 0.0, 0.0]), Shape::Affine, 0.15),
        ("strain 20 %", Deformation::affine([0.2, 0.0, 0.0, 0.0]), Shape::Affine, 0.15),
        ("rotation 2", Deformation::rotation(2.0), Shape::Affine, 0.15),
        ("rotation 2", Deformation::rotation(2.0), Shape::Rigid, 0.15),
        ("curved", quadratic, Shape::Quadratic, 0.3),
    ] {
        let (std, n) = std_mpx(&deformation, shape, 100.0);
        println!("{name:14} {shape:12} {std:.3} mpx over {n} subsets");
        assert!(std < limit_mpx, "{name}, {shape}: {std} mpx");
    }
}
