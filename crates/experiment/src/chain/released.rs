//! A chain that is let go: where it is held until then, and how it moves from there.

use chainwave_analysis::{GapFront, Measurement, Spacing};
use chainwave_measurement::{ChainMotion, Estimate, Trajectory};

use crate::configuration::Experiment;
use crate::error::Error;

impl Experiment {
    /// How far apart neighbours are in frames at rest: where a chain is held until it is let go, nearer than without a load.
    ///
    /// # Errors
    /// A list of another length than there are gaps, and a state that makes no sense.
    pub(crate) fn spacing_at_rest(&self) -> Result<Spacing, Error> {
        let spacing = self.chain.spacing()?;
        if !self.is_released() {
            return Ok(spacing);
        }
        let held_m = self.initial_state()?.displacement_m;
        let gaps = held_m.windows(2).zip(1..);
        Ok(gaps.map(|(pair, gap)| spacing.of_gap_m(gap) + pair[1] - pair[0]).collect::<Vec<f64>>().into())
    }

    /// Distances of neighbours in frames at rest gap by gap, in metres, where they differ; none where they are all the same.
    ///
    /// # Errors
    /// As [`Experiment::spacing_at_rest`].
    pub(crate) fn unequal_gaps_at_rest_m(&self) -> Result<Vec<f64>, Error> {
        if !self.is_released() {
            return self.chain.unequal_pitches_m();
        }
        let spacing = self.spacing_at_rest()?;
        Ok((1..self.chain.n_bodies).map(|gap| spacing.of_gap_m(gap)).collect())
    }

    /// Overlaps of the gaps while the chain is held, in metres; none for a chain that is not let go.
    ///
    /// # Errors
    /// A state that makes no sense.
    pub(crate) fn held_overlaps_m(&self) -> Result<Option<Vec<f64>>, Error> {
        if !self.is_released() {
            return Ok(None);
        }
        let held_m = self.initial_state()?.displacement_m;
        Ok(Some(held_m.windows(2).map(|pair| pair[0] - pair[1]).collect()))
    }

    /// A motion as pictures show it: from the places at rest, which for a chain that is let go are those where it is held.
    pub(crate) fn seen_from_rest(&self, mut motion: Trajectory) -> Trajectory {
        if self.is_released() {
            for mut of_body in motion.displacement_m.rows_mut() {
                let held_m = of_body.first().copied().unwrap_or(0.0);
                of_body -= held_m;
            }
        }
        motion
    }
}

/// Which way a wave that leaves the places at rest strains a chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sense {
    /// It presses neighbours together.
    Compression,
    /// It takes a load from them, or pulls them apart.
    Rarefaction,
}

/// Share of the largest change of any overlap by which a wave has come to a gap.
const ARRIVED: f64 = 0.2;

impl Sense {
    /// The sense of most gaps when the wave comes to them.
    pub(crate) fn of(motion: &ChainMotion) -> Self {
        let overlap_m = |gap: usize, i: usize| {
            let [left, right] = [gap, gap + 1].map(|row| motion.displacement_m[(row, i)]);
            Some(left?.value - right?.value)
        };
        let (n_gaps, n_times) = (motion.n_bodies().saturating_sub(1), motion.times_s.len());
        let of_gap = |gap: usize| (0..n_times).filter_map(move |i| overlap_m(gap, i));
        let largest_m =
            (0..n_gaps).flat_map(of_gap).fold(0.0_f64, |most, overlap_m| most.max(overlap_m.abs()));
        let first = |gap: usize| of_gap(gap).find(|overlap_m| overlap_m.abs() > ARRIVED * largest_m);
        let balance: f64 = (0..n_gaps).filter_map(first).map(f64::signum).sum();
        if balance < 0.0 { Self::Rarefaction } else { Self::Compression }
    }

    /// The sign of its compression.
    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::Compression => 1.0,
            Self::Rarefaction => -1.0,
        }
    }

    /// A motion whose wave is one of compression: itself, or its mirror image.
    pub(crate) fn turned(self, motion: &ChainMotion) -> ChainMotion {
        let mut turned = motion.clone();
        for x in turned.displacement_m.iter_mut().flatten() {
            x.value *= self.sign();
        }
        turned
    }

    /// What was measured of the turned motion, in the sense of the motion itself.
    pub(crate) fn turned_back(self, mut found: Measurement) -> Measurement {
        let turn = |x: &mut Estimate| x.value *= self.sign();
        found.strain.strain.iter_mut().flatten().for_each(turn);
        for front in found.fronts.iter_mut().flatten() {
            let GapFront { peak_strain, particle_velocity_m_per_s, .. } = front;
            turn(peak_strain);
            particle_velocity_m_per_s.iter_mut().for_each(turn);
        }
        if let Ok(velocity) = &mut found.group_velocity {
            velocity.particle_velocity_m_per_s.iter_mut().for_each(turn);
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use chainwave_analysis::exact_motion;
    use ndarray::Array2;

    use super::*;

    #[test]
    fn the_first_change_of_most_gaps_decides() {
        // Body n begins at time n: pulled back in the one motion, pushed on in the other; later each swings over.
        let motion = |sign: f64| {
            let moved = |(body, k): (usize, usize)| {
                let since = k as f64 - 3.0 * body as f64;
                if since > 0.0 { sign * (0.3 * since).sin() } else { 0.0 }
            };
            let displacement_m = Array2::from_shape_fn((6, 60), moved);
            exact_motion(&Trajectory {
                times_s: (0..60).map(f64::from).collect(),
                velocity_m_per_s: displacement_m.clone(),
                displacement_m,
            })
        };
        assert_eq!(Sense::of(&motion(1.0)), Sense::Compression);
        assert_eq!(Sense::of(&motion(-1.0)), Sense::Rarefaction);
        assert_eq!(Sense::Rarefaction.turned(&motion(-1.0)), motion(1.0));
    }
}
