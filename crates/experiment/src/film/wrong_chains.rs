//! Chains that are not what the experiment states, one of each kind as a laboratory might have it, and the words by which a report names
//! their cause.

use crate::configuration::{Experiment, FarEndTable, TrueChain};
use crate::input::numbers::{NotNegative, Positive};

/// A kind of what a chain has and its model does not say.
#[derive(Debug, Clone, Copy)]
pub struct WrongChain {
    /// Its name.
    pub name: &'static str,
    /// Words of which a warning has to say one for the cause to count as named.
    pub causes: &'static [&'static str],
    add: fn(&mut Experiment),
}

impl WrongChain {
    /// One of each kind, by a little and by much.
    pub const ALL: &'static [Self] = &[
        Self {
            name: "friction",
            causes: &["friction"],
            add: |to| of(to, |chain| chain.friction_n = not_negative(3e-4)),
        },
        Self {
            name: "small_friction",
            causes: &["friction"],
            add: |to| of(to, |chain| chain.friction_n = not_negative(3e-5)),
        },
        Self {
            name: "stiffness",
            causes: STIFFNESS,
            add: |to| of(to, |chain| chain.stiffness_factor = positive(1.0015)),
        },
        Self {
            name: "exponent",
            causes: STIFFNESS,
            add: |to| of(to, |chain| chain.exponent_factor = positive(1.003)),
        },
        Self {
            name: "striker_contact",
            causes: &["striker's contact"],
            add: |to| of(to, |chain| chain.striker_contact_factor = positive(2.0)),
        },
        Self {
            name: "diatomic",
            causes: &["second body"],
            add: |to| of(to, |chain| chain.every_second_mass_factor = positive(2.0)),
        },
        Self {
            name: "nearly_diatomic",
            causes: &["second body"],
            add: |to| of(to, |chain| chain.every_second_mass_factor = positive(1.1)),
        },
        Self {
            name: "damping_between",
            causes: &["damped against"],
            add: |to| of(to, |chain| chain.damping_between_kg_per_s = not_negative(2e-3)),
        },
        Self {
            name: "damped_striker",
            causes: STRIKER,
            add: |to| of(to, |chain| chain.striker_ground_damping_kg_per_s = not_negative(3e-3)),
        },
        Self {
            name: "rubbed_striker",
            causes: STRIKER,
            add: |to| of(to, |chain| chain.striker_friction_n = not_negative(4e-3)),
        },
        Self {
            name: "drag",
            causes: &["drag"],
            add: |to| of(to, |chain| chain.drag_kg_per_m = not_negative(1e-4)),
        },
        Self {
            name: "ground_springs",
            causes: &["springs held"],
            add: |to| of(to, |chain| chain.ground_stiffness_n_per_m = not_negative(0.1)),
        },
        Self {
            name: "damping_grade",
            causes: &["damping changed", "damping scattered"],
            add: |to| of(to, |chain| chain.damping_of_last_body_over_first = positive(1.2)),
        },
        Self {
            name: "wall",
            causes: &["far end"],
            add: |to| of(to, |chain| chain.far_end = Some(FarEndTable::Fixed)),
        },
        Self { name: "mass_scatter", causes: SCATTER, add: |to| scatter_masses(to, false) },
        Self { name: "stated_mass_scatter", causes: &[], add: |to| scatter_masses(to, true) },
        Self { name: "stiffness_scatter", causes: SCATTER, add: |to| scatter_stiffness(to, false) },
        Self { name: "stated_stiffness_scatter", causes: &[], add: |to| scatter_stiffness(to, true) },
        Self { name: "stated_law", causes: &[], add: state_law },
    ];

    /// Films such a chain in place of the stated one; what is known of it is stated.
    pub fn add_to(&self, experiment: &mut Experiment) {
        (self.add)(experiment);
    }
}

/// A stiffness, a mass, a scale and the law's curve do much the same to a wave.
const STIFFNESS: &[&str] = &["stiffness", "another mass", "another curve", "another scale"];
/// A dashpot and friction hold a striker back alike.
const STRIKER: &[&str] = &["carries the striker", "held the striker back"];
const SCATTER: &[&str] = &["scattered", "second body", "does not explain"];

fn of(experiment: &mut Experiment, change: impl FnOnce(&mut TrueChain)) {
    if let Some(synthetic) = &mut experiment.synthetic {
        change(synthetic.chain.get_or_insert_default());
    }
}

pub(super) fn positive(value: f64) -> Option<Positive> {
    Positive::try_from(value).ok()
}

pub(super) fn not_negative(value: f64) -> NotNegative {
    NotNegative::try_from(value).unwrap_or_default()
}

/// The paper's own scatter.
const MASS_SCATTER: f64 = 0.013;

fn scatter_masses(experiment: &mut Experiment, is_stated: bool) {
    let sigma_kg = MASS_SCATTER * experiment.chain.mean_mass_kg();
    if let Some(synthetic) = &mut experiment.synthetic {
        synthetic.mass_sigma_kg = not_negative(sigma_kg);
    }
    experiment.chain.mass_scatter = is_stated.then(|| not_negative(MASS_SCATTER));
}

fn scatter_stiffness(experiment: &mut Experiment, is_stated: bool) {
    const SCATTER: f64 = 0.05;
    if let Some(synthetic) = &mut experiment.synthetic {
        synthetic.stiffness_scatter = not_negative(SCATTER);
    }
    experiment.contact.stiffness_scatter = is_stated.then(|| not_negative(SCATTER));
}

/// A law that is off by about its stated uncertainties.
fn state_law(experiment: &mut Experiment) {
    of(experiment, |chain| {
        (chain.stiffness_factor, chain.exponent_factor) = (positive(1.01), positive(0.995));
    });
    experiment.contact.state_sigmas([0.01, 0.02, 0.01]);
}
