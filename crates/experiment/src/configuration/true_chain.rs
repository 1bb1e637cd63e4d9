//! What is true of a chain that is filmed, where that is not what the experiment states.

use chainwave_mechanics::{Chain, Drive, Law, PowerLaw, Resistance};
use serde::{Deserialize, Serialize};

use super::far_end::FarEndTable;
use crate::error::Error;
use crate::input::numbers::{NotNegative, Positive};

/// What is true of the chain that is filmed, beside what is stated of it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TrueChain {
    /// Dry friction that holds each body back.
    pub friction_n: NotNegative,
    /// Drag of each body over the square of its speed, in kilograms per metre.
    pub drag_kg_per_m: NotNegative,
    /// Dashpot of the striker to ground.
    pub striker_ground_damping_kg_per_s: NotNegative,
    /// Dry friction that holds the striker back.
    pub striker_friction_n: NotNegative,
    /// Stiffness of springs that hold each body to ground, beside what is stated.
    pub ground_stiffness_n_per_m: NotNegative,
    /// Damping of the last body over that of the first, each over what is stated of it; in between it changes by as much from body to body, and the mean stays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping_of_last_body_over_first: Option<Positive>,
    /// Damping between neighbours.
    pub damping_between_kg_per_s: NotNegative,
    /// Factor on the stiffness of all contacts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stiffness_factor: Option<Positive>,
    /// Factor on the stiffness of the striker's contact alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub striker_contact_factor: Option<Positive>,
    /// Factor on the exponent of contacts that follow a power law.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exponent_factor: Option<Positive>,
    /// Factor on the mass of every second body, from the second one on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub every_second_mass_factor: Option<Positive>,
    /// What stands behind the last body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub far_end: Option<FarEndTable>,
}

impl TrueChain {
    /// What resists bodies and striker beside dampers.
    pub(crate) fn resistance(&self) -> Resistance {
        Resistance {
            friction_n: self.friction_n.get(),
            drag_kg_per_m: self.drag_kg_per_m.get(),
            striker_friction_n: self.striker_friction_n.get(),
        }
    }

    /// Refuses what holds a striker back where something else drives the chain.
    pub(crate) fn expect_no_striker_held_back(&self, drive: &str) -> Result<(), Error> {
        match self.striker_ground_damping_kg_per_s.get() > 0.0 || self.striker_friction_n.get() > 0.0 {
            true => Err(Error::Value(format!(
                "[synthetic.chain] striker_ground_damping_kg_per_s, striker_friction_n: expected a chain that a striker drives, found {drive}"
            ))),
            false => Ok(()),
        }
    }

    /// The chain as it is, from what is stated of it.
    pub(crate) fn of(&self, mut chain: Chain) -> Chain {
        let factor = |factor: Option<Positive>| factor.map_or(1.0, Positive::get);
        let (stiffness, exponent) = (factor(self.stiffness_factor), factor(self.exponent_factor));
        chain.contact.for_each(&mut |contact| {
            contact.damping_kg_per_s += self.damping_between_kg_per_s.get();
            contact.law = contact.law.times(stiffness);
            if let Law::Power(law) = &mut contact.law {
                *law = PowerLaw { p: law.p * exponent, ..*law };
            }
        });
        if let Drive::Striker(striker) = &mut chain.drive {
            striker.ground_damping_kg_per_s += self.striker_ground_damping_kg_per_s.get();
        }
        if let Some(factor) = self.striker_contact_factor {
            chain.contact = chain.contact.struck_through(factor.get());
        }
        let every_second = factor(self.every_second_mass_factor);
        chain.mass_kg.iter_mut().skip(1).step_by(2).for_each(|mass_kg| *mass_kg *= every_second);
        if self.ground_stiffness_n_per_m.get() > 0.0 {
            chain.add_ground_springs(self.ground_stiffness_n_per_m.get());
        }
        if let Some(ratio) = self.damping_of_last_body_over_first {
            chain.grade_damping(ratio.get());
        }
        if let Some(far_end) = self.far_end {
            chain.far_end = far_end.into();
        }
        chain
    }
}
