//! Sensitivities against closed forms and differences of simulations.

use std::f64::consts::PI;

use chainwave_mechanics::{
    Chain, Change, Contact, Contacts, Drive, FarEnd, ImposedMotion, Integration, Kept, Law, LinearLaw,
    MechanicsError, PowerLaw, ReferenceMotion, Resistance, Schedule, Striker, Tension, simulate,
    simulate_with_resistance, simulate_with_sensitivities,
};
use ndarray::{Array2, Axis};

use crate::scenes::{MASS_KG, STRIKER_KG, hec_chain, striker};

/// A number of a chain that a test changes.
type ChainSetter = fn(&mut Chain, f64);

fn damper(chain: &mut Chain, value: f64) {
    chain.damping_kg_per_s.fill(value);
}

fn of_striker(chain: &mut Chain, change: impl FnOnce(&mut Striker)) {
    if let Drive::Striker(striker) = &mut chain.drive {
        change(striker);
    }
}

fn c_s(chain: &mut Chain, value: f64) {
    of_striker(chain, |striker| striker.damping_kg_per_s = value);
}

fn striker_to_ground(chain: &mut Chain, value: f64) {
    of_striker(chain, |striker| striker.ground_damping_kg_per_s = value);
}

fn v_s(chain: &mut Chain, value: f64) {
    of_striker(chain, |striker| striker.velocity_m_per_s = value);
}

fn m_s(chain: &mut Chain, value: f64) {
    of_striker(chain, |striker| striker.mass_kg = value);
}

fn mass(chain: &mut Chain, value: f64) {
    chain.mass_kg.fill(value);
}

fn law(chain: &mut Chain, change: impl FnMut(&mut PowerLaw)) {
    chain.contact.for_each_power_law(change);
}

/// Each number with its value in the experiment's chain.
const NUMBERS: [(&str, ChainSetter, f64); 9] = [
    ("c_d", damper, 0.003),
    ("c_s", c_s, 0.2),
    ("the striker's dashpot to ground", striker_to_ground, 0.02),
    ("v_s", v_s, 2.73),
    ("m_s", m_s, STRIKER_KG),
    ("m", mass, MASS_KG),
    ("a", |chain, value| law(chain, |law| law.a = value), PowerLaw::ELLIPTICAL_RING.a),
    ("delta_0", |chain, value| law(chain, |law| law.delta_0_m = value), PowerLaw::ELLIPTICAL_RING.delta_0_m),
    ("p", |chain, value| law(chain, |law| law.p = value), PowerLaw::ELLIPTICAL_RING.p),
];

fn with(chain: &Chain, number: ChainSetter, value: f64) -> Chain {
    let mut chain = chain.clone();
    number(&mut chain, value);
    chain
}

/// A change of a number about its value, by this part of it.
fn change(chain: &Chain, number: ChainSetter, value: f64, part: f64) -> Change {
    let step = part * value;
    let [below, above] = [value - step, value + step].map(|value| with(chain, number, value));
    Change { below, above, width: 2.0 * step }
}

fn fine(duration_s: f64, output_interval_s: f64) -> Schedule {
    let integration = Integration::Automatic { accuracy: 1e-11 };
    Schedule { integration, ..Schedule::automatic(duration_s, output_interval_s) }
}

/// Derivative of the displacements by central differences of simulations, of fourth order in the step.
fn difference(chain: &Chain, schedule: &Schedule, number: ChainSetter, value: f64) -> Array2<f64> {
    let slope = |part: f64| {
        let Change { below, above, width } = change(chain, number, value, part);
        let [low, high] = [below, above].map(|side| simulate(&side, schedule).unwrap().trajectory);
        (&high.displacement_m - &low.displacement_m) / width
    };
    (slope(1e-3) * 4.0 - slope(2e-3)) / 3.0
}

fn largest(values: &Array2<f64>) -> f64 {
    values.iter().fold(0.0, |largest, value| largest.max(value.abs()))
}

fn differs_by(found: &Array2<f64>, expected: &Array2<f64>) -> f64 {
    largest(&(found - expected)) / largest(expected)
}

/// The elastic impact of `drives.rs`: the body leaves with 2 v M / (M + m), pi / omega after the touch.
#[test]
fn an_elastic_impact_follows_its_closed_form() {
    let chain_of = |k_n_per_m: f64, v_m_per_s: f64, m_s_kg: f64| {
        let contact = Law::Linear(LinearLaw { k_n_per_m });
        let striker = Striker {
            mass_kg: m_s_kg,
            velocity_m_per_s: v_m_per_s,
            damping_kg_per_s: 0.0,
            ground_damping_kg_per_s: 0.0,
        };
        let drive = Drive::Striker(striker);
        let contact = Contact::from(contact).into();
        Chain { contact, drive, ..hec_chain(1, 0.0, striker_of(v_m_per_s)) }
    };
    let end_m = |k: f64, v: f64, m_s: f64| {
        let omega = (k * (m_s + MASS_KG) / (m_s * MASS_KG)).sqrt();
        let (meet_s, body_v) = (PI / omega, 2.0 * v * m_s / (m_s + MASS_KG));
        v * m_s / (m_s + MASS_KG) * meet_s + body_v * (0.01 - meet_s)
    };
    let (k, v) = (1474.0, 2.0);
    let slopes = |part: f64| {
        [
            (chain_of(k * (1.0 - part), v, STRIKER_KG), chain_of(k * (1.0 + part), v, STRIKER_KG), k),
            (chain_of(k, v * (1.0 - part), STRIKER_KG), chain_of(k, v * (1.0 + part), STRIKER_KG), v),
            (
                chain_of(k, v, STRIKER_KG * (1.0 - part)),
                chain_of(k, v, STRIKER_KG * (1.0 + part)),
                STRIKER_KG,
            ),
        ]
        .map(|(below, above, value)| Change { below, above, width: 2.0 * part * value })
    };
    let exact = |part: f64| {
        [
            (end_m(k * (1.0 + part), v, STRIKER_KG) - end_m(k * (1.0 - part), v, STRIKER_KG))
                / (2.0 * part * k),
            (end_m(k, v * (1.0 + part), STRIKER_KG) - end_m(k, v * (1.0 - part), STRIKER_KG))
                / (2.0 * part * v),
            (end_m(k, v, STRIKER_KG * (1.0 + part)) - end_m(k, v, STRIKER_KG * (1.0 - part)))
                / (2.0 * part * STRIKER_KG),
        ]
    };
    let found =
        simulate_with_sensitivities(&chain_of(k, v, STRIKER_KG), &fine(0.01, 1e-4), &slopes(1e-4)).unwrap();
    for (derivative, exact) in found.derivatives.iter().zip(exact(1e-5)) {
        let end = derivative.displacement_m[(0, 100)];
        // Differences of closed forms at parts of 1e-4 and 1e-5, and steps of 0.04 rad.
        assert!((end / exact - 1.0).abs() < 1e-6, "{end} {exact}");
    }
}

fn striker_of(v_m_per_s: f64) -> Drive {
    striker(v_m_per_s, 0.0)
}

/// Every number of the experiment's chain, against differences of simulations.
#[test]
fn derivatives_are_those_of_simulations() {
    let chain = with(&hec_chain(26, 0.003, striker(2.73, 0.2)), striker_to_ground, 0.02);
    let schedule = fine(0.02, 1e-4);
    let changes: Vec<Change> =
        NUMBERS.iter().map(|(_, number, value)| change(&chain, *number, *value, 1e-4)).collect();
    let found = simulate_with_sensitivities(&chain, &schedule, &changes).unwrap();
    let plain = simulate(&chain, &schedule).unwrap();
    assert_eq!(found.simulation.trajectory.times_s, plain.trajectory.times_s);
    // Both hold the accuracy asked for.
    assert!(
        differs_by(&found.simulation.trajectory.displacement_m, &plain.trajectory.displacement_m) < 1e-10
    );
    for ((name, number, value), derivative) in NUMBERS.iter().zip(&found.derivatives) {
        let expected = difference(&chain, &schedule, *number, *value);
        let error = differs_by(&derivative.displacement_m, &expected);
        // What the steps of 0.04 rad leave, as the documentation says.
        assert!(error < 5e-7, "{name}: {error}");
    }
}

/// Dampers slow what was struck, until the striker catches up: each new touch moves with what is changed.
#[test]
fn a_striker_that_comes_back_keeps_them_true() {
    let heavy = with(&hec_chain(3, 0.02, striker(1.0, 0.3)), m_s, 8e-3);
    let schedule = fine(0.06, 2e-5);
    let switches = simulate(&heavy, &schedule).unwrap().contact_switch_times_s;
    assert!(switches.len() == 3, "{switches:?}");
    for (number, value) in [(c_s as ChainSetter, 0.3), (damper, 0.02), (v_s, 1.0), (m_s, 8e-3)] {
        let asked = [change(&heavy, number, value, 1e-4)];
        let found = simulate_with_sensitivities(&heavy, &schedule, &asked).unwrap();
        let expected = difference(&heavy, &schedule, number, value);
        let error = &found.derivatives[0].displacement_m - &expected;
        // Within a difference a touch moves by up to 0.2 ms, so it tells nothing that near to one.
        let is_clear = |k: &usize| switches.iter().all(|switch_s| (*k as f64 * 2e-5 - switch_s).abs() > 5e-4);
        let clear = (0..error.ncols()).filter(is_clear);
        let error =
            clear.map(|k| largest(&error.column(k).to_owned().insert_axis(Axis(1)))).fold(0.0, f64::max);
        // The differences' own error of fourth order, which the touches amplify; without the jump it would be 0.6.
        assert!(error < 1e-5 * largest(&expected), "{value}: {error} {}", largest(&expected));
    }
}

/// Bodies that only touch, with dashpots that end with the contact: its opening and closing move with what is changed.
#[test]
fn dashpots_that_end_keep_them_true() {
    let between = |chain: &mut Chain, value: f64| {
        chain.contact.for_each_gap(&mut |contact| contact.damping_kg_per_s = value);
    };
    let law = Law::Linear(LinearLaw { k_n_per_m: 1474.0 });
    let contact = Contact { law, tension: Tension::Detach, damping_kg_per_s: 0.3 };
    // The second body meets the third 10 ms after the first contact has opened; a wrong instant would show from there on.
    let drive = Drive::Free { displacement_m: vec![0.0, 0.0, 0.5e-3], velocity_m_per_s: vec![0.1, 0.0, 0.0] };
    let chain = Chain { contact: contact.into(), ..hec_chain(3, 0.01, drive) };
    let start = |chain: &mut Chain, value: f64| {
        if let Drive::Free { velocity_m_per_s, .. } = &mut chain.drive {
            velocity_m_per_s[0] = value;
        }
    };
    let integration = Integration::Automatic { accuracy: 1e-9 };
    let schedule = Schedule { integration, ..Schedule::automatic(0.02, 2e-5) };
    for (name, number, value) in
        [("c", between as ChainSetter, 0.3), ("c_d", damper, 0.01), ("v_0", start, 0.1)]
    {
        let asked = [change(&chain, number, value, 1e-4)];
        let found = simulate_with_sensitivities(&chain, &schedule, &asked).unwrap();
        let expected = difference(&chain, &schedule, number, value);
        let error = differs_by(&found.derivatives[0].displacement_m, &expected);
        // Within the step in which a contact opens or closes, of 0.04 rad, its dashpot is taken for part of it: c h (1/m + 1/m) of
        // 1.5 % for each of three.
        assert!(error < 0.045, "{name}: {error}");
    }
}

/// What a change adds to the energy stays: without dampers, the derivative of the energy by v_s is m_s v_s at all times.
#[test]
fn the_derivative_of_the_energy_is_kept() {
    let chain = hec_chain(26, 0.0, striker(2.73, 0.0));
    // While the striker pushes, bodies and gaps hold all but its own part; so only what it gave them is told, at the end.
    let schedule = fine(0.014, 1e-4);
    let found = simulate_with_sensitivities(&chain, &schedule, &[change(&chain, v_s, 2.73, 1e-4)]).unwrap();
    let (motion, derivative) = (&found.simulation.trajectory, &found.derivatives[0]);
    let striker = found.simulation.striker.as_ref().unwrap();
    let contact = chain.contact.first();
    let last = motion.times_s.len() - 1;
    for k in [20, 60, last] {
        let (x, v) = (motion.displacement_m.column(k), motion.velocity_m_per_s.column(k));
        let (s, u) = (derivative.displacement_m.column(k), derivative.velocity_m_per_s.column(k));
        let kinetic: f64 = (0..26).map(|i| MASS_KG * v[i] * u[i]).sum();
        let potential: f64 =
            (0..25).map(|i| contact.force_and_energy(x[i] - x[i + 1]).0 * (s[i] - s[i + 1])).sum();
        // Work of the striker's push on body 1 up to k, by the momentum and energy that the striker lost.
        let given = |v_m_per_s: f64| {
            let run = simulate(&with(&chain, v_s, v_m_per_s), &schedule).unwrap();
            let (of_striker, x) = (run.striker.unwrap(), run.trajectory.displacement_m);
            let overlap_m = of_striker.displacement_m[k] - x[(0, k)];
            let held_j = if overlap_m > 0.0 { contact.force_and_energy(overlap_m).1 } else { 0.0 };
            0.5 * STRIKER_KG * (v_m_per_s.powi(2) - of_striker.velocity_m_per_s[k].powi(2)) - held_j
        };
        let expected = (given(2.73 + 1e-3) - given(2.73 - 1e-3)) / 2e-3;
        assert!(
            ((kinetic + potential) / expected - 1.0).abs() < 1e-6,
            "{k}: {} {expected}",
            kinetic + potential
        );
    }
    assert!(striker.velocity_m_per_s[last] < 2.73);
}

/// A body moved as measured: its displacement's derivative is given, and travels down the chain.
#[test]
fn an_imposed_motion_passes_its_change_on() {
    let struck = simulate(&hec_chain(26, 0.003, striker(2.73, 0.2)), &fine(0.02, 2e-5)).unwrap().trajectory;
    let imposed = |factor: f64| {
        let x_m = struck.displacement_m.row(0).iter().map(|x_m| factor * x_m).collect();
        Drive::Imposed(ImposedMotion::from_samples(struck.times_s.clone(), x_m).unwrap())
    };
    let chain_of = |factor: f64| hec_chain(26, 0.003, imposed(factor));
    let schedule = fine(0.015, 1e-4);
    let asked = [Change { below: chain_of(0.999), above: chain_of(1.001), width: 2e-3 }];
    let found = simulate_with_sensitivities(&chain_of(1.0), &schedule, &asked).unwrap();
    let slope = |part: f64| {
        let [low, high] = [1.0 - part, 1.0 + part]
            .map(|factor| simulate(&chain_of(factor), &schedule).unwrap().trajectory.displacement_m);
        (high - low) / (2.0 * part)
    };
    let expected = (slope(1e-3) * 4.0 - slope(2e-3)) / 3.0;
    let error = differs_by(&found.derivatives[0].displacement_m, &expected);
    // The spline's third derivative jumps at its knots, which costs the steps of either a little.
    assert!(error < 1e-6, "{error}");
}

/// Derivatives are the same whether they are handed out at once or piece by piece, and those by what a wave has not come to are none.
#[test]
fn they_may_be_followed_from_output_to_output() {
    let chain = hec_chain(60, 0.003, striker(2.73, 0.2));
    let of_body_30: ChainSetter = |chain, value| chain.mass_kg[29] = value;
    let of_body_3: ChainSetter = |chain, value| chain.mass_kg[2] = value;
    // Until shortly before the free end, whose gaps open, answers: differences of simulations see little of a kink.
    let schedule = fine(0.03, 1e-4);
    let alone = [change(&chain, of_body_30, MASS_KG, 1e-4)];
    let found = simulate_with_sensitivities(&chain, &schedule, &alone).unwrap();
    let motion = ReferenceMotion::solve(&chain, &schedule, Kept::Outputs).unwrap();
    let both = [alone[0].clone(), change(&chain, of_body_3, MASS_KG, 1e-4)];
    let (mut variations, mut replay) = (motion.variations(&both, &[]).unwrap(), motion.replay().unwrap());
    let mut first = 0;
    for last in [1, 7, 8, 150, 1000] {
        let piece = &variations.along(&replay.until(last).unwrap()).unwrap()[0];
        let last = last.min(motion.n_outputs() - 1);
        assert_eq!(piece.times_s.as_slice(), &found.derivatives[0].times_s[first..=last]);
        // Beside one that the wave comes to at once nothing sleeps, and all is the same.
        let whole = &found.derivatives[0].displacement_m;
        for (k, column) in piece.displacement_m.columns().into_iter().enumerate() {
            assert!(column == whole.column(first + k), "{}", first + k);
        }
        first = last;
    }
    let rests = found.simulation.trajectory.displacement_m.row(28);
    let n_rest = rests.iter().take_while(|x_m| **x_m == 0.0).count();
    let derivative = &found.derivatives[0].displacement_m;
    let n_zero = derivative.columns().into_iter().take_while(|s| s.iter().all(|s| *s == 0.0)).count();
    assert!(n_rest > 1 && n_zero >= n_rest, "{n_zero} of {n_rest}");
    let expected = difference(&chain, &schedule, of_body_30, MASS_KG);
    let error = differs_by(derivative, &expected);
    assert!(error < 1e-6, "{error}");
}

/// Tables, springs that detach, and one gap of its own: what the law of a gap is makes no difference.
#[test]
fn gaps_of_their_own_are_followed() {
    let mut chain = hec_chain(8, 0.003, striker(2.73, 0.2));
    let contact = chain.contact.first().clone();
    chain.contact = Contacts::Each(vec![contact; 7]);
    let third: ChainSetter = |chain, value| {
        if let Contacts::Each(contacts) = &mut chain.contact
            && let Law::Power(law) = &mut contacts[2].law
        {
            law.a = value;
        }
    };
    let schedule = fine(0.01, 1e-4);
    let found = simulate_with_sensitivities(
        &chain,
        &schedule,
        &[change(&chain, third, PowerLaw::ELLIPTICAL_RING.a, 1e-4)],
    )
    .unwrap();
    let expected = difference(&chain, &schedule, third, PowerLaw::ELLIPTICAL_RING.a);
    assert!(differs_by(&found.derivatives[0].displacement_m, &expected) < 5e-7);
}

#[test]
fn another_chain_is_no_change() {
    let chain = hec_chain(5, 0.003, striker(2.73, 0.2));
    let schedule = Schedule::automatic(0.01, 1e-4);
    let ask = |above: Chain, width: f64| {
        simulate_with_sensitivities(&chain, &schedule, &[Change { below: chain.clone(), above, width }])
            .unwrap_err()
    };
    for (above, what) in [
        (hec_chain(6, 0.003, striker(2.73, 0.2)), "number of bodies"),
        (Chain { far_end: FarEnd::Fixed, ..chain.clone() }, "far end"),
    ] {
        assert_eq!(ask(above, 1.0), MechanicsError::NotAlike { index: 0, what });
    }
    assert!(matches!(ask(chain.clone(), 0.0), MechanicsError::NotPhysical { .. }));
}

/// A striker of mass M that a constant force f holds back, pushes a body of mass m through a spring: with omega^2 = k (1/M + 1/m), the body
/// falls behind by f (t^2 / 2 - (1 - cos omega t) / omega^2) / (M + m) while they touch.
#[test]
fn friction_of_the_striker_holds_back_what_it_pushes() {
    let k_n_per_m = 100.0;
    let contact = Contact::from(Law::Linear(LinearLaw { k_n_per_m })).into();
    let chain = Chain { contact, ..hec_chain(1, 0.0, striker_of(1.0)) };
    let omega_per_s = (k_n_per_m * (1.0 / STRIKER_KG + 1.0 / MASS_KG)).sqrt();
    let friction = Resistance { striker_friction_n: 0.04, ..Resistance::default() };
    let schedule = fine(0.95 * PI / omega_per_s, 1e-5);
    let found = simulate_with_resistance(&chain, &schedule, &[], &[friction]).unwrap();
    let added = &found.derivatives[0];
    let last_m = added.displacement_m[(0, added.times_s.len() - 1)];
    for (t_s, added_m) in added.times_s.iter().zip(added.displacement_m.row(0)) {
        let swing_s2 = (1.0 - (omega_per_s * t_s).cos()) / omega_per_s.powi(2);
        let expected_m = -friction.striker_friction_n * (0.5 * t_s * t_s - swing_s2) / (STRIKER_KG + MASS_KG);
        // What steps of 0.04 rad leave, as the documentation says, of the largest.
        assert!((added_m - expected_m).abs() < 5e-7 * last_m.abs(), "{t_s}: {added_m} of {expected_m}");
    }
    assert!(last_m < 0.0);
}

/// A body that nothing pushes: drag slows it to v_0 / (1 + q v_0 t / m), friction by f t / m.
#[test]
fn what_resists_a_lonely_body_slows_it_as_it_should() {
    let alone = hec_chain(1, 0.0, striker_of(2.0));
    let drag = Resistance { drag_kg_per_m: 1e-3, ..Resistance::default() };
    let friction = Resistance { friction_n: 1e-3, ..Resistance::default() };
    let schedule = Schedule::automatic(0.02, 1e-5);
    let found = simulate_with_resistance(&alone, &schedule, &[], &[drag, friction]).unwrap();
    let motion = &found.simulation.trajectory;
    // Behind the collision, which a half period of striker and body on their contact ends.
    let [first, last] = [800, 2000];
    let span_s = motion.times_s[last] - motion.times_s[first];
    let speed = |which: usize, k: usize| {
        motion.velocity_m_per_s[(0, k)] + found.derivatives[which].velocity_m_per_s[(0, k)]
    };
    let dragged = speed(0, first) / (1.0 + drag.drag_kg_per_m * speed(0, first) * span_s / MASS_KG);
    let rubbed = speed(1, first) - friction.friction_n * span_s / MASS_KG;
    // A step of h errs by some (q v h / m)^4, 1e-11; friction is full up to the square of the creeping speed over the body's, 1e-10.
    for (which, expected) in [(0, dragged), (1, rubbed)] {
        let after = speed(which, last);
        assert!((after - expected).abs() < 1e-8 * expected, "{which}: {after} of {expected}");
    }
}
