//! Synthetic experiments on chains that are not what the fitted model states, and what the fits make of them.
//!
//! The chains are solved here by a plain Runge-Kutta march of their own, with everything that a real chain may have and the model does not
//! say; noise as a tracker has it is added, and the fits get the positions.

use std::num::NonZero;
use std::ops::Range;

use chainwave_measurement::{BodyTrack, Estimate, Observation, map_in_parallel};
use chainwave_mechanics::{Chain, Drive, FarEnd, PowerLaw, Striker};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use crate::error::FitError;
use crate::tracks::{TrackFit, TrackModel, fit_tracks};

/// c_d and c_s of all chains.
pub const C_D_KG_PER_S: f64 = 0.003;
/// See [`C_D_KG_PER_S`].
pub const C_S_KG_PER_S: f64 = 0.2;

const BODY_KG: f64 = 0.455e-3;
const STRIKER_KG: f64 = 4.3e-3;
const VELOCITY: Estimate = Estimate { value: 2.73, sigma: 0.05 };
const PITCH_M: f64 = 0.03;
/// Bodies of a view, of which neighbours share one.
const BODIES_OF_VIEW: usize = 6;
const N_VIEWS: usize = 3;
const N_BODIES: usize = N_VIEWS * (BODIES_OF_VIEW - 1) + 1;
const N_TRIALS: u32 = 3;
const INTERVAL_S: f64 = 4e-5;
const N_FRAMES: i32 = 260;
const FIRST_FRAME: i32 = -20;

/// What is true of a chain, beside what its model states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChainBeyondModel {
    /// Its name in tables.
    pub name: &'static str,
    /// Dry friction of each body, in newtons.
    pub friction_n: f64,
    /// Factor on the contacts' A.
    pub stiffness: f64,
    /// Factor on lengths in the pictures.
    pub scale: f64,
    /// Factor on A of the striker's contact.
    pub striker_contact: f64,
    /// Factor on the mass of every second body.
    pub every_second: f64,
    /// Factor on the mass of body 1.
    pub struck_body: f64,
    /// Dashpot of the striker to ground, in kilograms per second.
    pub striker_ground_kg_per_s: f64,
    /// Dry friction of the striker, in newtons.
    pub striker_friction_n: f64,
    /// Relative standard deviation of masses from body to body.
    pub mass_scatter: f64,
    /// The same of the stiffness from gap to gap.
    pub stiffness_scatter: f64,
    /// Damping between neighbours, in kilograms per second.
    pub damping_between_kg_per_s: f64,
    /// Drag of each body over the square of its speed, in kilograms per metre.
    pub drag_kg_per_m: f64,
    /// Stiffness of springs that hold each body to ground, in newtons per metre.
    pub ground_n_per_m: f64,
    /// By how much the damping of the last body exceeds the mean, and that of the first falls short of it, relative to it.
    pub damping_grade: f64,
    /// Relative standard deviation of dampings from body to body, whose mean is c_d.
    pub damping_scatter: f64,
    /// Whether a wall holds the last body.
    pub is_held: bool,
    /// Share of a contact's force that is missing while it opens.
    pub hysteresis: f64,
    /// Exponent that is added to the contact law's.
    pub exponent_added: f64,
    /// Noise of one reading, in metres.
    pub noise_m: f64,
}

impl ChainBeyondModel {
    /// As the model states it.
    pub const AS_STATED: Self = Self {
        name: "as stated",
        friction_n: 0.0,
        stiffness: 1.0,
        scale: 1.0,
        striker_contact: 1.0,
        every_second: 1.0,
        struck_body: 1.0,
        striker_ground_kg_per_s: 0.0,
        striker_friction_n: 0.0,
        mass_scatter: 0.0,
        stiffness_scatter: 0.0,
        damping_between_kg_per_s: 0.0,
        drag_kg_per_m: 0.0,
        ground_n_per_m: 0.0,
        damping_grade: 0.0,
        damping_scatter: 0.0,
        is_held: false,
        hysteresis: 0.0,
        exponent_added: 0.0,
        noise_m: 4e-7,
    };

    /// The same at noise in which what is small hides.
    const NOISY: Self = Self { noise_m: 2e-6, ..Self::AS_STATED };

    /// The chains of the proof: sound, wrong by a little, wrong by much, and two things wrong at once.
    pub const ALL: [Self; 29] = [
        Self::AS_STATED,
        Self { name: "dry friction of 0.3 mN", friction_n: 3e-4, ..Self::AS_STATED },
        Self { name: "dry friction of 0.03 mN", friction_n: 3e-5, ..Self::AS_STATED },
        Self { name: "A 0.15 % off", stiffness: 1.0015, ..Self::AS_STATED },
        Self { name: "scale 0.5 % off", scale: 1.005, ..Self::AS_STATED },
        Self { name: "striker's contact twice as stiff", striker_contact: 2.0, ..Self::AS_STATED },
        Self { name: "masses in turn 1 and 1.1", every_second: 1.1, ..Self::AS_STATED },
        Self { name: "masses in turn 1 and 2", every_second: 2.0, ..Self::AS_STATED },
        Self { name: "masses scatter by 1.3 %", mass_scatter: 0.013, ..Self::AS_STATED },
        Self { name: "stiffness scatters by 5 %", stiffness_scatter: 0.05, ..Self::AS_STATED },
        Self { name: "dampers between neighbours", damping_between_kg_per_s: 2e-3, ..Self::AS_STATED },
        Self { name: "drag of 0.1 g/m", drag_kg_per_m: 1e-4, ..Self::AS_STATED },
        Self { name: "springs of 0.1 N/m to ground", ground_n_per_m: 0.1, ..Self::AS_STATED },
        Self { name: "damping from 0.9 to 1.1", damping_grade: 0.1, ..Self::AS_STATED },
        Self { name: "damping scatters by 10 %", damping_scatter: 0.1, ..Self::AS_STATED },
        Self { name: "a wall at the far end", is_held: true, ..Self::AS_STATED },
        Self { name: "p 0.3 % off", exponent_added: 0.114 * 0.003, ..Self::AS_STATED },
        Self { name: "friction, and A 0.15 % off", friction_n: 3e-4, stiffness: 1.0015, ..Self::AS_STATED },
        Self { name: "body 1 0.05 % heavier", struck_body: 1.0005, ..Self::AS_STATED },
        Self { name: "masses scatter by 0.01 %", mass_scatter: 1e-4, ..Self::AS_STATED },
        Self { name: "contacts open with 1 % less force", hysteresis: 0.01, ..Self::AS_STATED },
        Self {
            name: "striker damped as the bodies",
            striker_ground_kg_per_s: C_D_KG_PER_S,
            ..Self::AS_STATED
        },
        Self { name: "striker damped by 0.02 g/s", striker_ground_kg_per_s: 2e-5, ..Self::AS_STATED },
        Self { name: "striker with dry friction of 4 mN", striker_friction_n: 4e-3, ..Self::AS_STATED },
        Self { name: "striker with dry friction of 0.4 mN", striker_friction_n: 4e-4, ..Self::AS_STATED },
        Self { name: "noise of 2 um", ..Self::NOISY },
        Self { name: "noise of 2 um, dry friction of 0.03 mN", friction_n: 3e-5, ..Self::NOISY },
        Self { name: "noise of 2 um, dry friction of 0.01 mN", friction_n: 1e-5, ..Self::NOISY },
        Self {
            name: "noise of 2 um, striker's contact 0.07 % stiffer",
            striker_contact: 1.0007,
            ..Self::NOISY
        },
    ];
}

/// The model that is stated of every chain.
fn stated_model(n_threads: NonZero<usize>) -> TrackModel {
    let striker = Striker {
        mass_kg: STRIKER_KG,
        velocity_m_per_s: VELOCITY.value,
        damping_kg_per_s: 0.1,
        ground_damping_kg_per_s: 0.0,
    };
    TrackModel {
        chain: Chain {
            mass_kg: vec![BODY_KG; N_BODIES],
            damping_kg_per_s: vec![1e-3; N_BODIES],
            ground_stiffness_n_per_m: Vec::new(),
            ground_law: None,
            contact: PowerLaw::ELLIPTICAL_RING.into(),
            drive: Drive::Striker(striker),
            far_end: FarEnd::Free,
        },
        striker_velocity_m_per_s: VELOCITY,
        priors: Vec::new(),
        reading_errors: Vec::new(),
        usual_errors: Vec::new(),
        n_threads,
    }
}

/// The fit to an experiment of each seed: three views of six bodies of sixteen, three trials each, at 25 kHz.
///
/// # Errors
/// A law that makes no sense; a fit that fails stands among the results.
pub fn fits(
    truth: &ChainBeyondModel,
    seeds: Range<u64>,
    n_threads: NonZero<usize>,
) -> Result<Vec<Result<TrackFit, FitError>>, FitError> {
    let model = stated_model(NonZero::<usize>::MIN);
    let n = seeds.end.saturating_sub(seeds.start) as usize;
    let fitted = map_in_parallel(n, n_threads, |index| {
        let observations = filmed(truth, seeds.start + index as u64)?;
        Ok(fit_tracks(&observations, &vec![0.0; observations.len()], &model, None))
    });
    fitted.into_iter().collect()
}

/// The recordings of one experiment.
///
/// # Errors
/// A law that makes no sense.
fn filmed(truth: &ChainBeyondModel, seed: u64) -> Result<Vec<Observation>, FitError> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut normal = |sigma: f64| -> f64 {
        let deviate: f64 = StandardNormal.sample(&mut random);
        sigma * deviate
    };
    let stated = PowerLaw::ELLIPTICAL_RING;
    let mut bodies = Bodies {
        law: PowerLaw::new(stated.a, stated.delta_0_m, stated.p + truth.exponent_added)?,
        truth: *truth,
        mass_kg: vec![STRIKER_KG],
        stiffness: vec![truth.stiffness * truth.striker_contact],
        damping_kg_per_s: vec![truth.striker_ground_kg_per_s],
    };
    for body in 0..N_BODIES {
        let pattern = match body {
            0 => truth.struck_body,
            body if body % 2 == 1 => truth.every_second,
            _ => 1.0,
        };
        bodies.mass_kg.push(BODY_KG * pattern * (1.0 + normal(truth.mass_scatter)));
        bodies.stiffness.push(truth.stiffness * (1.0 + normal(truth.stiffness_scatter)));
    }
    let shape = |body: usize| {
        let along = 2.0 * body as f64 / (N_BODIES - 1) as f64 - 1.0;
        1.0 + truth.damping_grade * along
    };
    // No draws where nothing scatters: what was counted of other chains stays.
    let mut scatter = || if truth.damping_scatter > 0.0 { normal(truth.damping_scatter) } else { 0.0 };
    let factors: Vec<f64> = (0..N_BODIES).map(|body| shape(body) + scatter()).collect();
    let mean = factors.iter().sum::<f64>() / N_BODIES as f64;
    bodies.damping_kg_per_s.extend(factors.iter().map(|factor| C_D_KG_PER_S * factor / mean));
    let mut observations = Vec::new();
    for view in 0..N_VIEWS {
        for trial in 0..N_TRIALS {
            let velocity_m_per_s = VELOCITY.value + normal(VELOCITY.sigma);
            let impact_s = normal(1e-5);
            let times_s: Vec<f64> =
                (FIRST_FRAME..FIRST_FRAME + N_FRAMES).map(|k| (f64::from(k) + 0.3) * INTERVAL_S).collect();
            let duration_s = times_s.last().copied().unwrap_or(0.0) - impact_s;
            let moved_m = bodies.march(velocity_m_per_s, duration_s);
            let seen = |k: usize| view * (BODIES_OF_VIEW - 1) + k;
            let mut track = |body: usize| {
                let at = |time_s: f64| truth.scale * at_m(&moved_m, body, time_s - impact_s);
                let rest_m = PITCH_M * body as f64;
                let noise_m = truth.noise_m;
                let position = |t_s: &f64| Some(Estimate::new(rest_m + at(*t_s) + normal(noise_m), noise_m));
                BodyTrack { body, position_m: times_s.iter().map(position).collect() }
            };
            let bodies = (1..=BODIES_OF_VIEW).map(|k| track(seen(k))).collect();
            let recording = format!("view {view}, trial {trial}");
            observations.push(Observation { recording, view: view as u32, trial, times_s, bodies });
        }
    }
    Ok(observations)
}

/// Step of the march: linear interpolation between steps is good to 1e-9 m.
const STEP_S: f64 = 1e-6;
/// Below this speed friction is proportional to it, which stands for holding: a body creeps by less than 0.03 um in 10 ms.
const HELD_M_PER_S: f64 = 3e-6;

/// Striker and bodies, in a row.
struct Bodies {
    law: PowerLaw,
    truth: ChainBeyondModel,
    mass_kg: Vec<f64>,
    /// Factor on the force of the contact behind each mass; the last is a wall's.
    stiffness: Vec<f64>,
    /// Damping of each mass to ground, in kilograms per second.
    damping_kg_per_s: Vec<f64>,
}

impl Bodies {
    /// Displacements of all masses after the impact, step after step.
    fn march(&self, velocity_m_per_s: f64, duration_s: f64) -> Vec<Vec<f64>> {
        let n = self.mass_kg.len();
        let mut state = vec![0.0; 2 * n];
        state[n] = velocity_m_per_s;
        let mut moved_m = vec![state[..n].to_vec()];
        let mut rates = vec![vec![0.0; 2 * n]; 4];
        let mut trial = state.clone();
        for _ in 0..(duration_s / STEP_S).ceil() as usize + 1 {
            for (stage, part) in [0.0, 0.5, 0.5, 1.0].into_iter().enumerate() {
                for i in 0..2 * n {
                    let before = if stage == 0 { 0.0 } else { rates[stage - 1][i] };
                    trial[i] = state[i] + part * STEP_S * before;
                }
                self.rates(&trial, &mut rates[stage]);
            }
            for i in 0..2 * n {
                let sum = rates[0][i] + 2.0 * (rates[1][i] + rates[2][i]) + rates[3][i];
                state[i] += STEP_S / 6.0 * sum;
            }
            moved_m.push(state[..n].to_vec());
        }
        moved_m
    }

    /// Velocities and accelerations.
    fn rates(&self, state: &[f64], rates: &mut [f64]) {
        let n = self.mass_kg.len();
        let (x_m, v_m_per_s) = state.split_at(n);
        let mut before_n = 0.0;
        for mass in 0..n {
            let next = mass + 1;
            let (x_next_m, v_next) = if next < n { (x_m[next], v_m_per_s[next]) } else { (0.0, 0.0) };
            let (overlap_m, closing) = (x_m[mass] - x_next_m, v_m_per_s[mass] - v_next);
            let lost = if closing < 0.0 { self.truth.hysteresis } else { 0.0 };
            let spring_n = (1.0 - lost) * self.stiffness[mass] * self.law.force_n(overlap_m);
            let behind_n = match mass {
                0 if overlap_m < 0.0 => 0.0,
                0 => (spring_n + C_S_KG_PER_S * closing).max(0.0),
                _ if next == n && !self.truth.is_held => 0.0,
                _ => spring_n + self.truth.damping_between_kg_per_s * closing,
            };
            let v = v_m_per_s[mass];
            let sense = (v / HELD_M_PER_S).tanh();
            let resisted_n = match mass {
                0 => self.truth.striker_friction_n * sense,
                _ => {
                    let sprung_n = self.truth.ground_n_per_m * x_m[mass];
                    self.truth.friction_n * sense + self.truth.drag_kg_per_m * v * v.abs() + sprung_n
                }
            };
            let ground_n = self.damping_kg_per_s[mass] * v + resisted_n;
            rates[mass] = v_m_per_s[mass];
            rates[n + mass] = (before_n - behind_n - ground_n) / self.mass_kg[mass];
            before_n = behind_n;
        }
    }
}

/// Where a body was at a time after the impact.
fn at_m(moved_m: &[Vec<f64>], body: usize, after_impact_s: f64) -> f64 {
    let place = (after_impact_s / STEP_S).max(0.0);
    let (left, share) = ((place as usize).min(moved_m.len() - 2), place.fract());
    (1.0 - share) * moved_m[left][body] + share * moved_m[left + 1][body]
}
