//! A small chain of softening contacts under a striker, solved here, so that its motion is real and nothing else is needed.

const MASS_KG: f64 = 0.455e-3;
const STRIKER_KG: f64 = 4.3e-3;
const SPEED_M_PER_S: f64 = 2.73;
/// F = A ((D + d)^p - d^p): the contact law of an elliptical ring.
const A: f64 = 60.1;
const D_M: f64 = 2.27e-3;
const P: f64 = 0.114;
const CHAIN_DAMPING_KG_PER_S: f64 = 0.003;
/// The band ends at 572 Hz, so that a step is 0.07 of the shortest period's phase: RK4 errs by some 1e-6.
const STEP_S: f64 = 2e-5;
/// Drives at which the chain is solved; between them its motion is a polynomial of the fourth degree.
const DRIVES: [f64; 5] = [-0.12, -0.06, 0.0, 0.06, 0.12];

/// The motion of every body for any drive near one.
pub(crate) struct Chain {
    /// For each drive, body and step: displacement and velocity.
    solved: Vec<Vec<Vec<[f64; 2]>>>,
}

impl Chain {
    pub(crate) fn solved(n_bodies: usize, duration_s: f64) -> Self {
        let solved = DRIVES.iter().map(|drive| solve(n_bodies, duration_s, SPEED_M_PER_S * (1.0 + drive)));
        Self { solved: solved.collect() }
    }

    /// Displacement of a body (numbered from 1), zero before the impact.
    pub(crate) fn displacement_m(&self, body: usize, time_s: f64, drive: f64) -> f64 {
        if time_s <= 0.0 {
            return 0.0;
        }
        let weights = DRIVES.iter().enumerate().map(|(i, node)| {
            let others = DRIVES.iter().enumerate().filter(|(j, _)| *j != i);
            others.map(|(_, other)| (drive - other) / (node - other)).product::<f64>()
        });
        let at = time_s / STEP_S;
        let (before, fraction) = (at.floor() as usize, at.fract());
        let value = |solved: &Vec<Vec<[f64; 2]>>| hermite(&solved[body - 1][before..before + 2], fraction);
        weights.zip(&self.solved).map(|(weight, solved)| weight * value(solved)).sum()
    }
}

fn hermite(ends: &[[f64; 2]], at: f64) -> f64 {
    let rest = 1.0 - at;
    let [[x_0, v_0], [x_1, v_1]] = [ends[0], ends[1]];
    (1.0 + 2.0 * at) * rest * rest * x_0
        + at * at * (3.0 - 2.0 * at) * x_1
        + STEP_S * at * rest * (rest * v_0 - at * v_1)
}

/// Bodies' displacement and velocity over time; the striker is the state's first entry.
fn solve(n_bodies: usize, duration_s: f64, speed_m_per_s: f64) -> Vec<Vec<[f64; 2]>> {
    let mut state = vec![[0.0; 2]; n_bodies + 1];
    state[0][1] = speed_m_per_s;
    let n_steps = (duration_s / STEP_S).ceil() as usize + 2;
    let mut motion = vec![Vec::with_capacity(n_steps); n_bodies];
    for _ in 0..n_steps {
        motion.iter_mut().zip(&state[1..]).for_each(|(of_body, now)| of_body.push(*now));
        let moved = |by: &[[f64; 2]], step_s: f64| -> Vec<[f64; 2]> {
            let pairs = state.iter().zip(by);
            pairs.map(|(now, rate)| [now[0] + step_s * rate[0], now[1] + step_s * rate[1]]).collect()
        };
        let k1 = rates(&state);
        let k2 = rates(&moved(&k1, 0.5 * STEP_S));
        let k3 = rates(&moved(&k2, 0.5 * STEP_S));
        let k4 = rates(&moved(&k3, STEP_S));
        for (i, now) in state.iter_mut().enumerate() {
            for (part, value) in now.iter_mut().enumerate() {
                *value += STEP_S / 6.0 * (k1[i][part] + 2.0 * (k2[i][part] + k3[i][part]) + k4[i][part]);
            }
        }
    }
    motion
}

fn rates(state: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let force_n: Vec<f64> = state
        .windows(2)
        .enumerate()
        .map(|(gap, pair)| {
            let overlap_m = pair[0][0] - pair[1][0];
            let force_n = A * ((overlap_m + D_M).max(0.0).powf(P) - D_M.powf(P));
            // The striker pushes only.
            if gap == 0 { force_n.max(0.0) } else { force_n }
        })
        .collect();
    let of_body = |(i, [_, v]): (usize, &[f64; 2])| {
        let from_left = if i == 0 { 0.0 } else { force_n[i - 1] };
        let to_right = force_n.get(i).copied().unwrap_or(0.0);
        let (mass_kg, damping) = if i == 0 { (STRIKER_KG, 0.0) } else { (MASS_KG, CHAIN_DAMPING_KG_PER_S) };
        [*v, (from_left - to_right - damping * v) / mass_kg]
    };
    state.iter().enumerate().map(of_body).collect()
}
