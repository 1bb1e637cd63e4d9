//! Chains whose bodies are held to ground by springs, against closed forms of linear ones, on every rung of the ladder.

use std::f64::consts::{PI, TAU};

use chainwave_mechanics::{
    Chain, Change, Drive, FarEnd, ImposedMotion, Integration, LinearChain, LinearLaw, MechanicsError, Method,
    Schedule, simulate, simulate_with_sensitivities,
};

use crate::scenes::{MASS_KG, hec_chain, striker};

const SPRING_N_PER_M: f64 = 1474.0;
const GROUND_N_PER_M: f64 = 900.0;

fn grounded(n: usize, damping_kg_per_s: f64, drive: Drive) -> Chain {
    Chain {
        ground_stiffness_n_per_m: vec![GROUND_N_PER_M; n],
        contact: LinearLaw::new(SPRING_N_PER_M).unwrap().into(),
        ..hec_chain(n, damping_kg_per_s, drive)
    }
}

const LINEAR: LinearChain =
    LinearChain { stiffness_n_per_m: SPRING_N_PER_M, mass_kg: MASS_KG, ground_n_per_m: GROUND_N_PER_M };

fn at_accuracy(
    chain: &Chain,
    duration_s: f64,
    method: Method,
    accuracy: f64,
) -> chainwave_mechanics::Simulation {
    let integration = Integration::Accuracy { method, accuracy };
    simulate(chain, &Schedule { integration, ..Schedule::automatic(duration_s, 1e-4) }).unwrap()
}

/// Between free ends the modes are cos(kappa (n - 1/2)) with kappa = pi q / N; let go, one swings and decays as a single damped body does:
/// exp(-b t) (cos(w t) + b / w sin(w t)), b = c / 2 m, w^2 = (k_g + 4 k sin^2(kappa / 2)) / m - b^2. The lowest is the cut-off.
#[test]
fn a_mode_that_is_let_go_swings_and_decays_on_every_rung() {
    const N: usize = 7;
    for (q, damping_kg_per_s) in [(0, 0.0), (0, 0.2), (3, 0.2), (6, 0.05)] {
        let kappa = PI * q as f64 / N as f64;
        let shape = |i: usize| 1e-4 * (kappa * (i as f64 + 0.5)).cos();
        let start =
            Drive::Free { displacement_m: (0..N).map(shape).collect(), velocity_m_per_s: vec![0.0; N] };
        let chain = grounded(N, damping_kg_per_s, start);
        let (decay, undamped) = (0.5 * damping_kg_per_s / MASS_KG, TAU * LINEAR.frequency_hz(kappa));
        let omega = (undamped * undamped - decay * decay).sqrt();
        for method in Method::LADDER {
            let accuracy = if method == Method::SymplecticEuler { 1e-3 } else { 1e-6 };
            let found = at_accuracy(&chain, 8e-3, method, accuracy);
            for (k, t) in found.trajectory.times_s.iter().enumerate() {
                let swing = (omega * t).cos() + decay / omega * (omega * t).sin();
                let expected_m = shape(1) * (-decay * t).exp() * swing;
                let error_m = found.trajectory.displacement_m[(1, k)] - expected_m;
                // The accuracy asked for, of the largest displacement.
                assert!(error_m.abs() < accuracy * 1e-4, "{method} {q} {t}: {error_m:e}");
            }
        }
        // What dampers took and what springs hold, those to ground included, balance as well as the motion is right.
        let finest = at_accuracy(&chain, 8e-3, Method::Dop853, 1e-10);
        assert!(finest.energy_drift < 1e-9, "{:e}", finest.energy_drift);
    }
}

/// Shaken with A sin(w t), a long damped chain settles to A Im(exp(i w t - K (n - 1))) with 2 k (cosh K - 1) = k_g - m w^2 + i w c: within its
/// band a wave, below its cut-off a motion that dies away from body to body.
#[test]
fn a_shaken_chain_settles_to_its_closed_form() {
    const N: usize = 60;
    const AMPLITUDE_M: f64 = 1e-4;
    let damping_kg_per_s = 0.5;
    let cut_off_hz = LINEAR.cut_off_hz();
    for frequency_hz in [0.5 * cut_off_hz, 1.4 * cut_off_hz] {
        let omega = TAU * frequency_hz;
        let times_s: Vec<f64> = (0..=8000).map(|k| 5e-6 * f64::from(k)).collect();
        let shaken_m = times_s.iter().map(|t| AMPLITUDE_M * (omega * t).sin()).collect();
        let motion = ImposedMotion::from_samples(times_s, shaken_m).unwrap();
        let chain = grounded(N, damping_kg_per_s, Drive::Imposed(motion));
        let found = simulate(&chain, &Schedule::automatic(0.04, 1e-4)).unwrap();
        // cosh K = 1 + z: e^-K = 1 + z - sqrt(z (z + 2)), of the two roots the smaller one.
        let z = (
            (GROUND_N_PER_M - MASS_KG * omega * omega) / (2.0 * SPRING_N_PER_M),
            omega * damping_kg_per_s / (2.0 * SPRING_N_PER_M),
        );
        let step = smaller_root(z);
        let mut factor = (1.0, 0.0);
        for body in 0..N / 2 {
            for k in 300..=400 {
                let t = found.trajectory.times_s[k];
                let expected_m = AMPLITUDE_M * (factor.0 * (omega * t).sin() + factor.1 * (omega * t).cos());
                let error_m = found.trajectory.displacement_m[(body, k)] - expected_m;
                // After 30 ms what the start left has fallen by exp(-c t / 2 m) = 7e-8; the far end's echo is damped as much.
                assert!(error_m.abs() < 2e-6 * AMPLITUDE_M, "{frequency_hz} {body} {t}: {error_m:e}");
            }
            factor = times(factor, step);
        }
        // The work of the shaker against the springs to ground is booked; body 1's own is not the chain's.
        assert!(found.energy_drift < 1e-6, "{:e}", found.energy_drift);
    }
}

type Complex = (f64, f64);

fn times(a: Complex, b: Complex) -> Complex {
    (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
}

/// Of u + 1 / u = 2 (1 + z), the root inside the unit circle.
fn smaller_root(z: Complex) -> Complex {
    let square = times(z, (z.0 + 2.0, z.1));
    let size = square.0.hypot(square.1).sqrt();
    let angle = 0.5 * square.1.atan2(square.0);
    let root = (size * angle.cos(), size * angle.sin());
    let roots = [(1.0 + z.0 - root.0, z.1 - root.1), (1.0 + z.0 + root.0, z.1 + root.1)];
    if roots[0].0.hypot(roots[0].1) < 1.0 { roots[0] } else { roots[1] }
}

#[test]
fn the_band_lies_between_cut_off_and_edge() {
    let omega = |n_per_m: f64| (n_per_m / MASS_KG).sqrt();
    // A handful of roundings.
    assert!((TAU * LINEAR.cut_off_hz() / omega(GROUND_N_PER_M) - 1.0).abs() < 1e-15);
    let edge = omega(GROUND_N_PER_M + 4.0 * SPRING_N_PER_M);
    assert!((TAU * LINEAR.band_edge_hz() / edge - 1.0).abs() < 1e-15);
    // The largest group velocity, 2 pi df / dkappa, by differences of 1e-4 rad at every thousandth of the band.
    let slope =
        |kappa: f64| TAU * (LINEAR.frequency_hz(kappa + 1e-4) - LINEAR.frequency_hz(kappa - 1e-4)) / 2e-4;
    let fastest = (1..1000).map(|i| slope(1e-3 * PI * f64::from(i))).fold(0.0, f64::max);
    // A maximum, looked at every 0.003 rad: 1e-6 of it at most.
    assert!((LINEAR.bodies_per_s() / fastest - 1.0).abs() < 2e-6, "{} {fastest}", LINEAR.bodies_per_s());
}

/// Struck, softening and damped: every rung books what the springs to ground hold, and agrees with the finest.
#[test]
fn every_rung_moves_a_struck_chain_alike() {
    let struck = |c_d: f64, c_s: f64| Chain {
        ground_stiffness_n_per_m: (0..12).map(|i| 100.0 * f64::from(i)).collect(),
        ..hec_chain(12, c_d, striker(2.73, c_s))
    };
    for chain in [struck(0.003, 0.2), struck(0.0, 0.0)] {
        let truth = at_accuracy(&chain, 0.01, Method::Dop853, 1e-11);
        for method in Method::LADDER {
            let accuracy = if method == Method::SymplecticEuler { 1e-3 } else { 1e-6 };
            let found = at_accuracy(&chain, 0.01, method, accuracy);
            let error = crate::scenes::relative_error(&found, &truth);
            assert!(error < accuracy, "{method}: {error:e}");
        }
        assert!(truth.energy_drift < 1e-9, "{:e}", truth.energy_drift);
    }
}

/// A spring of zero stiffness is none, to the last bit.
#[test]
fn no_stiffness_is_no_spring() {
    let free = hec_chain(26, 0.003, striker(2.73, 0.2));
    let held = Chain { ground_stiffness_n_per_m: vec![0.0; 26], ..free.clone() };
    let schedule = Schedule::automatic(0.01, 1e-4);
    assert_eq!(simulate(&free, &schedule).unwrap(), simulate(&held, &schedule).unwrap());
}

/// Derivatives by the springs to ground, and by a damper in their presence, are those of simulations.
#[test]
fn derivatives_are_those_of_simulations() {
    let chain_of = |ground_n_per_m: f64, c_d: f64| Chain {
        ground_stiffness_n_per_m: vec![ground_n_per_m; 12],
        ..hec_chain(12, c_d, striker(2.73, 0.2))
    };
    let integration = Integration::Automatic { accuracy: 1e-11 };
    let schedule = Schedule { integration, ..Schedule::automatic(0.012, 1e-4) };
    let sides: [(&dyn Fn(f64) -> Chain, f64); 2] =
        [(&|value| chain_of(value, 0.003), 300.0), (&|value| chain_of(300.0, value), 0.003)];
    for (of_value, value) in sides {
        let change = |part: f64| {
            let step = part * value;
            Change { below: of_value(value - step), above: of_value(value + step), width: 2.0 * step }
        };
        let found = simulate_with_sensitivities(&chain_of(300.0, 0.003), &schedule, &[change(1e-4)]).unwrap();
        let slope = |part: f64| {
            let Change { below, above, width } = change(part);
            let [low, high] = [below, above].map(|side| simulate(&side, &schedule).unwrap().trajectory);
            (&high.displacement_m - &low.displacement_m) / width
        };
        let expected = slope(1e-3) * (4.0 / 3.0) - slope(2e-3) / 3.0;
        let largest =
            |values: &ndarray::Array2<f64>| values.fold(0.0_f64, |most, value| most.max(value.abs()));
        let error = largest(&(&found.derivatives[0].displacement_m - &expected)) / largest(&expected);
        // What the steps of 0.04 rad leave, as the documentation says.
        assert!(error < 5e-7, "{value}: {error:e}");
    }
}

#[test]
fn springs_without_meaning_are_refused() {
    let refused = |ground: Vec<f64>| {
        let chain = Chain { ground_stiffness_n_per_m: ground, ..hec_chain(3, 0.0, striker(1.0, 0.0)) };
        simulate(&chain, &Schedule::automatic(0.01, 1e-4)).unwrap_err()
    };
    let short = refused(vec![1.0; 2]);
    assert!(
        matches!(short, MechanicsError::Length { .. }) && short.to_string().contains("ground"),
        "{short}"
    );
    for wrong in [-1.0, f64::NAN] {
        let said = refused(vec![1.0, wrong, 1.0]);
        assert!(
            matches!(said, MechanicsError::NotPhysical { .. }) && said.to_string().contains("ground"),
            "{said}"
        );
    }
}

/// One body between a wall and ground swings with both stiffnesses.
#[test]
fn a_wall_and_ground_hold_one_body_together() {
    let start = Drive::Free { displacement_m: vec![1e-4], velocity_m_per_s: vec![0.0] };
    let chain = Chain { far_end: FarEnd::Fixed, ..grounded(1, 0.0, start) };
    let omega = ((SPRING_N_PER_M + GROUND_N_PER_M) / MASS_KG).sqrt();
    let found = simulate(&chain, &Schedule::automatic(0.01, 1e-4)).unwrap().trajectory;
    for (t, x_m) in found.times_s.iter().zip(found.displacement_m.row(0)) {
        assert!((x_m / 1e-4 - (omega * t).cos()).abs() < Schedule::ACCURACY, "{t}");
    }
}
