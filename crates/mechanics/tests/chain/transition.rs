//! Transition fronts: bodies on bistable beams, coupled by springs, against their closed relations, on every rung of the ladder.

use chainwave_mechanics::{
    Chain, Change, Drive, FarEnd, Integration, LinearLaw, Method, Schedule, TableLaw, simulate,
    simulate_with_sensitivities,
};

use crate::scenes::{MASS_KG, hec_chain, striker};

const N: usize = 60;
const SPRING_N_PER_M: f64 = 300.0;
const C_D_KG_PER_S: f64 = 0.1;
const FAR_WELL_M: f64 = 6e-3;

/// At rest where the body is, over a small barrier, and 6 mm on at rest again, lower in energy.
fn beam() -> TableLaw {
    let displacement_m = [-1e-3, 0.0, 0.8e-3, 1.6e-3, 3.6e-3, FAR_WELL_M, 7e-3];
    TableLaw::of_ground(&displacement_m, &[-0.3, 0.0, 0.15, 0.0, -0.6, 0.0, 0.6]).unwrap()
}

fn bistable(drive: Drive) -> Chain {
    Chain {
        ground_law: Some(beam()),
        contact: LinearLaw::new(SPRING_N_PER_M).unwrap().into(),
        ..hec_chain(N, C_D_KG_PER_S, drive)
    }
}

fn at_accuracy(chain: &Chain, method: Method, accuracy: f64) -> chainwave_mechanics::Simulation {
    let integration = Integration::Accuracy { method, accuracy };
    simulate(chain, &Schedule { integration, ..Schedule::automatic(0.09, 2e-5) }).unwrap()
}

/// When a body is half way from one well to the other, by the line between two outputs.
fn snaps_s(found: &chainwave_mechanics::Simulation, body: usize) -> f64 {
    let half_m = 0.5 * FAR_WELL_M;
    let (times_s, x_m) = (&found.trajectory.times_s, found.trajectory.displacement_m.row(body));
    let after = x_m.iter().position(|x| *x >= half_m).expect("the body snaps");
    let part = (half_m - x_m[after - 1]) / (x_m[after] - x_m[after - 1]);
    times_s[after - 1] + part * (times_s[after] - times_s[after - 1])
}

/// J. R. Raney et al. (PNAS 113 (2016) 9722): a front runs as fast whatever set it off, as each body brings the energy that the next needs. Far
/// from the ends nothing else changes, so what a body's dashpot takes while the front passes is what its beam gives.
#[test]
fn a_front_runs_alike_whatever_set_it_off_and_loses_what_the_beams_give() {
    let given_j = -beam().energy_j(FAR_WELL_M);
    let found = [1.5, 3.0].map(|v| at_accuracy(&bistable(striker(v, 0.2)), Method::Dop853, 1e-9));
    let speed = |found: &_| 10.0 / (snaps_s(found, 35) - snaps_s(found, 25));
    let [slow, fast] = found.each_ref().map(speed);
    // Between outputs the motion bends by less than 0.1 um, which it goes in 40 ns, of the 16 ms that ten bodies take.
    assert!((slow / fast - 1.0).abs() < 5e-6, "{slow} {fast} bodies a second");
    for found in &found {
        let trajectory = &found.trajectory;
        for body in [25, 30, 35] {
            let squares = trajectory.velocity_m_per_s.row(body).iter().map(|v| v * v).sum::<f64>();
            let lost_j = C_D_KG_PER_S * squares * (trajectory.times_s[1] - trajectory.times_s[0]);
            // Ringing behind the front falls as exp(-c t / 2 m), to 2 % within 35 ms: to 0.05 % in energy.
            assert!((lost_j / given_j - 1.0).abs() < 5e-4, "body {body}: {lost_j:e} J of {given_j:e} J");
        }
        // The books hold what the beams give.
        assert!(found.energy_drift < 1e-6, "{:e}", found.energy_drift);
    }
}

#[test]
fn every_rung_moves_it_alike() {
    let chain = bistable(striker(2.0, 0.2));
    let truth = at_accuracy(&chain, Method::Dop853, 1e-11);
    for method in Method::LADDER {
        let accuracy = if method == Method::SymplecticEuler { 1e-3 } else { 1e-6 };
        let found = at_accuracy(&chain, method, accuracy);
        let error = crate::scenes::relative_error(&found, &truth);
        assert!(error < accuracy, "{method}: {error:e}");
    }
}

/// A curve that is a straight line is a spring, up to rounding, on the way and in the books.
#[test]
fn a_straight_curve_is_a_spring() {
    let held = |ground_stiffness_n_per_m: Vec<f64>, ground_law: Option<TableLaw>| Chain {
        ground_stiffness_n_per_m,
        ground_law,
        far_end: FarEnd::Fixed,
        ..hec_chain(12, 0.003, striker(2.73, 0.2))
    };
    let line = TableLaw::of_ground(&[-0.1, 0.0, 0.1], &[-30.0, 0.0, 30.0]).unwrap();
    let schedule = Schedule::with_steps(0.01, 1e-4, Method::Rk4, 5e-6);
    let [by_curve, by_spring] = [held(Vec::new(), Some(line)), held(vec![300.0; 12], None)]
        .map(|chain| simulate(&chain, &schedule).unwrap());
    // Roundings of 2000 steps.
    assert!(crate::scenes::relative_error(&by_curve, &by_spring) < 1e-12);
    assert!((by_curve.energy_drift - by_spring.energy_drift).abs() < 1e-12);
}

/// Derivatives by the damper, a mass and the curve's force are those of simulations.
#[test]
fn derivatives_are_those_of_simulations() {
    let schedule = Schedule {
        integration: Integration::Automatic { accuracy: 1e-11 },
        ..Schedule::automatic(0.02, 1e-4)
    };
    let base = || bistable(striker(2.0, 0.2));
    let changed: [&dyn Fn(f64) -> Chain; 3] = [
        &|factor| Chain { damping_kg_per_s: vec![factor * C_D_KG_PER_S; N], ..base() },
        &|factor| Chain { mass_kg: vec![factor * MASS_KG; N], ..base() },
        &|factor| Chain { ground_law: Some(beam().times(factor)), ..base() },
    ];
    for of_factor in changed {
        let change = |step: f64| Change {
            below: of_factor(1.0 - step),
            above: of_factor(1.0 + step),
            width: 2.0 * step,
        };
        let found = simulate_with_sensitivities(&base(), &schedule, &[change(1e-4)]).unwrap();
        let slope = |step: f64| {
            let Change { below, above, width } = change(step);
            let [low, high] = [below, above].map(|side| simulate(&side, &schedule).unwrap().trajectory);
            (&high.displacement_m - &low.displacement_m) / width
        };
        // Richardson's extrapolation leaves the fourth power of the step.
        let (coarse, fine) = (slope(2e-3), slope(1e-3));
        let expected = (4.0 * &fine - &coarse) / 3.0;
        let largest = expected.fold(0.0_f64, |largest, value| largest.max(value.abs()));
        let error = (&found.derivatives[0].displacement_m - &expected)
            .fold(0.0_f64, |largest, value| largest.max(value.abs()));
        // The curve's slope has kinks at its points, where the variational equations' steps lose orders.
        assert!(error < 1e-4 * largest, "{error:e} of {largest:e}");
    }
}

#[test]
fn points_that_hold_no_body_are_refused_by_name() {
    let said = TableLaw::of_ground(&[-1.0, 0.0, 1.0], &[1.0, 0.0, -1.0]).unwrap_err().to_string();
    assert!(said.starts_with("stiffness of the ground table at zero displacement"), "{said}");
}
