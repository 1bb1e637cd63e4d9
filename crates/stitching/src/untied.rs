//! Groups of recordings that nothing ties to the others: how far the means of their drives and triggers may be off.

use chainwave_measurement::{ChainMotion, ErrorSource, Estimate};

/// Recordings that share no body with the others, and what their mean may be off by, one standard deviation.
#[derive(Debug, Clone, PartialEq)]
pub struct UntiedGroup {
    /// Its first body.
    pub first_body: usize,
    /// Names of its recordings.
    pub recordings: Vec<String>,
    /// Of its mean drive, relative.
    pub drive_sigma: f64,
    /// What its mean trigger is off by with that, in seconds: a drive that delays the wave looks like a trigger.
    pub trigger_by_drive_s: f64,
    /// Of its mean trigger beside that, in seconds.
    pub trigger_sigma_s: f64,
}

/// What a group's trials have in the mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mean {
    /// How strongly they were driven.
    Drive,
    /// When they were triggered.
    Trigger,
}

/// A mean, as something else tells it, that lies farther from the mean of all than ninety-nine in a hundred, by the trials of its group.
#[derive(Debug, Clone, PartialEq)]
pub struct MeanOff {
    /// The group's first body.
    pub first_body: usize,
    /// Which mean.
    pub of: Mean,
    /// How far it is off, in standard deviations of what was known of it.
    pub in_sigmas: Estimate,
}

impl UntiedGroup {
    /// Which of its means lie off where something else tells its mean drive and its mean trigger (seconds), each less that of all recordings.
    pub fn means_off(&self, drive: Estimate, trigger_s: Estimate) -> Vec<MeanOff> {
        let first_body = self.first_body;
        let of_drive = drive.scaled(1.0 / self.drive_sigma);
        let beside_s = trigger_s.value - of_drive.value * self.trigger_by_drive_s;
        let sigma_s = trigger_s.sigma.hypot(of_drive.sigma * self.trigger_by_drive_s);
        let of_trigger = Estimate::new(beside_s, sigma_s).scaled(1.0 / self.trigger_sigma_s);
        let means =
            [(Mean::Drive, self.drive_sigma, of_drive), (Mean::Trigger, self.trigger_sigma_s, of_trigger)];
        let off = means.into_iter().filter(|(_, known, in_sigmas)| *known > 0.0 && in_sigmas.is_unusual(1.0));
        off.map(|(of, _, in_sigmas)| MeanOff { first_body, of, in_sigmas }).collect()
    }
}

impl MeanOff {
    /// Counts the whole of it among the errors of a motion, which stays where it is; the error's name says who told it.
    pub fn count_in(&self, motion: &mut ChainMotion, told_by: &str) {
        let first_body = self.first_body;
        let known = match self.of {
            Mean::Drive => ErrorSource::MeanDrive { first_body },
            Mean::Trigger => ErrorSource::MeanTrigger { first_body },
        };
        let Some(place) = motion.modes.sources().position(|source| *source == known) else { return };
        let error_m = motion.modes.displacement_m(place, motion.displacement_m.dim());
        // What is known of the mean is among the errors already.
        let beyond = (self.in_sigmas.value.powi(2) - 1.0).max(0.0).sqrt();
        motion.add_error(format!("{known}, by {told_by}").into(), &(error_m * beyond));
    }
}

#[cfg(test)]
mod tests {
    use ndarray::array;

    use super::*;

    fn group() -> UntiedGroup {
        UntiedGroup {
            first_body: 3,
            recordings: vec!["one".into()],
            drive_sigma: 0.01,
            trigger_by_drive_s: -2e-6,
            trigger_sigma_s: 1e-6,
        }
    }

    #[test]
    fn a_mean_is_off_by_what_the_other_one_does_not_bring_with_it() {
        // Ten per cent are ten deviations; they bring triggers of 20 us less with them, so that of -20 us nothing is left.
        let off = group().means_off(Estimate::new(0.1, 0.0), Estimate::new(-2e-5, 0.0));
        assert_eq!(off.len(), 1);
        assert_eq!(off[0].of, Mean::Drive);
        // 1e-15: three roundings of ten.
        assert!((off[0].in_sigmas.value - 10.0).abs() < 1e-14);
        let off = group().means_off(Estimate::new(0.0, 0.0), Estimate::new(-2e-5, 0.0));
        assert_eq!(off[0].of, Mean::Trigger);
        // Known no better than by what it is off.
        assert!(group().means_off(Estimate::new(0.1, 0.1), Estimate::new(-2e-5, 1e-5)).is_empty());
        assert!(group().means_off(Estimate::new(0.02, 0.0), Estimate::new(-4e-6, 0.0)).is_empty());
    }

    #[test]
    fn all_of_it_counts_in_the_motion() {
        let mut motion = ChainMotion::unseen(1, vec![0.0, 1.0]);
        motion.displacement_m.fill(Some(Estimate::new(1.0, 0.0)));
        motion.add_error(ErrorSource::MeanDrive { first_body: 3 }, &array![[1e-3, 2e-3]]);
        let [off] = &group().means_off(Estimate::new(0.05, 0.0), Estimate::new(-1e-5, 0.0))[..] else {
            panic!("the drive alone is off")
        };
        off.count_in(&mut motion, "another");
        for (x, known) in motion.displacement_m.iter().zip([1e-3, 2e-3]) {
            // Five deviations; some roundings of numbers near one.
            assert!((x.unwrap().sigma - 5.0 * known).abs() < 1e-14);
        }
    }
}
