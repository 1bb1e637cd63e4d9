//! The chain as an experiment states it, and what drives it.

use chainwave_measurement::Estimate;
use chainwave_mechanics::{Chain, Drive, Striker};

use crate::configuration::{BodyState, DriveTable, Experiment, Synthetic, at_rest};
use crate::error::Error;
use crate::input::numbers::{NotNegative, Positive};

/// Where the fits of c_d and of c_s begin, as shares of the dashpot at which a body on one of its springs no longer swings: light damping. The
/// end does not depend on it.
pub(crate) const STARTING_SHARES: [f64; 2] = [6e-4, 0.06];
/// A damping where none matters: of a chain at rest.
const NO_MATTER_KG_PER_S: f64 = 1e-3;
/// Times to the wave's arrival at the far end for which a model is driven unless another time is asked for.
const CROSSINGS: f64 = 2.0;

impl Experiment {
    /// The chain with usual damping, as a fit starts from it, driven as it is stated for twice the time in which a weak wave crosses it.
    ///
    /// # Errors
    /// A contact law that makes no sense, a far striker behind a wall, and a drive that makes no sense.
    pub fn chain_model(&self) -> Result<Chain, Error> {
        self.chain_model_until(CROSSINGS * self.linear_chain()?.crossing_time_s(self.chain.n_bodies))
    }

    /// A time, or as long as the drive is known where that is shorter, in seconds.
    pub(crate) fn while_driven_s(&self, until_s: f64) -> f64 {
        let known_until_s = self.drive.as_ref().and_then(DriveTable::known_until_s);
        until_s.min(known_until_s.unwrap_or(f64::INFINITY))
    }

    /// The chain with usual damping, as a fit starts from it, driven for a time.
    ///
    /// # Errors
    /// As for [`Experiment::chain_model`].
    pub fn chain_model_until(&self, until_s: f64) -> Result<Chain, Error> {
        self.chain_driven(self.nominal_drive().value, self.starting_dampings_kg_per_s()?, until_s)
    }

    /// c_d and c_s as the fits start from them.
    ///
    /// # Errors
    /// As for [`Experiment::chain_model`].
    pub(crate) fn starting_dampings_kg_per_s(&self) -> Result<[f64; 2], Error> {
        let critical_kg_per_s = self.linear_chain()?.critical_damping_kg_per_s();
        Ok(STARTING_SHARES.map(|share| share * critical_kg_per_s))
    }

    /// The chain as it is stated, struck by a striker, with a mean damping of its bodies.
    ///
    /// # Errors
    /// As for [`Experiment::chain_model`].
    pub fn chain_struck_by(&self, striker: Striker, damping_kg_per_s: f64) -> Result<Chain, Error> {
        Ok(Chain { drive: Drive::Striker(striker), ..self.resting_chain(damping_kg_per_s)? })
    }

    /// The chain as it is stated, with mean dampings of its bodies and of the striker's contact, driven for a time with a strength: the
    /// striker's velocity in metres per second, or a factor on any other drive.
    ///
    /// # Errors
    /// As for [`Experiment::chain_model`].
    pub fn chain_driven(&self, strength: f64, dampings: [f64; 2], until_s: f64) -> Result<Chain, Error> {
        let chain = self.resting_chain(dampings[0])?;
        let drive = match (&self.striker, &self.drive) {
            (Some(striker), _) => Drive::Striker(Striker {
                mass_kg: striker.mass_kg.get(),
                velocity_m_per_s: strength,
                damping_kg_per_s: dampings[1],
                ground_damping_kg_per_s: 0.0,
            }),
            (None, Some(drive)) => drive.drive(strength, &chain, until_s)?,
            (None, None) => at_rest(chain.n_bodies()),
        };
        Ok(Chain { drive, ..chain })
    }

    fn resting_chain(&self, damping_kg_per_s: f64) -> Result<Chain, Error> {
        Ok(Chain {
            mass_kg: self.chain.masses_kg()?,
            damping_kg_per_s: self.chain.dampings_kg_per_s(damping_kg_per_s)?,
            ground_stiffness_n_per_m: self.chain.ground_n_per_m()?,
            ground_law: self.ground_law()?,
            contact: self.contact.contacts(self.chain.n_bodies)?,
            drive: at_rest(self.chain.n_bodies),
            far_end: self.far_end()?,
        })
    }

    /// Whether all bodies and all gaps are alike and nothing holds the bodies to the ground, as far as it is stated: what a pulse then loses without
    /// damping it loses to dispersion and rarefaction alone.
    ///
    /// # Errors
    /// As for [`Experiment::chain_model`].
    pub fn is_uniform(&self) -> Result<bool, Error> {
        let chain = self.resting_chain(NO_MATTER_KG_PER_S)?;
        let are_alike = |values: &[f64]| values.windows(2).all(|pair| pair[0].total_cmp(&pair[1]).is_eq());
        let is_free = chain.ground_law.is_none() && chain.ground_stiffness_n_per_m.iter().all(|k| *k <= 0.0);
        let first = chain.contact.of_gap(0);
        let has_one_contact = (1..chain.n_bodies() - 1).all(|gap| chain.contact.of_gap(gap) == first);
        Ok(is_free && has_one_contact && are_alike(&chain.mass_kg) && are_alike(&chain.damping_kg_per_s))
    }

    /// The strength of the drive and its standard deviation from trial to trial: the striker's velocity in metres per second, or 1, which
    /// is any other drive as it is stated.
    pub fn nominal_drive(&self) -> Estimate {
        match &self.striker {
            Some(striker) => {
                Estimate::new(striker.velocity_m_per_s.get(), striker.velocity_sigma_m_per_s.get())
            }
            None => Estimate::new(1.0, self.drive_scatter()),
        }
    }

    /// Relative standard deviation of the drive from trial to trial.
    pub fn drive_scatter(&self) -> f64 {
        match &self.striker {
            Some(striker) => striker.scatter(),
            None => self.drive.as_ref().and_then(DriveTable::scatter).map_or(0.0, Positive::get),
        }
    }

    /// States another such deviation, where one is given.
    pub(crate) fn state_drive_scatter(&mut self, scatter: Option<Positive>) {
        let Some(scatter) = scatter else { return };
        if let Some(striker) = &mut self.striker {
            striker.velocity_sigma_m_per_s = Positive(scatter.get() * striker.velocity_m_per_s.get());
        }
        if let Some(drive) = &mut self.drive {
            drive.set_scatter(Some(scatter));
        }
    }

    /// What sets the chain in motion where that is no striker, in words.
    pub fn driven_otherwise(&self) -> Option<&'static str> {
        self.drive.as_ref().map(DriveTable::in_words)
    }

    /// The state that the chain is let go from; rest for every chain that is driven.
    ///
    /// # Errors
    /// As for [`Experiment::chain_model`].
    pub(crate) fn initial_state(&self) -> Result<BodyState, Error> {
        let chain = self.resting_chain(NO_MATTER_KG_PER_S)?;
        match &self.drive {
            Some(drive) => drive.initial(1.0, &chain),
            None => Ok(BodyState::at_rest(chain.n_bodies())),
        }
    }

    /// Whether the chain is let go.
    pub(crate) fn is_released(&self) -> bool {
        self.drive.as_ref().is_some_and(DriveTable::is_free)
    }

    /// Whether body 1 moves as something prescribes.
    pub(crate) fn is_shaken(&self) -> bool {
        self.drive.as_ref().is_some_and(DriveTable::is_imposed)
    }

    /// Refuses an experiment without a drive or with two, and what is stated beside the wrong one.
    pub(crate) fn check_drive(&self) -> Result<(), Error> {
        let refuse = |message: &str| Err(Error::Value(message.into()));
        match (&self.striker, &self.drive) {
            (None, None) => refuse(
                "expected [striker], or [drive] where no striker sets the chain in motion, found neither",
            ),
            (Some(_), Some(_)) => refuse("drive: expected [striker] or [drive], found both"),
            (Some(_), None) => self.check_striker_damping(),
            (None, Some(DriveTable::Striker { .. })) => refuse(
                "drive: expected kind = \"shaker\", \"imposed\" or \"free\" (hint: a striker is stated as [striker]), found \"striker\"",
            ),
            (None, Some(drive)) => {
                if drive.scatter().is_none() {
                    return refuse(
                        "drive.scatter: expected the relative standard deviation of the drive from trial to trial, found none",
                    );
                }
                if self.far_striker.is_some() {
                    return refuse("far_striker: expected beside [striker], found beside [drive]");
                }
                drive.check(&self.resting_chain(NO_MATTER_KG_PER_S)?)?;
                self.check_striker_damping()
            }
        }
    }

    /// c_s is what is filmed of a striker, and of nothing else.
    fn check_striker_damping(&self) -> Result<(), Error> {
        let Some(synthetic) = &self.synthetic else { return Ok(()) };
        const KEY: &str = "synthetic.striker_damping_kg_per_s";
        match (self.striker.is_some(), synthetic.striker_damping_kg_per_s) {
            (true, None) => Err(Error::Value(format!("{KEY}: expected with [striker], found none"))),
            (false, Some(_)) => Err(Error::Value(format!("{KEY}: expected none with [drive], found one"))),
            _ => Ok(()),
        }
    }
}

impl Synthetic {
    /// c_s, in kilograms per second; 0 where there is no striker.
    pub(crate) fn c_s_kg_per_s(&self) -> f64 {
        self.striker_damping_kg_per_s.map_or(0.0, NotNegative::get)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    const SMALL: &str = include_str!("../../../../tests/small-experiment/experiment.toml");

    #[test]
    fn a_chain_is_uniform_where_bodies_and_gaps_are_alike_and_free() {
        let is_uniform = |text: &str| {
            let experiment = Experiment::parse(Path::new("experiment.toml"), text).unwrap();
            experiment.is_uniform().unwrap()
        };
        assert!(is_uniform(SMALL));
        let stated = |line: &str| SMALL.replacen("[chain]\n", &format!("[chain]\n{line}\n"), 1);
        assert!(!is_uniform(&stated("ground_stiffness_n_per_m = 20.0")));
        let mass = SMALL.lines().find(|line| line.starts_with("mass_kg")).unwrap();
        let (graded, _) = SMALL.split_once(mass).unwrap();
        let behind = &SMALL[graded.len() + mass.len()..];
        assert!(!is_uniform(&format!("{graded}mass_kg = {{ grade = [4e-4, 5e-4] }}{behind}")));
    }
}
