//! Quantities of the experiment that a fit may move.

use chainwave_mechanics::{Chain, Contact, FarEnd, Striker};

use crate::steps::{DAMPING_STEPS, FACTOR_STEP};

/// A quantity of the experiment that a fit may move within what is known of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Quantity {
    /// Mass of the bodies.
    BodyMass,
    /// Mass of the striker.
    StrikerMass,
    /// Stiffness of what holds bodies to ground: springs, and the force of a curve.
    Ground,
    /// Stiffness of the contacts: the prefactor A of a power law, the force of any other.
    Prefactor,
    /// Offset delta_0 of the contact law.
    Offset,
    /// Exponent p of the contact law.
    Exponent,
    /// Length in the pictures over true length.
    Scale,
    /// The same of one view over that of all, by its number.
    ScaleOfView(u32),
    /// Mass of one body, from 1.
    MassOfBody(usize),
    /// The same of neighbours, from the first one's number to the last one's.
    MassOfNeighbours(usize, usize),
    /// Stiffness of one gap, from 1; the striker's contact is like the first.
    StiffnessOfGap(usize),
    /// The same of neighbours.
    StiffnessOfNeighbours(usize, usize),
    /// How fast the contact law softens at a given stiffness: 0 is the spring, 1 the law as it is (delta_0 falls as its inverse).
    Softening,
    /// Mass of every second body, from the second one on.
    MassOfEverySecond,
    /// Stiffness of the contact between striker and body 1, which has the law of the gaps otherwise.
    StrikerContact,
    /// Damping between neighbours, in kilograms per second; not a factor, and none where nothing is said.
    DampingBetween,
    /// Dry friction of each body, in newtons; not a factor, and none where nothing is said.
    Friction,
    /// Drag of each body over the square of its speed, in kilograms per metre; not a factor, and none where nothing is said.
    Drag,
    /// Dashpot of the striker to ground, in kilograms per second; not a factor, and none where nothing is said.
    StrikerGroundDamping,
    /// Dry friction of the striker, in newtons; not a factor, and none where nothing is said.
    StrikerFriction,
    /// Velocity of a striker behind the far end.
    FarStrikerVelocity,
    /// Stiffness of springs that hold each body to ground beside what is stated, in newtons per metre; not a factor, and none where nothing is
    /// said.
    GroundSpring,
    /// Damping of the last body over that of the first, each over what is stated of it; in between it changes by as much from body to body, and the mean stays.
    DampingGrade,
    /// Damping of one body, from 1; the mean of all stays.
    DampingOfBody(usize),
    /// The same of neighbours.
    DampingOfNeighbours(usize, usize),
}

/// How well a quantity is known beforehand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// What.
    pub quantity: Quantity,
    /// Relative standard uncertainty.
    pub relative_sigma: f64,
}

impl Quantity {
    /// Its name in tables; those that a view, a body or a gap has have its number behind.
    pub fn name(self) -> String {
        let kind = self.kind();
        match self {
            Self::ScaleOfView(view) => format!("{kind}_{view}"),
            Self::MassOfBody(number) | Self::StiffnessOfGap(number) | Self::DampingOfBody(number) => {
                format!("{kind}_{number}")
            }
            Self::MassOfNeighbours(first, last)
            | Self::StiffnessOfNeighbours(first, last)
            | Self::DampingOfNeighbours(first, last) => {
                format!("{kind}_{first}_to_{last}")
            }
            _ => kind.into(),
        }
    }

    fn kind(self) -> &'static str {
        match self {
            Self::BodyMass => "body_mass",
            Self::StrikerMass => "striker_mass",
            Self::Ground => "ground_stiffness",
            Self::Prefactor => "contact_a",
            Self::Offset => "contact_delta_0",
            Self::Exponent => "contact_p",
            Self::Scale => "scale",
            Self::ScaleOfView(_) => "scale_of_view",
            Self::MassOfBody(_) => "mass_of_body",
            Self::MassOfNeighbours(..) => "mass_of_bodies",
            Self::StiffnessOfGap(_) => "stiffness_of_gap",
            Self::StiffnessOfNeighbours(..) => "stiffness_of_gaps",
            Self::Softening => "softening",
            Self::MassOfEverySecond => "mass_of_every_second_body",
            Self::StrikerContact => "striker_contact_a",
            Self::DampingBetween => "damping_between_kg_per_s",
            Self::Friction => "friction_n",
            Self::Drag => "drag_kg_per_m",
            Self::StrikerGroundDamping => "striker_ground_damping_kg_per_s",
            Self::StrikerFriction => "striker_friction_n",
            Self::FarStrikerVelocity => "far_striker_velocity",
            Self::GroundSpring => "ground_spring_n_per_m",
            Self::DampingGrade => "damping_of_last_body_over_first",
            Self::DampingOfBody(_) => "damping_of_body",
            Self::DampingOfNeighbours(..) => "damping_of_bodies",
        }
    }

    /// Its value where nothing is said of it: a factor of one, or none of what is no factor.
    pub(crate) fn usual(self) -> f64 {
        if self.is_factor() { 1.0 } else { 0.0 }
    }

    /// Whether it multiplies what the model states.
    pub(crate) fn is_factor(self) -> bool {
        !matches!(
            self,
            Self::DampingBetween
                | Self::Friction
                | Self::Drag
                | Self::StrikerGroundDamping
                | Self::StrikerFriction
                | Self::GroundSpring
        )
    }

    /// How far values of it are apart of which chains are solved: of what is no factor, a force as that of a small damper is, at the speed of the
    /// striker, or a spring as small beside one that holds a gap. `critical_kg_per_s` is critical damping.
    pub(crate) fn step(self, chain: &Chain, striker_m_per_s: f64, critical_kg_per_s: f64) -> f64 {
        let damper_kg_per_s = DAMPING_STEPS[0] * critical_kg_per_s;
        match self {
            Self::DampingBetween | Self::StrikerGroundDamping => damper_kg_per_s,
            Self::Friction | Self::StrikerFriction => damper_kg_per_s * striker_m_per_s,
            Self::Drag => damper_kg_per_s / striker_m_per_s,
            Self::GroundSpring => FACTOR_STEP * chain.linear().map_or(0.0, |linear| linear.stiffness_n_per_m),
            _ => FACTOR_STEP,
        }
    }

    /// Whether its effect is added to the motion of the chain, which does not have it.
    pub(crate) fn is_resistance(self) -> bool {
        matches!(self, Self::Friction | Self::Drag | Self::StrikerFriction)
    }

    /// Whether pictures have it and the chain does not feel it.
    pub fn is_of_pictures(self) -> bool {
        matches!(self, Self::Scale | Self::ScaleOfView(_))
    }

    /// Whether it is a scale of the pictures that a view has.
    pub(crate) fn scales(self, view: u32) -> bool {
        self == Self::Scale || self == Self::ScaleOfView(view)
    }

    /// Multiplies the quantity in a model, or adds to it; the scale is not the model's, nor are friction and drag, whose effect is added to
    /// its motion.
    pub(crate) fn apply(self, factor: f64, chain: &mut Chain, striker: &mut Striker) {
        match self {
            Self::BodyMass => chain.mass_kg.iter_mut().for_each(|mass_kg| *mass_kg *= factor),
            Self::StrikerMass => striker.mass_kg *= factor,
            Self::Ground => {
                chain.ground_stiffness_n_per_m.iter_mut().for_each(|k_n_per_m| *k_n_per_m *= factor);
                chain.ground_law = chain.ground_law.as_ref().map(|law| law.times(factor));
            }
            Self::Prefactor => chain.contact.for_each(&mut |contact| stiffen(contact, factor)),
            Self::Offset => chain.contact.for_each_power_law(|law| law.delta_0_m *= factor),
            Self::Exponent => chain.contact.for_each_power_law(|law| law.p *= factor),
            Self::Scale | Self::ScaleOfView(_) | Self::Friction | Self::Drag | Self::StrikerFriction => {}
            Self::StrikerGroundDamping => striker.ground_damping_kg_per_s += factor,
            Self::FarStrikerVelocity => {
                if let FarEnd::Struck(far) = &mut chain.far_end {
                    far.striker.velocity_m_per_s *= factor;
                }
            }
            Self::MassOfEverySecond => {
                chain.mass_kg.iter_mut().skip(1).step_by(2).for_each(|mass_kg| *mass_kg *= factor);
            }
            Self::StrikerContact => {
                chain.contact = chain.contact.clone().struck_through(factor);
            }
            Self::DampingBetween => {
                chain.contact.for_each_gap(&mut |contact| contact.damping_kg_per_s += factor);
            }
            Self::GroundSpring => chain.add_ground_springs(factor),
            Self::DampingGrade => chain.grade_damping(factor),
            Self::DampingOfBody(body) => damp_bodies(chain, [body, body], factor),
            Self::DampingOfNeighbours(first, last) => damp_bodies(chain, [first, last], factor),
            Self::MassOfBody(body) => weigh(chain, [body, body], factor),
            Self::MassOfNeighbours(first, last) => weigh(chain, [first, last], factor),
            Self::StiffnessOfGap(gap) => stiffen_gaps(chain, [gap, gap], factor),
            Self::StiffnessOfNeighbours(first, last) => stiffen_gaps(chain, [first, last], factor),
            Self::Softening => chain.contact.for_each_power_law(|law| {
                law.delta_0_m /= factor;
                law.a *= factor.powf(law.p - 1.0);
            }),
        }
    }
}

/// Multiplies the masses of bodies from one number to another, from 1.
fn weigh(chain: &mut Chain, [first, last]: [usize; 2], factor: f64) {
    let of_bodies = chain.mass_kg.iter_mut().zip(1..);
    of_bodies.filter(|(_, body)| (first..=last).contains(body)).for_each(|(mass_kg, _)| *mass_kg *= factor);
}

/// Multiplies the dampings of bodies from one number to another, from 1, and leaves the mean of all.
fn damp_bodies(chain: &mut Chain, [first, last]: [usize; 2], factor: f64) {
    chain.shape_damping(|body| if (first..=last).contains(&(body + 1)) { factor } else { 1.0 });
}

/// Multiplies the stiffness of gaps from one number to another, from 1.
fn stiffen_gaps(chain: &mut Chain, [first, last]: [usize; 2], factor: f64) {
    let n_gaps = chain.mass_kg.len().saturating_sub(1);
    let mut contacts = chain.contact.clone().one_by_one(n_gaps);
    for gap in first..=last {
        contacts.change_gap(gap.wrapping_sub(1), |contact| stiffen(contact, factor));
    }
    chain.contact = contacts;
}

fn stiffen(contact: &mut Contact, factor: f64) {
    contact.law = contact.law.times(factor);
}
