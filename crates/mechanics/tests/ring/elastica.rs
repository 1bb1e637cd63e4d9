//! The inextensible ring between two poles, by integrating the elastica's equations: an independent truth for the element.

use std::f64::consts::{FRAC_PI_2, PI};

/// Semi-axes of the HEC's centreline, and its bending stiffness.
const SEMI_AXES_M: (f64, f64) = (14.8e-3, 8.8e-3);
const BENDING_NM2: f64 = 2.888e9 * 12e-3 * 0.4e-3 * 0.4e-3 * 0.4e-3 / 12.0;
/// Runge-Kutta steps along a quarter of the ring; the error is then below 1e-10.
const STEPS: usize = 400;

/// Where a quarter of the ring ends that starts at the loaded pole: excess of its angle over a right angle, and its length
/// along the load. theta' = kappa_0 + (M_pole + F y / 2) / EI.
fn quarter(force_n: f64, pole_moment_nm: f64) -> (f64, f64) {
    let (major, minor) = SEMI_AXES_M;
    let rates = |phi: f64, [theta, _, y]: [f64; 3]| {
        let speed = (major * phi.sin()).hypot(minor * phi.cos());
        let curvature = major * minor / speed.powi(3) + (pole_moment_nm + 0.5 * force_n * y) / BENDING_NM2;
        [curvature * speed, theta.cos() * speed, theta.sin() * speed]
    };
    let h = FRAC_PI_2 / STEPS as f64;
    let mut state = [FRAC_PI_2, 0.0, 0.0];
    for step in 0..STEPS {
        let phi = h * step as f64;
        let moved = |rate: [f64; 3], by: f64| std::array::from_fn(|k| state[k] + by * rate[k]);
        let first = rates(phi, state);
        let second = rates(phi + 0.5 * h, moved(first, 0.5 * h));
        let third = rates(phi + 0.5 * h, moved(second, 0.5 * h));
        let fourth = rates(phi + h, moved(third, h));
        state = std::array::from_fn(|k| {
            state[k] + h / 6.0 * (first[k] + 2.0 * second[k] + 2.0 * third[k] + fourth[k])
        });
    }
    (state[0] - PI, -state[1])
}

/// Overlap under a force: the pole's moment follows from its fixed direction, by secants.
pub(crate) fn overlap_m(force_n: f64) -> f64 {
    let scale_nm = force_n * SEMI_AXES_M.1;
    let (mut before, mut now) = (0.0, -0.25 * scale_nm);
    let mut angle_before = quarter(force_n, before).0;
    for _ in 0..40 {
        let angle = quarter(force_n, now).0;
        if angle.abs() < 1e-14 || (now - before).abs() < 1e-16 * scale_nm {
            break;
        }
        (before, now) = (now, now - angle * (now - before) / (angle - angle_before));
        angle_before = angle;
    }
    2.0 * (SEMI_AXES_M.0 - quarter(force_n, now).1)
}
