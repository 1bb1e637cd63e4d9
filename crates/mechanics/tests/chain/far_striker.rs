//! A striker at the far end: mirror images, conservation, a plain integration written here, order, sensitivities, refusals.

use chainwave_mechanics::{
    Bodies, Chain, Change, Contact, Drive, FarEnd, FarStriker, Integration, Law, LinearLaw, MechanicsError,
    Method, Schedule, Simulation, Striker, simulate, simulate_with_sensitivities,
};
use ndarray::{Array2, Axis, s};

use crate::convergence::{assert_order_four, orders};
use crate::scenes::{MASS_KG, STRIKER_KG, hec_chain, relative_error, rk4_energy_loss, run, striker};

fn far_end(velocity_m_per_s: f64, damping_kg_per_s: f64, distance_m: f64) -> FarEnd {
    let striker =
        Striker { mass_kg: STRIKER_KG, velocity_m_per_s, damping_kg_per_s, ground_damping_kg_per_s: 0.0 };
    FarEnd::Struck(FarStriker { striker, distance_m, contact: None })
}

/// A chain of the experiment's bodies that is struck at both ends.
fn struck_twice(n: usize, c_d: f64, [near, far]: [Drive; 2], distance_m: f64) -> Chain {
    let Drive::Striker(striker) = far else { panic!("expected a striker") };
    let far_end = FarEnd::Struck(FarStriker { striker, distance_m, contact: None });
    Chain { far_end, ..hec_chain(n, c_d, near) }
}

fn at_rest(n: usize) -> Drive {
    Drive::Free { displacement_m: vec![0.0; n], velocity_m_per_s: vec![0.0; n] }
}

fn all_bodies(duration_s: f64, integration: Integration) -> Schedule {
    Schedule { integration, bodies: Bodies::All, ..Schedule::automatic(duration_s, 1e-4) }
}

/// Largest x_n + x_{N+1-n} over the largest displacement.
fn asymmetry(displacement_m: &Array2<f64>, mirrored_m: &Array2<f64>) -> f64 {
    let largest = displacement_m.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    let sum = displacement_m + &mirrored_m.slice(s![..;-1, ..]);
    sum.iter().fold(0.0_f64, |largest, x| largest.max(x.abs())) / largest
}

/// Roundings of a few thousand steps, and switches that are located to 1e-12 of a step.
const SAME: f64 = 1e-9;

#[test]
fn equal_strikers_move_the_chain_in_mirror_symmetry() {
    let chain = struck_twice(12, 0.003, [striker(2.73, 0.2), striker(2.73, 0.2)], 0.0);
    for method in Method::LADDER {
        let found = simulate(&chain, &all_bodies(0.03, Integration::Steps { method, dt_s: 1e-5 })).unwrap();
        let x_m = &found.trajectory.displacement_m;
        assert!(asymmetry(x_m, x_m) < SAME, "{method}: {:e}", asymmetry(x_m, x_m));
        let (near, far) = (found.striker.unwrap(), found.far_striker.unwrap());
        let apart = near.displacement_m.iter().zip(&far.displacement_m).map(|(x, y)| (x + y).abs());
        assert!(apart.fold(0.0, f64::max) < SAME * 0.01, "{method}");
        let (near_s, far_s) = (&found.contact_switch_times_s, &found.far_contact_switch_times_s);
        assert!(!near_s.is_empty() && near_s.len() == far_s.len(), "{method}: {near_s:?} {far_s:?}");
        assert!(near_s.iter().zip(far_s).all(|(a, b)| (a - b).abs() < 1e-9), "{method}");
    }
}

/// A striker at the far end alone is the mirror image of one in front, whose code is older and tested by itself.
#[test]
fn a_far_striker_is_the_mirror_image_of_one_in_front() {
    let masses_kg: Vec<f64> = (0..9).map(|n| MASS_KG * (1.0 + 0.1 * f64::from(n))).collect();
    let own = Contact::from(Law::Linear(LinearLaw { k_n_per_m: 4e3 }));
    let Drive::Striker(body) = striker(2.73, 0.2) else { panic!("expected a striker") };
    let near = hec_chain(9, 0.003, Drive::Striker(body));
    let contact = chainwave_mechanics::Contacts::Struck {
        striker: own.clone(),
        between: Box::new(near.contact.clone()),
    };
    let near = Chain { mass_kg: masses_kg.clone(), contact, ..near };
    let far = Chain {
        mass_kg: masses_kg.into_iter().rev().collect(),
        far_end: FarEnd::Struck(FarStriker { striker: body, distance_m: 0.0, contact: Some(own) }),
        ..hec_chain(9, 0.003, at_rest(9))
    };
    for method in Method::LADDER {
        let schedule = all_bodies(0.02, Integration::Steps { method, dt_s: 1e-5 });
        let [near, far] = [&near, &far].map(|chain| simulate(chain, &schedule).unwrap());
        let off = asymmetry(&near.trajectory.displacement_m, &far.trajectory.displacement_m);
        assert!(off < SAME, "{method}: {off:e}");
        assert_eq!(near.contact_switch_times_s.len(), far.far_contact_switch_times_s.len());
        let psi = near.psi_max_j.iter().zip(far.psi_max_j.iter().rev());
        assert!(psi.into_iter().all(|(one, other)| (one / other - 1.0).abs() < 1e-6), "{method}");
    }
}

/// A far striker at a constant speed meets the last body at an output, where the step that ends there is cut by the switch as well.
#[test]
fn a_touch_at_an_output_leaves_the_output_as_it_is() {
    for k in 1..=10 {
        let chain = struck_twice(12, 0.003, [striker(2.73, 0.2), striker(2.0, 0.2)], f64::from(k) * 2e-4);
        let truth = simulate(&chain, &all_bodies(3e-3, Integration::Automatic { accuracy: 1e-9 })).unwrap();
        for method in [Method::Verlet, Method::Symplectic4, Method::Rk4, Method::Esdirk4] {
            let integration = match method {
                Method::Esdirk4 => Integration::Accuracy { method, accuracy: 1e-6 },
                _ => Integration::Steps { method, dt_s: 1e-6 },
            };
            let found = simulate(&chain, &all_bodies(3e-3, integration)).unwrap();
            // Verlet's error at omega h of 3.6e-3 rad: (omega h)^2 / 24 of the phase, 3 rad of it in 1 ms.
            let error = relative_error(&found, &truth);
            assert!(error < 1e-5, "{method}, contact at output {k}: {error}");
        }
    }
}

/// A striker that flies freely says nothing about the motion: neither one metres away nor a light one that rebounds makes errors small.
#[test]
fn errors_are_relative_to_what_bodies_do() {
    let far = struck_twice(8, 0.003, [striker(1.0, 0.2), striker(1e-3, 0.0)], 2.0);
    let light = Striker {
        mass_kg: 1e-3 * MASS_KG,
        velocity_m_per_s: 3.0,
        damping_kg_per_s: 0.0,
        ground_damping_kg_per_s: 0.0,
    };
    let light = hec_chain(8, 0.003, Drive::Striker(light));
    for (name, chain) in [("far", far), ("light", light)] {
        let at = |accuracy: f64| {
            let integration = Integration::Accuracy { method: Method::Dop853, accuracy };
            simulate(&chain, &all_bodies(0.02, integration)).unwrap()
        };
        let (found, truth) = (at(1e-4), at(1e-11));
        let (error, estimate) = (relative_error(&found, &truth), found.error_estimate.unwrap());
        assert!(error <= estimate && estimate < 1e-2, "{name}: {error:e} {estimate:e}");
    }
}

/// Linear invariants survive every Runge-Kutta step; what is left is rounding, of 5000 steps by 2e-16 each if all go one way, on
/// momenta of either sign.
#[test]
fn momentum_is_kept_and_energy_balances() {
    for c_s in [0.0, 0.2] {
        let chain = struck_twice(12, 0.0, [striker(2.73, c_s), striker(1.1, c_s)], 2e-3);
        let found = run(&chain, 0.05, 1e-5);
        assert!(found.far_contact_switch_times_s.len() > 1, "{:?}", found.far_contact_switch_times_s);
        let bodies = found.trajectory.velocity_m_per_s.sum_axis(Axis(0)) * MASS_KG;
        let strikers = found.striker.unwrap().velocity_m_per_s.into_iter();
        let strikers = strikers.zip(found.far_striker.unwrap().velocity_m_per_s);
        for (bodies, (near, far)) in bodies.iter().zip(strikers) {
            let off = bodies + STRIKER_KG * (near + far) - STRIKER_KG * (2.73 - 1.1);
            assert!(off.abs() < 5000.0 * f64::EPSILON * STRIKER_KG * (2.73 + 1.1), "{off:e}");
        }
        assert!(found.energy_drift < rk4_energy_loss(0.05, 1e-5), "{:e}", found.energy_drift);
    }
}

/// Striker, bodies and far striker by the classical method with steps of 0.1 us and no event location.
fn plain(chain: &Chain, duration_s: f64) -> Vec<f64> {
    let (Drive::Striker(near), FarEnd::Struck(far)) = (&chain.drive, &chain.far_end) else {
        panic!("expected strikers")
    };
    let mut mass_kg = vec![near.mass_kg];
    mass_kg.extend(&chain.mass_kg);
    mass_kg.push(far.striker.mass_kg);
    let n = mass_kg.len();
    let push_n = |contact: &Contact, c_kg_per_s: f64, overlap_m: f64, closing: f64| match overlap_m < 0.0 {
        true => 0.0,
        false => (contact.force_and_energy(overlap_m).0 + c_kg_per_s * closing).max(0.0),
    };
    let law = chain.contact.first();
    let far_law = far.contact.as_ref().unwrap_or(law);
    let rates = |state: &[f64]| {
        let mut rates = vec![0.0; 2 * n];
        let mut before_n = 0.0;
        for i in 0..n {
            let behind_n = if i + 1 < n {
                let overlap_m = state[i] - state[i + 1];
                let closing = state[n + i] - state[n + i + 1];
                match i {
                    0 => push_n(law, near.damping_kg_per_s, overlap_m, closing),
                    i if i + 2 == n => push_n(far_law, far.striker.damping_kg_per_s, overlap_m, closing),
                    _ => law.force_and_energy(overlap_m).0,
                }
            } else {
                0.0
            };
            let is_body = i > 0 && i + 1 < n;
            let drag_n = if is_body { chain.damping_kg_per_s[i - 1] * state[n + i] } else { 0.0 };
            rates[i] = state[n + i];
            rates[n + i] = (before_n - behind_n - drag_n) / mass_kg[i];
            before_n = behind_n;
        }
        rates
    };
    let mut state = vec![0.0; 2 * n];
    (state[n - 1], state[n], state[2 * n - 1]) =
        (far.distance_m, near.velocity_m_per_s, -far.striker.velocity_m_per_s);
    let n_steps = (duration_s / 1e-7).round() as usize;
    let h_s = duration_s / n_steps as f64;
    let along = |state: &[f64], rates: &[f64], h_s: f64| -> Vec<f64> {
        state.iter().zip(rates).map(|(x, rate)| x + h_s * rate).collect()
    };
    for _ in 0..n_steps {
        let first = rates(&state);
        let second = rates(&along(&state, &first, 0.5 * h_s));
        let third = rates(&along(&state, &second, 0.5 * h_s));
        let last = rates(&along(&state, &third, h_s));
        for i in 0..2 * n {
            state[i] += h_s / 6.0 * (first[i] + 2.0 * (second[i] + third[i]) + last[i]);
        }
    }
    state[1..n - 1].to_vec()
}

#[test]
fn it_moves_as_a_plain_integration_does() {
    let own = Contact::from(Law::Linear(LinearLaw { k_n_per_m: 6e3 }));
    let Drive::Striker(body) = striker(1.7, 0.35) else { panic!("expected a striker") };
    let far = FarStriker {
        striker: Striker { mass_kg: 0.7 * body.mass_kg, ..body },
        distance_m: 1.5e-3,
        contact: Some(own),
    };
    let chain = Chain { far_end: FarEnd::Struck(far), ..hec_chain(7, 0.003, striker(2.73, 0.2)) };
    let found = simulate(&chain, &Schedule::automatic(0.02, 1e-3)).unwrap();
    assert!(found.far_contact_switch_times_s.len() > 1);
    let truth = plain(&chain, 0.02);
    let found_m = found.trajectory.displacement_m.column(20);
    let off = truth.iter().zip(found_m).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
    // At a touch the dashpot sets in with 0.35 kg/s times 1.7 m/s, up to half a step of 0.1 us early or late: 65 um/s on a body of 0.455 g,
    // over 20 ms. Then the automatic choice's 1e-6 of some 20 mm.
    assert!(off < 0.35 * 1.7 * 0.5e-7 / MASS_KG * 0.02 + 2e-8, "{off:e}");
}

#[test]
fn switches_of_two_contacts_cost_no_order() {
    let chain = struck_twice(12, 0.003, [striker(2.73, 0.2), striker(1.3, 0.2)], 1e-3);
    let found = run(&chain, 0.03, 2e-5);
    assert!(!found.contact_switch_times_s.is_empty() && found.far_contact_switch_times_s.len() > 1);
    assert_order_four(orders(&chain, 0.03, [1e-4, 5e-5, 2.5e-5, 1.25e-5]));
}

#[test]
fn every_rung_finds_the_same_motion() {
    let chain = struck_twice(12, 0.003, [striker(2.73, 0.2), striker(1.3, 0.1)], 1e-3);
    let to = |method: Method, accuracy: f64| -> Simulation {
        simulate(&chain, &all_bodies(0.02, Integration::Accuracy { method, accuracy })).unwrap()
    };
    let truth = to(Method::Dop853, 1e-11);
    for method in Method::LADDER {
        let accuracy = if method == Method::SymplecticEuler { 1e-3 } else { 1e-6 };
        let error = relative_error(&to(method, accuracy), &truth);
        assert!(error < accuracy, "{method}: {error:e}");
    }
    // Leaving out what rests changes nothing, as both ends move from the start.
    let reached = simulate(&chain, &Schedule::automatic(0.02, 1e-4)).unwrap();
    assert!(relative_error(&reached, &truth) < Schedule::ACCURACY);
}

/// A far striker that rests against the last body is carried along when the wave comes.
#[test]
fn a_far_striker_at_rest_is_pushed_away() {
    let resting = Chain { far_end: far_end(0.0, 0.2, 0.0), ..hec_chain(60, 0.0, striker(2.73, 0.2)) };
    for method in [Method::Verlet, Method::Rk4, Method::Dop853] {
        let integration = Integration::Accuracy { method, accuracy: 1e-6 };
        let schedule = Schedule { integration, ..Schedule::automatic(0.06, 1e-4) };
        let [reached, all] = [Bodies::Reached, Bodies::All]
            .map(|bodies| simulate(&resting, &Schedule { bodies, ..schedule }).unwrap());
        assert!(relative_error(&reached, &all) < 2e-6, "{method}");
        let far = reached.far_striker.unwrap();
        assert!(far.velocity_m_per_s[100].abs() < 1e-6 && far.velocity_m_per_s[600] > 0.1, "{method}");
    }
}

/// A number of the far striker that a test changes.
type FarStrikerSetter = fn(&mut FarStriker, f64);

const NUMBERS: [(&str, FarStrikerSetter, f64); 5] = [
    ("m", |far, value| far.striker.mass_kg = value, STRIKER_KG),
    ("v", |far, value| far.striker.velocity_m_per_s = value, 1.3),
    ("c_s", |far, value| far.striker.damping_kg_per_s = value, 0.2),
    ("distance", |far, value| far.distance_m = value, 1e-3),
    ("stiffness", |far, value| far.contact = Some(Law::Linear(LinearLaw { k_n_per_m: value }).into()), 3e3),
];

#[test]
fn sensitivities_are_the_differences_of_simulations() {
    let with = |number: FarStrikerSetter, value: f64| {
        let mut chain = struck_twice(6, 0.003, [striker(2.73, 0.2), striker(1.3, 0.2)], 1e-3);
        let FarEnd::Struck(far) = &mut chain.far_end else { panic!("expected a far striker") };
        far.contact = Some(Law::Linear(LinearLaw { k_n_per_m: 3e3 }).into());
        number(far, value);
        chain
    };
    let change = |number: FarStrikerSetter, value: f64, part: f64| Change {
        below: with(number, value * (1.0 - part)),
        above: with(number, value * (1.0 + part)),
        width: 2.0 * part * value,
    };
    let schedule = all_bodies(0.015, Integration::Automatic { accuracy: 1e-11 });
    let changes: Vec<Change> =
        NUMBERS.iter().map(|(_, number, value)| change(*number, *value, 1e-5)).collect();
    let (_, first, value) = NUMBERS[0];
    let found = simulate_with_sensitivities(&with(first, value), &schedule, &changes).unwrap();
    assert!(found.simulation.far_contact_switch_times_s.len() > 1);
    for ((name, number, value), derivative) in NUMBERS.iter().zip(&found.derivatives) {
        let slope = |part: f64| {
            let Change { below, above, width } = change(*number, *value, part);
            let [low, high] = [below, above].map(|side| simulate(&side, &schedule).unwrap().trajectory);
            (&high.displacement_m - &low.displacement_m) / width
        };
        let expected = (slope(1e-3) * 4.0 - slope(2e-3)) / 3.0;
        let largest = expected.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        let off = (&derivative.displacement_m - &expected).iter().fold(0.0_f64, |off, x| off.max(x.abs()));
        // At an output that a switch passes within the step the difference is of two branches: a part in 1e3 of a kink there.
        assert!(off < 1e-4 * largest, "{name}: {:e}", off / largest);
    }
}

#[test]
fn what_makes_no_far_striker_is_refused() {
    let schedule = Schedule::automatic(0.01, 1e-4);
    let refused = |far_end: FarEnd, n: usize| {
        simulate(&Chain { far_end, ..hec_chain(n, 0.0, striker(2.0, 0.1)) }, &schedule).unwrap_err()
    };
    for (far_end, n) in
        [(far_end(2.0, 0.1, 0.0), 1), (far_end(2.0, 0.1, -1e-3), 5), (far_end(2.0, -0.1, 0.0), 5)]
    {
        assert!(matches!(refused(far_end, n), MechanicsError::NotPhysical { .. }));
    }
}
