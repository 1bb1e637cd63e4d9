//! A changed parameter of a chain, as the chain on both sides of it.

use crate::equations::parameters::{Chain, Drive, FarEnd, Striker};
use crate::{check, error::MechanicsError};

/// A change of a chain whose effect on the motion is asked for: the chain on both sides of it.
///
/// The two may differ in any number (masses, dampers, contact laws, the drive), not in the number of bodies, the kind of drive or
/// the far end. Where the chain cannot go below a value (a damper of zero), it may itself stand for the chain below.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// The chain a step below.
    pub below: Chain,
    /// The chain a step above.
    pub above: Chain,
    /// The step from below to above, in the unit of what is changed.
    pub width: f64,
}

impl Change {
    pub(super) fn check(&self, index: usize, chain: &Chain) -> Result<(), MechanicsError> {
        check::positive(format!("width of change {index}"), self.width)?;
        for side in [&self.below, &self.above] {
            side.check()?;
            let kind = |drive: &Drive| std::mem::discriminant(drive);
            let not_alike = |what: &'static str| Err(MechanicsError::NotAlike { index, what });
            if side.n_bodies() != chain.n_bodies() {
                return not_alike("number of bodies");
            }
            if kind(&side.drive) != kind(&chain.drive) {
                return not_alike("kind of drive");
            }
            let end = |far_end: &FarEnd| std::mem::discriminant(far_end);
            if end(&side.far_end) != end(&chain.far_end) {
                return not_alike("far end");
            }
        }
        Ok(())
    }

    /// Where it changes how the bodies accelerate.
    pub(crate) fn seat(&self) -> ChangedPart {
        let Self { below, above, .. } = self;
        let of_far = |chain: &Chain| chain.far_striker().and_then(|far| far.contact.clone());
        if below.contact != above.contact || of_far(below) != of_far(above) {
            return ChangedPart::Contacts;
        }
        let felt =
            |striker: &Striker| [striker.mass_kg, striker.damping_kg_per_s, striker.ground_damping_kg_per_s];
        let of_striker = |chain: &Chain| {
            let far = chain.far_striker().map(|far| felt(&far.striker));
            match &chain.drive {
                Drive::Striker(striker) => (Some(felt(striker)), far),
                _ => (None, far),
            }
        };
        let is_felt = below.mass_kg != above.mass_kg
            || below.damping_kg_per_s != above.damping_kg_per_s
            || below.ground_stiffness_n_per_m != above.ground_stiffness_n_per_m
            || below.ground_law != above.ground_law
            || of_striker(below) != of_striker(above);
        if is_felt { ChangedPart::MassesAndDampers } else { ChangedPart::Drive }
    }
}

/// What resists the motion beside dashpots: each body's, the same on all of them, and the striker's.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Resistance {
    /// Dry friction, in newtons: against the motion, and holding at rest where nothing stronger moves the body.
    pub friction_n: f64,
    /// Drag that grows as the square of the speed, in newtons over (metres per second) squared.
    pub drag_kg_per_m: f64,
    /// Dry friction of the striker in front of body 1, in newtons.
    pub striker_friction_n: f64,
}

impl Resistance {
    pub(super) fn check(&self) -> Result<(), MechanicsError> {
        check::not_negative("friction_n", self.friction_n)?;
        check::not_negative("drag_kg_per_m", self.drag_kg_per_m)?;
        check::not_negative("striker_friction_n", self.striker_friction_n)
    }
}

/// By what derivatives are asked for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DerivativeRequest<'a> {
    pub(crate) changes: &'a [Change],
    /// What resists bodies and striker, whose effect is asked for behind the changes.
    pub(crate) resistances: &'a [Resistance],
}

impl DerivativeRequest<'_> {
    /// Everything asked for.
    pub(crate) fn n(&self) -> usize {
        self.changes.len() + self.resistances.len()
    }
}

/// What a change is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ChangedPart {
    /// What the gaps hold.
    Contacts,
    /// The same springs move other masses, or against other dampers or what holds them to ground.
    MassesAndDampers,
    /// What is imposed on a body, or how it begins: accelerations are the same.
    Drive,
}
