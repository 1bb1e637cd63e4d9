//! Every integrator against a solution of 24 digits, its order, its invariants, and closed forms.

use std::{f64::consts::PI, num::NonZero};

use chainwave_mechanics::{
    Bodies, Chain, Contact, Drive, FarEnd, Integration, Law, LinearLaw, MechanicsError, Method, PowerLaw,
    Schedule, Simulation, TableLaw, Tension, ensemble, scan, simulate,
};
use ndarray::Axis;

use crate::scenes::{MASS_KG, hec_chain, relative_error, striker};

fn with_steps(chain: &Chain, duration_s: f64, method: Method, dt_s: f64) -> Simulation {
    let schedule = Schedule::with_steps(duration_s, 1e-3, method, dt_s);
    simulate(chain, &Schedule { bodies: Bodies::All, ..schedule }).unwrap()
}

fn to_accuracy(chain: &Chain, duration_s: f64, method: Method, accuracy: f64) -> Simulation {
    let integration = Integration::Accuracy { method, accuracy };
    simulate(chain, &Schedule { integration, ..Schedule::automatic(duration_s, 1e-3) }).unwrap()
}

/// Displacements and velocities of the striker and five damped bodies after 2 ms to 24 digits: extrapolation of the midpoint
/// rule (Gragg, Bulirsch and Stoer) to order 22 in arithmetic of 34 digits.
const REFERENCE: &str = include_str!("../chain_reference.csv");

#[test]
fn every_rung_meets_a_solution_of_24_digits() {
    let truth: Vec<[f64; 2]> = REFERENCE
        .lines()
        .skip(1)
        .map(|line| {
            let mut numbers = line.split(',').skip(1).map(|number| number.parse().unwrap());
            std::array::from_fn(|_| numbers.next().unwrap())
        })
        .collect();
    let chain = hec_chain(5, 0.003, striker(2.73, 0.2));
    let error = |simulation: &Simulation| {
        let striker = simulation.striker.as_ref().unwrap();
        let mut largest = (striker.displacement_m[2] - truth[0][0]).abs();
        for (body, [x_m, v_m_per_s]) in truth[1..].iter().enumerate() {
            let trajectory = &simulation.trajectory;
            largest = largest.max((trajectory.displacement_m[[body, 2]] - x_m).abs());
            largest = largest.max((trajectory.velocity_m_per_s[[body, 2]] - v_m_per_s).abs() / 1e3);
        }
        largest / truth[0][0]
    };
    // Each step rounds displacements and velocities by a unit in the last place: in its sums, and at its end; all of them one way.
    let finest = to_accuracy(&chain, 0.002, Method::Dop853, 1e-12);
    assert!(error(&finest) < finest.steps as f64 * 2.0 * f64::EPSILON, "{:e}", error(&finest));
    assert!(error(&simulate(&chain, &Schedule::automatic(0.002, 1e-3)).unwrap()) < Schedule::ACCURACY);
    // A velocity in mm/s errs by more than a displacement in metres, by the fastest oscillation over 1000 rad/s.
    let omega_ms = 2e-3 * (PowerLaw::ELLIPTICAL_RING.k_0_n_per_m() / MASS_KG).sqrt();
    for method in Method::LADDER {
        let accuracy = if method == Method::SymplecticEuler { 1e-3 } else { 1e-6 };
        let found = to_accuracy(&chain, 0.002, method, accuracy);
        assert!(error(&found) < omega_ms * accuracy, "{method}: {:e}", error(&found));
        assert!(found.error_estimate.unwrap() <= accuracy);
    }
}

/// The striker touches throughout, so that the motion is smooth. Velocities are compared: symplectic Euler is Verlet seen half
/// a kick apart, so from rest its displacements are of second order.
#[test]
fn every_rung_has_its_order() {
    for chain in [hec_chain(26, 0.003, striker(2.73, 0.2)), hec_chain(26, 0.0, striker(2.73, 0.0))] {
        let truth = with_steps(&chain, 0.008, Method::Dop853, 1e-5).trajectory.velocity_m_per_s;
        for method in Method::LADDER {
            let error = |dt_s: f64| {
                let found = with_steps(&chain, 0.008, method, dt_s).trajectory.velocity_m_per_s;
                (found - &truth).iter().fold(0.0_f64, |largest, v| largest.max(v.abs()))
            };
            // Small enough for the leading term, large enough to stand above rounding.
            let dt_s = match method.order() {
                8 => 2.5e-4,
                6 => 2e-4,
                4 => 4e-5,
                _ => 2e-5,
            };
            let order = (error(dt_s) / error(0.5 * dt_s)).log2();
            assert!((order - f64::from(method.order())).abs() < 0.1, "{method}: {order}");
        }
    }
}

/// Forwards, velocities turned, forwards again: an undamped symmetric composition comes back to where it began up to rounding,
/// at any step; RK4 does not.
#[test]
fn symmetric_compositions_can_be_reversed() {
    let start = Drive::Free {
        displacement_m: (0..20).map(|i| 1e-4 * (f64::from(i) * 0.7).sin()).collect(),
        velocity_m_per_s: (0..20).map(|i| 0.3 * (f64::from(i) * 0.4).cos()).collect(),
    };
    let chain = Chain { far_end: FarEnd::Fixed, ..hec_chain(20, 0.0, start.clone()) };
    let returned = |method: Method| {
        let there = with_steps(&chain, 0.01, method, 1e-4).trajectory;
        let last = there.times_s.len() - 1;
        let drive = Drive::Free {
            displacement_m: there.displacement_m.column(last).to_vec(),
            velocity_m_per_s: there.velocity_m_per_s.column(last).mapv(|v| -v).to_vec(),
        };
        let back = with_steps(&Chain { drive, ..chain.clone() }, 0.01, method, 1e-4).trajectory;
        let Drive::Free { displacement_m, .. } = &start else { panic!("the chain was let go") };
        let ends = back.displacement_m.column(last).to_vec();
        ends.iter().zip(displacement_m).fold(0.0_f64, |largest, (x, y)| largest.max((x - y).abs()))
    };
    for method in [Method::Verlet, Method::Symplectic4, Method::Symplectic6] {
        // Displacements of 1 mm, in 200 steps of up to 11 drifts and 10 kicks, are rounded by 1e-19 m each, all one way.
        assert!(returned(method) < 1e-15, "{method}: {:e}", returned(method));
    }
    assert!(returned(Method::Rk4) > 1e-9);
}

/// Every rung adds what it takes from one body to its neighbour.
#[test]
fn every_rung_keeps_the_momentum() {
    let chain = hec_chain(26, 0.0, striker(2.73, 0.2));
    for method in Method::LADDER {
        let found = with_steps(&chain, 0.02, method, 2e-5);
        let momenta = found.trajectory.velocity_m_per_s.sum_axis(Axis(0)) * MASS_KG;
        let of_striker = found.striker.unwrap().velocity_m_per_s;
        for (momentum, v) in momenta.iter().zip(of_striker) {
            // Implicit stages are solved to 1e-13, in 1000 steps.
            let change = (momentum + 4.3e-3 * v) / (4.3e-3 * 2.73) - 1.0;
            assert!(change.abs() < 1e-10, "{method}: {change:e}");
        }
    }
}

/// A change of the striker's velocity by one unit in the last place, and the roundings of all steps, grow by no more than the 200 that
/// the control of the steps leaves room for.
#[test]
fn rounding_does_not_grow() {
    let end = |v: f64| {
        let chain = hec_chain(100, 0.0, striker(v, 0.0));
        simulate(&chain, &Schedule::automatic(0.1, 1e-3)).unwrap()
    };
    let (one, other) = (end(2.73), end(2.73_f64.next_up()));
    assert!(relative_error(&one, &other) < 200.0 * one.steps as f64 * f64::EPSILON);
}

#[test]
fn bodies_ahead_of_the_front_may_be_left_out() {
    let chain = hec_chain(300, 0.003, striker(2.73, 0.2));
    for (method, dt_s) in [(Method::Rk4, 4e-5), (Method::Verlet, 4e-5), (Method::Dop853, 2e-4)] {
        let all = with_steps(&chain, 0.1, method, dt_s);
        let reached = simulate(&chain, &Schedule::with_steps(0.1, 1e-3, method, dt_s)).unwrap();
        assert!(relative_error(&reached, &all) < 1e-13, "{method}");
        // The wave takes 150 ms down the chain, so on average a third of it is ahead for 100 ms.
        assert!(reached.force_evaluations < all.force_evaluations * 3 / 4, "{method}");
    }
    let schedule = Schedule::automatic(0.1, 1e-3);
    let all = simulate(&chain, &Schedule { bodies: Bodies::All, ..schedule }).unwrap();
    // Bodies enter before they move by 1e-12 of the largest displacement.
    assert!(relative_error(&simulate(&chain, &schedule).unwrap(), &all) < 1e-10);
}

#[test]
fn interpolated_outputs_are_as_good_as_steps_that_stop() {
    let chain = hec_chain(26, 0.003, striker(2.73, 0.2));
    let fine = simulate(&chain, &Schedule::automatic(0.02, 1e-5)).unwrap();
    let stopped = simulate(&chain, &Schedule::with_steps(0.02, 1e-5, Method::Dop853, 1e-5)).unwrap();
    assert!(fine.steps < 200, "{}", fine.steps);
    assert!(relative_error(&fine, &stopped) < 1e-8);
    let speed = fine.trajectory.velocity_m_per_s - &stopped.trajectory.velocity_m_per_s;
    assert!(speed.iter().all(|v| v.abs() < 1e-6 * 2.73));
}

/// Overdamped by a million times: esdirk4 takes the place of dop853, and its steps follow the slow motion.
#[test]
fn strong_damping_does_not_force_small_steps() {
    let chain = Chain {
        contact: LinearLaw::new(1474.0).unwrap().into(),
        far_end: FarEnd::Fixed,
        ..hec_chain(
            1,
            1e6 * 2.0 * (1474.0 * MASS_KG).sqrt(),
            Drive::Free { displacement_m: vec![1e-3], velocity_m_per_s: vec![0.0] },
        )
    };
    let slow_s = chain.damping_kg_per_s[0] / 1474.0;
    let found = simulate(&chain, &Schedule::automatic(2.0 * slow_s, 0.5 * slow_s)).unwrap();
    assert_eq!(found.method, "esdirk4");
    assert!(found.steps < 2000, "{}", found.steps);
    for (k, x_m) in found.trajectory.displacement_m.row(0).iter().enumerate() {
        // The fast decay is over after 1e-12 of the slow one.
        assert!((x_m / 1e-3 - (-0.5 * k as f64).exp()).abs() < 1e-8);
    }
}

/// Two free bodies with a spring and a dashpot between them: the relative motion is a damped oscillator.
#[test]
fn dashpots_between_neighbours_damp_the_relative_motion() {
    let (k, c, x_0) = (1474.0_f64, 0.1_f64, 1e-4_f64);
    let law = Law::Linear(LinearLaw::new(k).unwrap());
    let contact = Contact { damping_kg_per_s: c, ..Contact::from(law) };
    let drive = Drive::Free { displacement_m: vec![x_0, -x_0], velocity_m_per_s: vec![0.0; 2] };
    let chain = Chain { contact: contact.into(), ..hec_chain(2, 0.0, drive) };
    let beta = c / MASS_KG;
    let omega = (2.0 * k / MASS_KG - beta * beta).sqrt();
    for method in [Method::Rk4, Method::Dop853, Method::Esdirk4] {
        let found = to_accuracy(&chain, 0.01, method, 1e-8);
        for (t, x_m) in found.trajectory.times_s.iter().zip(found.trajectory.displacement_m.row(0)) {
            let x = (-beta * t).exp() * ((omega * t).cos() + beta / omega * (omega * t).sin());
            assert!((x_m / x_0 - x).abs() < 1e-7, "{method} {t}: {x_m} {x}");
        }
        assert!(found.energy_drift < 1e-7, "{method}: {:e}", found.energy_drift);
    }
    let integration = Integration::Accuracy { method: Method::Verlet, accuracy: 1e-3 };
    let refused = simulate(&chain, &Schedule { integration, ..Schedule::automatic(0.01, 1e-3) });
    assert!(matches!(refused, Err(MechanicsError::NotFor { method: "verlet", .. })));
}

/// Bodies that only touch: a dashpot acts while its contact is closed. Of two that meet, the overlap is half a swing of a damped
/// oscillator; a third one, at a distance, is met by what is left, and all fly on as they then are.
#[test]
fn dashpots_act_while_their_contact_is_closed() {
    let (k, c, v_0, distance_m) = (1474.0_f64, 0.4_f64, 0.1_f64, 1e-3_f64);
    let law = Law::Linear(LinearLaw::new(k).unwrap());
    let contact = Contact { law, tension: Tension::Detach, damping_kg_per_s: c };
    let drive =
        Drive::Free { displacement_m: vec![0.0, 0.0, distance_m], velocity_m_per_s: vec![v_0, 0.0, 0.0] };
    let chain = Chain { contact: contact.into(), ..hec_chain(3, 0.0, drive) };
    let beta = c / MASS_KG;
    let omega = (2.0 * k / MASS_KG - beta * beta).sqrt();
    let ends_s = PI / omega;
    let restitution = (-beta * ends_s).exp();
    assert!(restitution > 0.1 && restitution < 0.9, "{restitution}");
    let slowed = 0.5 * (1.0 - restitution);
    let pushed = 0.5 * (1.0 + restitution);
    // The second body meets the third when the first contact has long ended, and is met by the first one again much later.
    let meets_s = distance_m / (pushed * v_0);
    assert!(meets_s > ends_s + 1e-3, "{meets_s} {ends_s}");
    let expected = [slowed, pushed * slowed, pushed * pushed].map(|part| part * v_0);
    // Constant steps meet a jump of the force at first order only.
    for (method, accuracy) in [(Method::Rk4, 1e-5), (Method::Dop853, 1e-8), (Method::Esdirk4, 1e-8)] {
        let found = to_accuracy(&chain, 0.02, method, accuracy);
        for (body, expected) in expected.into_iter().enumerate() {
            let velocities = found.trajectory.velocity_m_per_s.row(body);
            let times = found.trajectory.times_s.iter().zip(velocities);
            for (_, v) in times.filter(|(t, _)| **t > meets_s + ends_s + 1e-4 && **t < 0.019) {
                assert!(
                    (v - expected).abs() < 10.0 * accuracy * v_0,
                    "{method}, body {}: {v} {expected}",
                    body + 1
                );
            }
        }
        assert!(found.energy_drift < 10.0 * accuracy, "{method}: {:e}", found.energy_drift);
    }
}

/// A power law of exponent 1 is linear, but where it detaches: springs that hold in tension do not stand for it.
#[test]
fn a_linear_law_that_detaches_is_none_that_holds() {
    let law = Law::Power(PowerLaw::new(1474.0, 1e-4, 1.0).unwrap());
    let contact = Contact { tension: Tension::Detach, ..Contact::from(law) };
    let chain = Chain { contact: contact.into(), ..hec_chain(10, 0.003, striker(2.73, 0.2)) };
    let integration = Integration::Automatic { accuracy: 1e-6 };
    let found = simulate(&chain, &Schedule { integration, ..Schedule::automatic(0.02, 1e-3) }).unwrap();
    assert!(found.tension_events > 0, "{}", found.choice);
    let truth = to_accuracy(&chain, 0.02, Method::Dop853, 1e-9);
    assert!(relative_error(&found, &truth) < 1e-5, "{}", found.choice);
}

/// Alternating masses m and M on equal springs: omega^2 = k (1/m + 1/M) +- k sqrt((1/m + 1/M)^2 - 4 sin^2(kappa) / (m M)). At
/// kappa = pi/2 the light bodies move alone, every other one against the rest, with omega^2 = 2 k / m.
#[test]
fn alternating_chains_have_their_optical_band() {
    let (k, heavy) = (PowerLaw::ELLIPTICAL_RING.k_0_n_per_m(), 3.0 * MASS_KG);
    let masses: Vec<f64> = (0..12).map(|i| if i % 2 == 0 { MASS_KG } else { heavy }).collect();
    let pattern = [1.0, 0.0, -1.0, 0.0];
    let drive = Drive::Free {
        displacement_m: (0..12).map(|i| 1e-13 * pattern[i % 4]).collect(),
        velocity_m_per_s: vec![0.0; 12],
    };
    let chain = Chain { mass_kg: masses, far_end: FarEnd::Fixed, ..hec_chain(12, 0.0, drive) };
    // The first body lacks its left spring. Within 1 ms that is felt two bodies on, and hardly by the seventh.
    let found = with_steps(&chain, 0.001, Method::Rk4, 1e-6);
    let omega = (2.0 * k / MASS_KG).sqrt();
    let x = &found.trajectory.displacement_m;
    assert!((x[[6, 1]] / x[[6, 0]] - (omega * 0.001).cos()).abs() < 1e-4);
}

/// Gaps of every kind of law in one chain; the same chain with all laws given as the power law's own table agrees.
#[test]
fn laws_may_differ_from_gap_to_gap() {
    let law = PowerLaw::ELLIPTICAL_RING;
    let overlaps: Vec<f64> = (-200..2000).map(|i| 1e-5 * f64::from(i)).collect();
    let forces: Vec<f64> = overlaps.iter().map(|&x| law.force_n(x)).collect();
    let table = Contact::from(Law::Table(TableLaw::new(&overlaps, &forces).unwrap()));
    let power = Contact::from(Law::Power(law));
    let mixed: Vec<Contact> =
        (0..25).map(|gap| if gap % 3 == 0 { table.clone() } else { power.clone() }).collect();
    let uniform = hec_chain(26, 0.003, striker(2.73, 0.2));
    let varied = Chain { contact: chainwave_mechanics::Contacts::Each(mixed), ..uniform.clone() };
    let schedule = Schedule::automatic(0.02, 1e-3);
    let (one, other) = (simulate(&uniform, &schedule).unwrap(), simulate(&varied, &schedule).unwrap());
    // The table's points lie 0.01 mm apart; its error falls with the third power of that.
    assert!(relative_error(&other, &one) < 1e-5);
    let stiffer = Contact::from(Law::Linear(LinearLaw::new(3000.0).unwrap()));
    let mut contacts = vec![power; 25];
    contacts[12] = stiffer;
    let defect = Chain { contact: chainwave_mechanics::Contacts::Each(contacts), ..uniform };
    let found = simulate(&defect, &schedule).unwrap();
    assert!(found.energy_drift < 1e-8, "{:e}", found.energy_drift);
    let check = to_accuracy(&defect, 0.02, Method::Symplectic6, 1e-8);
    assert!(relative_error(&found, &check) < 1e-6);
}

#[test]
fn a_scan_is_the_same_on_any_number_of_threads() {
    let chain = hec_chain(26, 0.003, striker(1.0, 0.2));
    let velocities: Vec<f64> = (1..20).map(|i| 0.2 * f64::from(i)).collect();
    let schedule = Schedule::automatic(0.02, 0.02);
    let threads = |n: usize| NonZero::new(n).unwrap();
    let on = |n_threads: usize| scan(&chain, &velocities, &schedule, threads(n_threads)).unwrap();
    let one = on(1);
    assert_eq!(one, on(3));
    let alone = simulate(&hec_chain(26, 0.003, striker(velocities[7], 0.2)), &schedule).unwrap();
    assert_eq!(one[7].as_ref().unwrap(), &alone);
    let chains: Vec<Chain> = velocities.iter().map(|v| hec_chain(26, 0.003, striker(*v, 0.2))).collect();
    assert_eq!(ensemble(&chains, &schedule, threads(2), |_, simulation| simulation), one);
    let c_g: Vec<f64> =
        one.iter().map(|member| member.as_ref().unwrap().group_velocity_m_per_s(0.03).unwrap()).collect();
    assert!(c_g.windows(2).all(|pair| pair[1] < pair[0]) && c_g[0] < 54.0, "{c_g:?}");
    let free = Drive::Free { displacement_m: vec![0.0; 26], velocity_m_per_s: vec![0.0; 26] };
    assert!(scan(&Chain { drive: free, ..chain.clone() }, &velocities, &schedule, threads(1)).is_err());
}

#[test]
fn weak_strikes_are_integrated_with_linear_springs() {
    let weak = simulate(&hec_chain(26, 0.0, striker(1e-9, 0.0)), &Schedule::automatic(0.02, 1e-3)).unwrap();
    assert!(weak.choice.contains("linear springs"), "{}", weak.choice);
    let with_law = to_accuracy(&hec_chain(26, 0.0, striker(1e-9, 0.0)), 0.02, Method::Dop853, 1e-9);
    assert!(relative_error(&weak, &with_law) < weak.error_estimate.unwrap());
    let strong = simulate(&hec_chain(26, 0.0, striker(1e-3, 0.0)), &Schedule::automatic(0.02, 1e-3)).unwrap();
    assert!(!strong.choice.contains("linear springs"));
}
