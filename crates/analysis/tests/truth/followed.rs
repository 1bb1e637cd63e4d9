//! Pulses followed one by one: Toda's two solitons in closed form, Nesterenko's chain by its scaling, ends, noise, and the uncertainties.

use std::num::NonZero;

use chainwave_analysis::{
    Direction, PulseSettings, Pulses, Replicas, Sense, StrainMap, exact_motion, follow_pulses,
    measure_pulses, power_exponent, replicate, strain_map,
};
use chainwave_measurement::{ChainMotion, Estimate};
use chainwave_mechanics::{
    Chain, Contact, Drive, FarEnd, ImposedMotion, Law, LinearLaw, PowerLaw, Schedule, Striker, Tension,
    simulate,
};
use ndarray::Array2;

use crate::common::{INTERVAL_S, PITCH_M, motion_of_strain, with_sigma};

/// Two solitons of the Toda lattice r_n = -ln(tau_{n+1} tau_{n-1} / tau_n^2) (M. Toda, Theory of Nonlinear Lattices (1989), 3.6): of
/// steepness kappa, and running down (1) or up (-1).
#[derive(Clone, Copy)]
struct TwoSolitons {
    kappa: [f64; 2],
    way: [f64; 2],
    /// Where both would be at t = 0.
    place: f64,
}

impl TwoSolitons {
    /// What a meeting leaves between them, ((z_1 - z_2) / (1 - z_1 z_2))^2 with z = +-exp(-kappa).
    fn coupling(&self) -> f64 {
        let [one, other] = [0, 1].map(|i| self.way[i] * (-self.kappa[i]).exp());
        ((one - other) / (1.0 - one * other)).powi(2)
    }

    fn ln_tau(&self, n: f64, t: f64) -> f64 {
        let [one, other] =
            [0, 1].map(|i| 2.0 * (self.kappa[i] * (n - self.place) - self.way[i] * self.kappa[i].sinh() * t));
        let terms = [0.0, one, other, one + other + self.coupling().ln()];
        let largest = terms.into_iter().fold(f64::NEG_INFINITY, f64::max);
        largest + terms.iter().map(|term| (term - largest).exp()).sum::<f64>().ln()
    }

    fn strain(&self, n: f64, t: f64) -> f64 {
        2.0 * self.ln_tau(n, t) - self.ln_tau(n + 1.0, t) - self.ln_tau(n - 1.0, t)
    }

    /// How far the meeting moves each along its own way: by -ln(coupling) / (2 kappa), the overtaken one backward.
    fn shifts(&self) -> [f64; 2] {
        let is_overtaken = |i: usize| self.way[0] * self.way[1] > 0.0 && self.kappa[i] < self.kappa[1 - i];
        [0, 1]
            .map(|i| -self.coupling().ln() / (2.0 * self.kappa[i]) * if is_overtaken(i) { -1.0 } else { 1.0 })
    }

    fn map(&self, n_gaps: usize, times_s: impl Iterator<Item = f64>) -> StrainMap {
        let times_s: Vec<f64> = times_s.collect();
        let strain = Array2::from_shape_fn((n_gaps, times_s.len()), |(gap, k)| {
            Some(Estimate::new(self.strain((gap + 1) as f64, times_s[k]), 0.0))
        });
        StrainMap { times_s, spacing: 1.0.into(), strain }
    }
}

/// Head on, and overtaking with humps that merge (steepnesses far apart) and that exchange their sizes (near one another).
const CASES: [(TwoSolitons, usize, f64); 4] = [
    (TwoSolitons { kappa: [1.2, 0.8], way: [1.0, -1.0], place: 25.0 }, 50, 30.0),
    (TwoSolitons { kappa: [1.0, 1.0], way: [1.0, -1.0], place: 25.3 }, 50, 30.0),
    (TwoSolitons { kappa: [1.8, 0.7], way: [1.0, 1.0], place: 60.0 }, 120, 40.0),
    (TwoSolitons { kappa: [1.5, 1.0], way: [1.0, 1.0], place: 75.0 }, 150, 55.0),
];

fn times(until_s: f64) -> impl Iterator<Item = f64> {
    let n = (until_s / 0.05) as i32;
    (-n..=n).map(|k| 0.05 * f64::from(k))
}

/// tau_{n+1} tau_{n-1} / tau_n^2 - 1 is the second derivative of ln tau_n: that is Toda's equation of motion.
#[test]
fn the_closed_form_solves_the_lattice() {
    for (solitons, ..) in CASES {
        for (n, t) in [(25.0, 0.3), (26.0, -1.7), (60.0, 2.0), (70.0, 8.0), (75.0, 0.0)] {
            let h = 1e-3;
            let [before, here, after] = [t - h, t, t + h].map(|t| solitons.ln_tau(n, t));
            let bend = (before - 2.0 * here + after) / (h * h);
            // The difference errs by h^2 / 12 of the fourth derivative, some tens, and by roundings of ln tau, up to 300, over h^2.
            assert!((bend - ((-solitons.strain(n, t)).exp() - 1.0)).abs() < 1e-5 * (1.0 + bend), "{n} {t}");
        }
    }
}

#[test]
fn solitons_go_on_as_themselves_and_are_moved_as_the_closed_form_says() {
    for (index, (solitons, n_gaps, until_s)) in CASES.into_iter().enumerate() {
        let found = follow_pulses(&solitons.map(n_gaps, times(until_s)), &PulseSettings::default()).unwrap();
        assert_eq!(found.pulses.len(), 2, "case {index}");
        assert_eq!(found.collisions.len(), 1, "case {index}");
        let collision = found.collisions[0];
        assert_eq!(collision.is_head_on, solitons.way[1] < 0.0);
        // Which of the found is which of the solitons.
        let is_first = |pulse: &usize| {
            let own = &found.pulses[*pulse];
            let speed = own.speed_m_per_s.unwrap().value;
            let down = own.direction == Direction::Down;
            let speeds = solitons.kappa.map(|kappa| kappa.sinh() / kappa);
            match solitons.way[1] < 0.0 {
                true => down,
                false => (speed - speeds[0]).abs() < (speed - speeds[1]).abs(),
            }
        };
        for (side, pulse) in collision.pulses.iter().enumerate() {
            let soliton = usize::from(!is_first(pulse));
            let kappa = solitons.kappa[soliton];
            let own = &found.pulses[*pulse];
            assert_eq!(own.sense, Sense::Compression);
            assert_eq!(own.direction == Direction::Down, solitons.way[soliton] > 0.0);
            let shift = collision.shifts[side].unwrap().value;
            // The issue's own bound: 0.05 of the pitch.
            assert!((shift - solitons.shifts()[soliton]).abs() < 0.05, "case {index}, {soliton}: {shift}");
            // What the other soliton's tail leaves of 1e-4 of its height, and the samples' interval; a line through both sides of the meeting
            // would be off by up to 1.5 shifts over the way.
            let speed = own.speed_m_per_s.unwrap().value / (kappa.sinh() / kappa);
            assert!((speed - 1.0).abs() < 1e-3, "case {index}, {soliton}: {speed}");
            // exp(-r) - 1 = sinh^2 kappa / cosh^2(..) at its top.
            let size = (1.0 + kappa.sinh().powi(2)).ln();
            assert!((own.strain.unwrap().value / size + 1.0).abs() < 2e-3, "case {index}, {soliton}");
            // Half of ln(1 + S sech^2 y) where sech^2 y = (sqrt(1 + S) - 1) / S; y = kappa times gaps.
            let s = kappa.sinh().powi(2);
            let hwhm = (s / ((1.0 + s).sqrt() - 1.0)).sqrt().acosh() / kappa;
            assert!((own.hwhm_m.unwrap().value / hwhm - 1.0).abs() < 0.01, "case {index}, {soliton}");
        }
        let expected = if solitons.way[1] < 0.0 { [1.0, 1.0] } else { [1.0, -1.0] };
        assert!(solitons.shifts().iter().zip(expected).all(|(shift, sign)| shift * sign > 0.0));
    }
}

/// Without precompression, F = A Delta^(3/2) has no length of its own: x -> l x, t -> l^(-1/4) t solves the same equations, so c goes as
/// v^(1/5) exactly (V. F. Nesterenko, J. Appl. Mech. Tech. Phys. 24 (1983) 733).
#[test]
fn speeds_in_nesterenkos_chain_go_as_the_fifth_root() {
    let law = PowerLaw::new(5e9, 1e-12, 1.5).unwrap();
    let contact = Contact { tension: Tension::Detach, ..Contact::from(Law::Power(law)) };
    let mut points = Vec::new();
    for (velocity_m_per_s, duration_s) in [(0.05, 1.1e-3), (0.2, 0.83e-3), (0.8, 0.63e-3), (3.2, 0.48e-3)] {
        let mass_kg = 1e-3;
        let chain = Chain {
            mass_kg: vec![mass_kg; 40],
            damping_kg_per_s: vec![0.0; 40],
            ground_stiffness_n_per_m: Vec::new(),
            ground_law: None,
            contact: contact.clone().into(),
            drive: Drive::Striker(Striker {
                mass_kg,
                velocity_m_per_s,
                damping_kg_per_s: 0.0,
                ground_damping_kg_per_s: 0.0,
            }),
            far_end: FarEnd::Free,
        };
        let schedule = Schedule::automatic(duration_s, duration_s / 1200.0);
        let motion = exact_motion(&simulate(&chain, &schedule).unwrap().trajectory);
        let found = follow_pulses(&strain_map(&motion, 0.01).unwrap(), &PulseSettings::default()).unwrap();
        let first = &found.pulses[0];
        assert!(first.direction == Direction::Down && first.passes.len() > 25, "{}", first.passes.len());
        // Nesterenko's long wave, cos^4(x sqrt(10) / 5) of the pitch, is half as high at 0.905 pitches; on the lattice it is narrower by some
        // per cent (A. Chatterjee, Phys. Rev. E 59 (1999) 5912).
        let hwhm = first.hwhm_m.unwrap().value / 0.01;
        assert!((0.82..0.91).contains(&hwhm), "{hwhm}");
        points.push((first.particle_velocity_m_per_s.unwrap().value, first.speed_m_per_s.unwrap()));
    }
    let exponent = power_exponent(&points).unwrap();
    // The scaling is exact; a precompression of 1e-12 m and the samples' interval leave less than 1e-3.
    assert!((exponent.value - 0.2).abs() < 1e-3, "{exponent:?}");
}

/// A gentle push of the first body sends a wave down a linear chain that hardly disperses; the strain comes back with the other sign from
/// a free end, and with its own from a fixed one.
#[test]
fn a_free_end_turns_the_sign_and_a_wall_does_not() {
    let (k_n_per_m, mass_kg, n) = (1474.0_f64, 0.455e-3_f64, 60);
    let cell_s = (mass_kg / k_n_per_m).sqrt();
    let times_s: Vec<f64> = (0..2000).map(|k| f64::from(k) * 0.1 * cell_s).collect();
    let pushed_m = |t_s: &f64| 1e-3 * (1.0 + ((t_s - 30.0 * cell_s) / (6.0 * cell_s)).tanh());
    let drive = ImposedMotion::from_samples(times_s.clone(), times_s.iter().map(pushed_m).collect()).unwrap();
    for (far_end, sense) in [(FarEnd::Free, Sense::Tension), (FarEnd::Fixed, Sense::Compression)] {
        let chain = Chain {
            mass_kg: vec![mass_kg; n],
            damping_kg_per_s: vec![0.0; n],
            ground_stiffness_n_per_m: Vec::new(),
            ground_law: None,
            contact: LinearLaw { k_n_per_m }.into(),
            drive: Drive::Imposed(drive.clone()),
            far_end,
        };
        let schedule = Schedule::automatic(140.0 * cell_s, 0.2 * cell_s);
        let motion = exact_motion(&simulate(&chain, &schedule).unwrap().trajectory);
        let found = follow_pulses(&strain_map(&motion, PITCH_M).unwrap(), &PulseSettings::default()).unwrap();
        let [there, back] = &found.pulses[..] else { panic!("expected two pulses, found {found:?}") };
        assert_eq!((there.direction, there.sense), (Direction::Down, Sense::Compression));
        assert_eq!((back.direction, back.sense), (Direction::Up, sense));
        assert_eq!((there.reflected_from, back.reflected_from), (None, Some(0)));
        let speed_m_per_s = PITCH_M / cell_s;
        for pulse in [there, back] {
            // Waves as long as this one are slower than sound by (kappa / 2)^2 / 6, with kappa about 1 / 6 below 1 %.
            assert!((pulse.speed_m_per_s.unwrap().value / speed_m_per_s - 1.0).abs() < 0.01);
        }
        let sizes = [there, back].map(|pulse| pulse.strain.unwrap().value.abs());
        assert!((sizes[1] / sizes[0] - 1.0).abs() < 0.05, "{sizes:?}");
    }
}

const SIGMA_M: f64 = 5e-6;

#[test]
fn noise_alone_makes_no_pulse() {
    let rest = with_sigma(motion_of_strain(25, 400, |_, _| 0.0), SIGMA_M);
    let n_pulses: usize = replicate(&rest, 100, 11)
        .map(|motion| {
            let map = strain_map(&motion, PITCH_M).unwrap();
            follow_pulses(&map, &PulseSettings::default()).unwrap().pulses.len()
        })
        .sum();
    // A hump anywhere in 1 % of records at most, and a pulse needs three in a row.
    assert_eq!(n_pulses, 0);
}

/// Two steady pulses of 2 and 1.2 % that run through each other without a shift.
fn crossing() -> ChainMotion {
    let speed_gaps_per_s = 1500.0;
    let pulse = |size: f64, gap: f64, t_s: f64, at: f64, way: f64| {
        -size / ((gap - at - way * speed_gaps_per_s * t_s) / 1.5).cosh().powi(2)
    };
    motion_of_strain(30, 600, |gap, t_s| {
        let gap = gap as f64;
        pulse(0.02, gap, t_s, -2.0, 1.0) + pulse(0.012, gap, t_s, 33.0, -1.0)
    })
}

#[test]
fn stated_uncertainties_hold() {
    let truth = crossing();
    let noisy = with_sigma(truth, SIGMA_M);
    let settings = PulseSettings::default();
    let found: Vec<Pulses> = replicate(&noisy, 40, 3)
        .enumerate()
        .map(|(seed, motion)| {
            let replicas = Replicas { n: 40, seed: seed as u64 };
            measure_pulses(&motion, PITCH_M, &settings, replicas, NonZero::<usize>::MIN).unwrap()
        })
        .collect();
    let mut squares: [Vec<f64>; 4] = Default::default();
    let mut square = |kind: usize, found: Estimate, truth: f64| {
        squares[kind].push(((found.value - truth) / found.sigma).powi(2));
    };
    for one in &found {
        assert_eq!((one.pulses.len(), one.collisions.len()), (2, 1));
        for pulse in &one.pulses {
            let is_down = pulse.direction == Direction::Down;
            let (at, way, size) = if is_down { (-2.0, 1.0, 0.02) } else { (33.0, -1.0, 0.012) };
            square(0, pulse.speed_m_per_s.unwrap(), 1500.0 * PITCH_M);
            let gap = if is_down { 4 } else { 27 };
            let pass = pulse.passes.iter().find(|pass| pass.gap == gap);
            let pass = pass.unwrap();
            square(1, pass.t_s, way * (pass.gap as f64 - at) / 1500.0);
            square(2, pass.strain, -size);
            assert!(!pass.collides);
        }
        for shift in one.collisions[0].shifts {
            square(3, shift.unwrap(), 0.0);
        }
    }
    for (kind, squares) in squares.iter().enumerate() {
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        // 80 squares scatter by sqrt(2 / 80) = 0.16, and sigmas from 40 replicas raise their mean by 1 + 2 / 40; three of the former.
        assert!((0.5..1.55).contains(&mean), "{kind}: {mean}");
    }
    let interval_s = found[0].pulses[0].passes[0].t_s.sigma;
    assert!(interval_s > 0.0 && interval_s < INTERVAL_S, "{interval_s}");
}

/// How long a pulse of [`uneven`] falls over what it rises in.
const FALL_OVER_RISE: f64 = 8.0;

/// A pulse of 4 % that rises soon and falls slowly, as of a chain that damps strongly: greatest a time `RISE_S ln(1 + FALL_OVER_RISE)` after its foot.
fn uneven(after_s: f64) -> f64 {
    let s = (after_s / RISE_S).max(0.0);
    -0.04 * (1.0 - (-s).exp()) * (-s / FALL_OVER_RISE).exp()
}

const RISE_S: f64 = 3e-4;

#[test]
fn passages_of_pulses_that_rise_sooner_than_they_fall_are_where_they_are_greatest() {
    const GAPS_PER_S: f64 = 1500.0;
    let noisy =
        with_sigma(motion_of_strain(8, 400, |gap, t_s| uneven(t_s - 1e-3 - gap as f64 / GAPS_PER_S)), 1e-7);
    let to_top_s = RISE_S * (1.0 + FALL_OVER_RISE).ln();
    let mut squares = Vec::new();
    for (seed, motion) in replicate(&noisy, 10, 5).enumerate() {
        let replicas = Replicas { n: 40, seed: seed as u64 };
        let found =
            measure_pulses(&motion, PITCH_M, &PulseSettings::default(), replicas, NonZero::<usize>::MIN);
        let found = found.unwrap();
        let longest = found.pulses.iter().max_by_key(|pulse| pulse.passes.len()).unwrap();
        squares.extend(longest.passes.iter().map(|pass| {
            let truth_s = 1e-3 + pass.gap as f64 / GAPS_PER_S + to_top_s;
            ((pass.t_s.value - truth_s) / pass.t_s.sigma).powi(2)
        }));
    }
    assert_eq!(squares.len(), 80, "ten records of eight gaps");
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    // 1 of noise, which scatters by 0.16; and what the polynomial leaves may be as much again before it is told from noise.
    assert!(mean < 2.5, "{mean}");
}
