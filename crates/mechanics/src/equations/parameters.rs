//! A chain's parameters: masses, dampers, contacts, drive and far end.

use super::imposed::ImposedMotion;
use crate::{
    check,
    contact::{
        PowerLaw,
        contacts::{Contact, Contacts},
        table::TableLaw,
        tension::Tension,
    },
    error::MechanicsError,
};

/// A chain of bodies in contact, each a point mass with a dashpot, and where stated a spring, to ground:
/// m x_n'' = F(Delta_{n-1}) - F(Delta_n) - c_d x_n' - k_g x_n - g(x_n), with the overlap Delta_n = x_n - x_{n+1} of gap n.
///
/// Body n (from 1, the struck one) is entry n - 1 of the lists. Gaps are bonded: they push and pull.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// Mass of each body in kilograms.
    pub mass_kg: Vec<f64>,
    /// Dashpot c_d of each body to ground, in kilograms per second.
    pub damping_kg_per_s: Vec<f64>,
    /// Spring k_g of each body to ground in newtons per metre, at rest where the body is; empty for a chain without.
    pub ground_stiffness_n_per_m: Vec<f64>,
    /// What holds each body to ground besides: a force against its displacement, along a curve that may fall as well as rise, as that of a
    /// bistable beam; none for a chain without.
    pub ground_law: Option<TableLaw>,
    /// What lies in the gaps; a [`crate::PowerLaw`] turns `into()` it.
    pub contact: Contacts,
    /// What sets the chain in motion.
    pub drive: Drive,
    /// What stands behind the last body.
    pub far_end: FarEnd,
}

/// What sets the chain in motion.
#[derive(Debug, Clone, PartialEq)]
pub enum Drive {
    /// A body that strikes body 1; the chain is at rest until then.
    Striker(Striker),
    /// Body 1 moves as given, whatever the force; the others start at rest.
    Imposed(ImposedMotion),
    /// No drive: the chain is let go from this state, one entry a body.
    Free {
        /// Displacement at t = 0 in metres.
        displacement_m: Vec<f64>,
        /// Velocity at t = 0 in metres per second.
        velocity_m_per_s: Vec<f64>,
    },
}

impl Drive {
    /// The same drive, as strong: of a striker its velocity in metres per second, of a chain that is let go its state over this one. A motion that is imposed
    /// stays as it is.
    #[must_use]
    pub fn with_strength(&self, strength: f64) -> Self {
        let times = |state: &[f64]| state.iter().map(|value| strength * value).collect();
        match self {
            Self::Striker(striker) => Self::Striker(Striker { velocity_m_per_s: strength, ..*striker }),
            Self::Free { displacement_m, velocity_m_per_s } => Self::Free {
                displacement_m: times(displacement_m),
                velocity_m_per_s: times(velocity_m_per_s),
            },
            Self::Imposed(motion) => Self::Imposed(motion.clone()),
        }
    }
}

/// A body that touches body 1 at t = 0 and pushes only.
///
/// While the overlap Delta with body 1 is not negative, the contact force is max(0, F(Delta) + c_s (v_striker - v_1)),
/// else 0. It may leave and strike again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Striker {
    /// Mass in kilograms.
    pub mass_kg: f64,
    /// Velocity towards the chain at t = 0, in metres per second.
    pub velocity_m_per_s: f64,
    /// Damping c_s of its contact, in kilograms per second.
    pub damping_kg_per_s: f64,
    /// Dashpot from itself to ground, as that of what carries it, in kilograms per second.
    pub ground_damping_kg_per_s: f64,
}

/// What stands behind the last body.
#[derive(Debug, Clone, PartialEq)]
pub enum FarEnd {
    /// Nothing.
    Free,
    /// A wall that does not move, bonded to the last body by one more gap like the last.
    Fixed,
    /// A body that strikes the last one.
    Struck(FarStriker),
}

/// A body behind the last one that comes towards the chain and pushes only, as [`Striker`] does in front of body 1.
#[derive(Debug, Clone, PartialEq)]
pub struct FarStriker {
    /// Its mass, its velocity towards the chain (so against x), and the damping of its contact.
    pub striker: Striker,
    /// How far from the last body at rest it stands at t = 0, in metres: zero where it touches, else it strikes later. Its
    /// displacement counts from where it would touch.
    pub distance_m: f64,
    /// Its contact with the last body, in which its own damping stands for the dashpot; none for one like the last gap.
    pub contact: Option<Contact>,
}

impl Chain {
    /// Hollow elliptical cylinders as in the paper, of 0.455 g each on the law of one ring ([`PowerLaw::ELLIPTICAL_RING`]), with dashpots
    /// of 0.003 kg/s, at rest before [`Striker::OF_RINGS`] and with nothing behind them.
    pub fn of_rings(n_bodies: usize) -> Self {
        Self {
            mass_kg: vec![0.455e-3; n_bodies],
            damping_kg_per_s: vec![0.003; n_bodies],
            ground_stiffness_n_per_m: Vec::new(),
            ground_law: None,
            contact: PowerLaw::ELLIPTICAL_RING.into(),
            drive: Drive::Striker(Striker::OF_RINGS),
            far_end: FarEnd::Free,
        }
    }

    /// Multiplies the damping to ground of each body by a factor, by its place from 0, and all of them so that their mean stays.
    pub fn shape_damping(&mut self, factor: impl Fn(usize) -> f64) {
        let dampings_kg_per_s = &mut self.damping_kg_per_s;
        let before: f64 = dampings_kg_per_s.iter().sum();
        dampings_kg_per_s.iter_mut().enumerate().for_each(|(body, c_kg_per_s)| *c_kg_per_s *= factor(body));
        let after: f64 = dampings_kg_per_s.iter().sum();
        if after > 0.0 {
            dampings_kg_per_s.iter_mut().for_each(|c_kg_per_s| *c_kg_per_s *= before / after);
        }
    }

    /// The same by factors that change by as much from body to body, from one at the first body to `last_over_first`.
    pub fn grade_damping(&mut self, last_over_first: f64) {
        let last = self.damping_kg_per_s.len().saturating_sub(1).max(1) as f64;
        self.shape_damping(|body| 1.0 + (last_over_first - 1.0) * body as f64 / last);
    }

    /// Adds a spring to ground to each body, of a stiffness in newtons per metre.
    pub fn add_ground_springs(&mut self, stiffness_n_per_m: f64) {
        self.ground_stiffness_n_per_m.resize(self.mass_kg.len(), 0.0);
        self.ground_stiffness_n_per_m.iter_mut().for_each(|k_n_per_m| *k_n_per_m += stiffness_n_per_m);
    }

    /// Number of bodies.
    pub fn n_bodies(&self) -> usize {
        self.mass_kg.len()
    }

    /// Stiffness of what holds each body to ground, where it rests, in newtons per metre.
    pub fn ground_at_rest_n_per_m(&self) -> Vec<f64> {
        let by_curve = self.ground_law.as_ref().map_or(0.0, |law| law.stiffness_n_per_m(0.0));
        let spring = |body: usize| self.ground_stiffness_n_per_m.get(body).copied().unwrap_or(0.0);
        (0..self.n_bodies()).map(|body| spring(body) + by_curve).collect()
    }

    /// Whether dashpots between bodies end where their contact opens, with a jump of the force.
    pub(crate) fn has_dashpots_that_end(&self) -> bool {
        let ends = |contact: &&Contact| contact.tension == Tension::Detach && contact.damping_kg_per_s > 0.0;
        self.all_contacts().iter().any(ends)
    }

    /// The striker at the far end, where there is one.
    pub(crate) fn far_striker(&self) -> Option<&FarStriker> {
        match &self.far_end {
            FarEnd::Struck(far) => Some(far),
            FarEnd::Free | FarEnd::Fixed => None,
        }
    }

    /// Every contact that is not like another, those of strikers included.
    pub(crate) fn all_contacts(&self) -> Vec<&Contact> {
        let of_far = self.far_striker().and_then(|far| far.contact.as_ref());
        self.contact.all().into_iter().chain(of_far).collect()
    }

    /// Whether a dashpot takes energy from the bodies once the striker has left.
    pub(crate) fn is_damped(&self) -> bool {
        let gaps = 0..self.n_bodies();
        let between = gaps.into_iter().any(|gap| self.contact.of_gap(gap).damping_kg_per_s > 0.0);
        between || self.damping_kg_per_s.iter().any(|&c| c > 0.0)
    }

    /// Refuses a chain whose lists differ in length or whose parameters have no meaning.
    pub(crate) fn check(&self) -> Result<(), MechanicsError> {
        let n = self.n_bodies();
        check::require(n > 0, "number of bodies", "at least 1", n as f64)?;
        check::length("damping_kg_per_s", n, self.damping_kg_per_s.len())?;
        check::each_body("mass_kg", &self.mass_kg, check::positive)?;
        check::each_body("damping_kg_per_s", &self.damping_kg_per_s, check::not_negative)?;
        let grounded = &self.ground_stiffness_n_per_m;
        check::length("ground_stiffness_n_per_m", if grounded.is_empty() { 0 } else { n }, grounded.len())?;
        check::each_body("ground_stiffness_n_per_m", grounded, check::not_negative)?;
        self.contact.check(n)?;
        self.drive.check(n)?;
        self.far_striker().map_or(Ok(()), |far| far.check(n))
    }
}

impl Drive {
    fn check(&self, n_bodies: usize) -> Result<(), MechanicsError> {
        match self {
            Self::Striker(striker) => striker.check("striker"),
            Self::Imposed(_) => Ok(()),
            Self::Free { displacement_m, velocity_m_per_s } => {
                check::length("initial displacement_m", n_bodies, displacement_m.len())?;
                check::length("initial velocity_m_per_s", n_bodies, velocity_m_per_s.len())?;
                check::each_body("initial displacement_m", displacement_m, check::finite)?;
                check::each_body("initial velocity_m_per_s", velocity_m_per_s, check::finite)
            }
        }
    }
}

impl Striker {
    /// The striker of the paper at its largest velocity, with a contact damped by 0.2 kg/s.
    pub const OF_RINGS: Self =
        Self { mass_kg: 4.3e-3, velocity_m_per_s: 2.73, damping_kg_per_s: 0.2, ground_damping_kg_per_s: 0.0 };

    fn check(&self, name: &str) -> Result<(), MechanicsError> {
        check::positive(format!("{name} mass_kg"), self.mass_kg)?;
        check::not_negative(format!("{name} velocity_m_per_s"), self.velocity_m_per_s)?;
        check::not_negative(format!("{name} damping_kg_per_s"), self.damping_kg_per_s)?;
        check::not_negative(format!("{name} ground_damping_kg_per_s"), self.ground_damping_kg_per_s)
    }
}

impl FarStriker {
    fn check(&self, n_bodies: usize) -> Result<(), MechanicsError> {
        // Both strikers' dashpots would hold the same body, whose flow the symplectic methods know for one alone.
        let several = "at least 2 with a far striker";
        check::require(n_bodies > 1, "number of bodies", several, n_bodies as f64)?;
        self.striker.check("far striker")?;
        check::not_negative("far striker distance_m", self.distance_m)?;
        self.contact.as_ref().map_or(Ok(()), |contact| contact.check("contact of the far striker"))
    }
}
