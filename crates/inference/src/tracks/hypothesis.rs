//! What may be true of a chain that its model does not state: each a model with more degrees of freedom, to be believed on evidence alone.

use chainwave_mechanics::{FarEnd, Law};

use super::model::TrackModel;
use super::neighbours::Neighbours;
use crate::quantity::{Prior, Quantity};

/// Something that may be true of a chain and that its model does not state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Hypothesis {
    /// The contacts are as much stiffer or softer than stated.
    ContactStiffness,
    /// All bodies are as much heavier or lighter than stated.
    BodyMass,
    /// The struck body is heavier or lighter than stated, as what sets off the camera may be fixed to it.
    StruckMass,
    /// The striker is heavier or lighter than stated.
    StrikerMass,
    /// What carries the striker damps it.
    StrikerDamping,
    /// What carries the striker rubs it, with a force that does not depend on its speed.
    StrikerFriction,
    /// The striker behind the far end is faster or slower than stated.
    FarStrikerVelocity,
    /// The pictures' scale is another than stated.
    Scale,
    /// The striker meets body 1 in a contact of its own stiffness.
    StrikerContact,
    /// The contacts' law bends otherwise than stated, at another stiffness.
    ContactLaw,
    /// Bodies are rubbed by what carries them, with a force that does not depend on their speed.
    Friction,
    /// Bodies are slowed as the square of their speed.
    Drag,
    /// Springs hold the bodies to ground.
    GroundSprings,
    /// Neighbours are damped against each other.
    DampingBetween,
    /// Damping changes steadily along the chain.
    DampingGrade,
    /// Every second body is heavier or lighter.
    MassOfEverySecond,
    /// The last body is held by a wall in place of being free, or is free in place of held.
    OtherEnd,
    /// Dampings scatter from body to body.
    DampingsScatter,
    /// Masses scatter from body to body.
    MassesScatter,
    /// The contacts' stiffness scatters from gap to gap, and from theirs to the striker's.
    StiffnessScatters,
}

/// How far masses may scatter from body to body, relative to them (standard deviation), where tracks ask for it: wide beside the paper's 1.3 %.
pub const UNSTATED_MASS_SCATTER: f64 = 0.05;
/// The same of damping from body to body.
pub(super) const UNSTATED_DAMPING_SCATTER: f64 = 0.3;
/// The same of stiffness from gap to gap, of which 5 % have been seen.
pub const UNSTATED_STIFFNESS_SCATTER: f64 = 0.15;

/// Numbers that one hypothesis has at most: in longer chains neighbours share one, whose mean scatters by less. Masses that scatter within such groups
/// are then left as structure. To integrate the derivatives by a number for each body would grow with the cube of the chain's length, and be
/// done some ten times.
const MOST_NUMBERS: usize = 320;

impl Hypothesis {
    /// All, simple ones first.
    pub const ALL: [Self; 20] = [
        Self::ContactStiffness,
        Self::BodyMass,
        Self::StruckMass,
        Self::StrikerMass,
        Self::StrikerDamping,
        Self::StrikerFriction,
        Self::FarStrikerVelocity,
        Self::Scale,
        Self::StrikerContact,
        Self::ContactLaw,
        Self::Friction,
        Self::Drag,
        Self::GroundSprings,
        Self::DampingBetween,
        Self::DampingGrade,
        Self::MassOfEverySecond,
        Self::OtherEnd,
        Self::DampingsScatter,
        Self::MassesScatter,
        Self::StiffnessScatters,
    ];

    /// What it says, after "as if".
    pub fn in_words(self) -> &'static str {
        match self {
            Self::ContactStiffness => "the contacts were of another stiffness than stated (contact.a)",
            Self::BodyMass => "all bodies had another mass than stated (chain.mass_kg)",
            Self::StruckMass => "body 1 alone had another mass than stated (chain.mass_kg)",
            Self::StrikerMass => "the striker had another mass than stated (striker.mass_kg)",
            Self::StrikerDamping => "what carries the striker damped it",
            Self::StrikerFriction => "dry friction held the striker back",
            Self::FarStrikerVelocity => {
                "the striker behind the far end had another velocity than stated (far_striker.velocity_m_per_s)"
            }
            Self::Scale => "the pictures had another scale than stated (camera.scale_px_per_m)",
            Self::StrikerContact => "the striker's contact had a stiffness of its own",
            Self::ContactLaw => "the contacts followed another curve than stated (contact.a, delta_0_m, p)",
            Self::Friction => "dry friction held the bodies back",
            Self::Drag => "drag slowed the bodies as the square of their speed",
            Self::GroundSprings => "springs held the bodies to ground (chain.ground_stiffness_n_per_m)",
            Self::DampingGrade => "damping changed steadily along the chain (chain.damping_kg_per_s)",
            Self::DampingsScatter => "damping scattered from body to body (chain.damping_kg_per_s)",
            Self::DampingBetween => "neighbours were damped against each other",
            Self::MassOfEverySecond => "every second body had another mass (chain.mass_kg)",
            Self::OtherEnd => {
                "the far end were held where it counts as free, or free where it counts as held"
            }
            Self::StiffnessScatters => "the stiffness scattered from gap to gap (contact.stiffness_scatter)",
            Self::MassesScatter => "masses scattered from body to body (chain.mass_scatter)",
        }
    }

    /// The quantities that it frees without a prior.
    pub(super) fn quantities(self) -> &'static [Quantity] {
        match self {
            Self::ContactStiffness => &[Quantity::Prefactor],
            Self::BodyMass => &[Quantity::BodyMass],
            Self::StruckMass => &[Quantity::MassOfBody(1)],
            Self::StrikerMass => &[Quantity::StrikerMass],
            Self::ContactLaw => &[Quantity::Prefactor, Quantity::Softening],
            Self::StrikerDamping => &[Quantity::StrikerGroundDamping],
            Self::StrikerFriction => &[Quantity::StrikerFriction],
            Self::FarStrikerVelocity => &[Quantity::FarStrikerVelocity],
            Self::Scale => &[Quantity::Scale],
            Self::StrikerContact => &[Quantity::StrikerContact],
            Self::Friction => &[Quantity::Friction],
            Self::Drag => &[Quantity::Drag],
            Self::GroundSprings => &[Quantity::GroundSpring],
            Self::DampingGrade => &[Quantity::DampingGrade],
            Self::DampingBetween => &[Quantity::DampingBetween],
            Self::MassOfEverySecond => &[Quantity::MassOfEverySecond],
            Self::OtherEnd | Self::DampingsScatter | Self::MassesScatter | Self::StiffnessScatters => &[],
        }
    }

    /// Their value where the hypothesis says nothing, from which a search for them begins.
    pub(super) fn usual(self) -> f64 {
        self.quantities().first().map_or(1.0, |quantity| quantity.usual())
    }

    /// Where a search for these begins beside that: far from it, where the way is not straight.
    pub(super) fn far_starts(self) -> &'static [f64] {
        match self {
            Self::StrikerContact => &[2.0, 0.5],
            Self::MassOfEverySecond => &[1.3, 0.8],
            _ => &[],
        }
    }

    /// Whether a model does not say it already, and can.
    pub(super) fn is_open(self, model: &TrackModel, asked: &[Quantity]) -> bool {
        let is_prior = |quantity: &Quantity| {
            asked.contains(quantity) || model.priors.iter().any(|prior| prior.quantity == *quantity)
        };
        match self {
            _ if model.is_let_go() && self.is_of_striker() => false,
            Self::ContactLaw => {
                let is_power = matches!(model.chain.contact.first().law, Law::Power(_));
                is_power && !self.quantities().iter().any(is_prior)
            }
            Self::DampingsScatter => {
                let is_free = |prior: &Prior| {
                    matches!(prior.quantity, Quantity::DampingOfBody(_) | Quantity::DampingOfNeighbours(..))
                };
                !asked.contains(&Quantity::DampingGrade) && !model.priors.iter().any(is_free)
            }
            Self::MassesScatter | Self::StiffnessScatters => {
                let is_free = |prior: &Prior| {
                    matches!(
                        prior.quantity,
                        Quantity::MassOfBody(_)
                            | Quantity::MassOfNeighbours(..)
                            | Quantity::StiffnessOfGap(_)
                            | Quantity::StiffnessOfNeighbours(..)
                    )
                };
                !model.priors.iter().any(is_free)
            }
            Self::FarStrikerVelocity => {
                let moves =
                    matches!(&model.chain.far_end, FarEnd::Struck(far) if far.striker.velocity_m_per_s > 0.0);
                moves && !self.quantities().iter().any(is_prior)
            }
            Self::OtherEnd => {
                !matches!(model.chain.far_end, FarEnd::Struck(_)) && !self.quantities().iter().any(is_prior)
            }
            _ => !self.quantities().iter().any(is_prior),
        }
    }

    /// Whether it is of what strikes body 1.
    fn is_of_striker(self) -> bool {
        matches!(
            self,
            Self::StrikerMass | Self::StrikerDamping | Self::StrikerFriction | Self::StrikerContact
        )
    }

    /// The model with what is no quantity without a prior.
    pub(super) fn applied(self, model: &TrackModel, asked: &[Quantity], bodies: &[usize]) -> TrackModel {
        self.applied_with_at_most(MOST_NUMBERS, model, asked, bodies)
    }

    /// The same with so many numbers at most.
    pub(super) fn applied_with_at_most(
        self,
        most: usize,
        model: &TrackModel,
        asked: &[Quantity],
        bodies: &[usize],
    ) -> TrackModel {
        let mut model = model.clone();
        match self {
            Self::OtherEnd => {
                model.chain.far_end = match model.chain.far_end {
                    FarEnd::Free => FarEnd::Fixed,
                    FarEnd::Fixed => FarEnd::Free,
                    struck @ FarEnd::Struck(_) => struck,
                };
            }
            Self::DampingsScatter => {
                model.priors.extend(scattered(bodies, most, UNSTATED_DAMPING_SCATTER, damping_of));
            }
            Self::MassesScatter => {
                let is_open = |body: &&usize| !asked.contains(&Quantity::MassOfBody(**body));
                let bodies: Vec<usize> = bodies.iter().filter(is_open).copied().collect();
                model.priors.extend(scattered(&bodies, most, UNSTATED_MASS_SCATTER, mass_of));
            }
            Self::StiffnessScatters => {
                let last = bodies.last().copied().unwrap_or(0).min(model.chain.n_bodies().saturating_sub(1));
                let gaps: Vec<usize> = (1..=last).collect();
                model.priors.extend(scattered(&gaps, most, UNSTATED_STIFFNESS_SCATTER, stiffness_of));
                // The striker meets body 1 in a contact like the others.
                let is_prior = |prior: &Prior| prior.quantity == Quantity::StrikerContact;
                let is_struck = !model.is_let_go();
                if is_struck
                    && !asked.contains(&Quantity::StrikerContact)
                    && !model.priors.iter().any(is_prior)
                {
                    let (quantity, relative_sigma) = (Quantity::StrikerContact, UNSTATED_STIFFNESS_SCATTER);
                    model.priors.push(Prior { quantity, relative_sigma });
                }
            }
            _ => {}
        }
        model
    }

    /// Whether it has a number for each body or gap, and would take the blame for anything simpler.
    pub(super) fn is_wide(self) -> bool {
        matches!(self, Self::DampingsScatter | Self::MassesScatter | Self::StiffnessScatters)
    }
}

/// A number for each of some bodies or gaps, which scatter by so much, relative to them; neighbours share one where there are many, whose mean scatters
/// by less.
fn scattered(
    numbers: &[usize],
    most: usize,
    scatter: f64,
    quantity: impl Fn(&Neighbours) -> Quantity,
) -> impl Iterator<Item = Prior> {
    Neighbours::of(numbers, most).into_iter().map(move |group| Prior {
        quantity: quantity(&group),
        relative_sigma: scatter / (group.n as f64).sqrt(),
    })
}

fn damping_of(group: &Neighbours) -> Quantity {
    match *group {
        Neighbours { first, n: 1, .. } => Quantity::DampingOfBody(first),
        Neighbours { first, last, .. } => Quantity::DampingOfNeighbours(first, last),
    }
}

/// The factor on the mass of a group of neighbours, or of one body.
pub(super) fn mass_of(group: &Neighbours) -> Quantity {
    match *group {
        Neighbours { first, n: 1, .. } => Quantity::MassOfBody(first),
        Neighbours { first, last, .. } => Quantity::MassOfNeighbours(first, last),
    }
}

fn stiffness_of(group: &Neighbours) -> Quantity {
    match *group {
        Neighbours { first, n: 1, .. } => Quantity::StiffnessOfGap(first),
        Neighbours { first, last, .. } => Quantity::StiffnessOfNeighbours(first, last),
    }
}
