//! Explicit against implicit: accuracy over the step, and what a step costs.

use chainwave_mechanics::{ImposedMotion, RingChain, RingDrive, RingSchedule, simulate_rings};

use crate::implicit::Implicit;
use crate::scenes::{chain, schedule};

const DURATION_S: f64 = 8e-3;

/// A push of 2 mm in 1 ms, smooth, so that what differs are the schemes and not how they take a jump.
fn push() -> ImposedMotion {
    let place_m = |t: f64| 1e-3 * (1.0 + ((t - 2e-3) / 0.3e-3).tanh());
    let times_s: Vec<f64> = (0..=4000).map(|i| DURATION_S * f64::from(i) / 4000.0).collect();
    let x_m = times_s.iter().map(|&t| place_m(t) - place_m(0.0)).collect();
    ImposedMotion::from_samples(times_s, x_m).unwrap()
}

fn pushed() -> RingChain {
    RingChain { drive: RingDrive::Imposed(push()), ..chain(8, 16, 1.0) }
}

fn explicit_m(dt_s: Option<f64>) -> (Vec<f64>, u64) {
    let schedule = RingSchedule { dt_s, output_interval_s: DURATION_S, ..schedule(DURATION_S) };
    let simulation = simulate_rings(&pushed(), &schedule).unwrap();
    (simulation.trajectory.displacement_m.column(1).to_vec(), simulation.steps)
}

fn implicit(n_steps: usize) -> Implicit {
    let mut scheme = Implicit::new(&pushed()).unwrap();
    scheme.run(&push(), DURATION_S, n_steps);
    scheme
}

fn error(found_m: &[f64], exact_m: &[f64]) -> f64 {
    let largest = exact_m.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    found_m.iter().zip(exact_m).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max) / largest
}

#[test]
fn the_implicit_scheme_is_of_second_order_and_agrees() {
    let exact_m = explicit_m(Some(1e-7)).0;
    let [coarse, fine] = [400, 800].map(|n| error(&implicit(n).joints_m(), &exact_m));
    let order = (coarse / fine).log2();
    assert!((order - 2.0).abs() < 0.3, "order {order}");
    assert!(fine < 5e-4, "{fine}");
}

#[test]
fn the_implicit_scheme_keeps_the_energy() {
    let mut scheme = implicit(200);
    let before_j = scheme.energy_j();
    // The push is over, and the first joint stays where it is.
    let place_m = scheme.joints_m()[0];
    for _ in 0..100 {
        scheme.step(4e-5, place_m);
    }
    // Newton's method stops at 1e-10 of the displacements, in each of 100 steps.
    assert!((scheme.energy_j() / before_j - 1.0).abs() < 1e-7, "{} {before_j}", scheme.energy_j());
}

/// For an error of 0.5 % the implicit scheme takes 200 steps of 4 to 5 factorisations each; velocity Verlet, at its stability
/// bound, 2811 steps, and errs 600 times less. A factorisation would have to be as cheap as three explicit steps; but it alone
/// takes the operations of two, its tangent those of three more, and neither goes in vectors as well.
#[test]
fn equal_accuracy_takes_more_factorisations_than_pay() {
    let exact_m = explicit_m(Some(1e-7)).0;
    let (explicit_m, explicit_steps) = explicit_m(None);
    let scheme = implicit(200);
    let errors = [error(&explicit_m, &exact_m), error(&scheme.joints_m(), &exact_m)];
    assert!(errors[0] < 2e-5 && errors[1] > 2e-3, "{errors:?}");
    let steps_per_factorisation = explicit_steps as f64 / (scheme.factorisations as f64 / 8.0);
    assert!(steps_per_factorisation < 4.0, "{steps_per_factorisation}");
}
