//! What could be done otherwise: more trials, another rate, less noise, numbers that are known better.

use super::rehearsal::Rehearsal;
use super::schedule::Schedule;
use crate::camera::calibration::ChainMap;
use crate::configuration::Experiment;
use crate::error::Error;
use crate::input::numbers::{NotNegative, Positive};

/// A change of a plan, one that halves or doubles something.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Change {
    Trials,
    Rate,
    View,
    Noise,
    StrikerScatter,
    Stated(Stated),
}

/// A number that an experiment states within an uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stated {
    Scale,
    ScaleOfViews,
    Pitch,
    BodyMass,
    StrikerMass,
    ContactLaw,
    Ground,
    MassScatter,
    StiffnessScatter,
}

impl Change {
    const ALL: [Self; 14] = [
        Self::Trials,
        Self::Rate,
        Self::View,
        Self::Noise,
        Self::StrikerScatter,
        Self::Stated(Stated::Scale),
        Self::Stated(Stated::ScaleOfViews),
        Self::Stated(Stated::Pitch),
        Self::Stated(Stated::BodyMass),
        Self::Stated(Stated::StrikerMass),
        Self::Stated(Stated::ContactLaw),
        Self::Stated(Stated::Ground),
        Self::Stated(Stated::MassScatter),
        Self::Stated(Stated::StiffnessScatter),
    ];

    /// The changes that a plan can have, each with the plan as it then is.
    ///
    /// # Errors
    /// A calibration that cannot be read again.
    pub(super) fn of(plan: &Rehearsal) -> Result<Vec<(Self, Rehearsal)>, Error> {
        let changed = Self::ALL.into_iter().map(|change| Ok(change.made(plan)?.map(|made| (change, made))));
        changed.filter_map(Result::transpose).collect()
    }

    /// The plan with this change; `None` where there is nothing to change.
    fn made(self, plan: &Rehearsal) -> Result<Option<Rehearsal>, Error> {
        let with = |schedule: Schedule| {
            let mut changed = plan.clone();
            changed.setup.trials = schedule.trials();
            changed.schedule = schedule;
            changed
        };
        Ok(match self {
            Self::Trials => Some(with(plan.schedule.with_twice_the_trials())),
            Self::Rate => Some(with(plan.schedule.at_twice_the_rate())),
            Self::View => plan.schedule.with_a_view_more().map(with),
            Self::Noise => Some(Rehearsal { readings: plan.readings.times(0.5), ..plan.clone() }),
            Self::StrikerScatter => {
                let mut changed = plan.clone();
                let experiment = &mut changed.setup.experiment;
                experiment.state_drive_scatter(Positive::try_from(0.5 * experiment.drive_scatter()).ok());
                Some(changed)
            }
            Self::Stated(stated) => {
                let mut changed = plan.clone();
                let setup = &mut changed.setup;
                match stated.halve(&mut setup.experiment) {
                    true => {
                        setup.map = ChainMap::read(&setup.experiment, &setup.path)?;
                        Some(changed)
                    }
                    false => None,
                }
            }
        })
    }

    /// What is done, in words.
    pub(super) fn in_words(self, plan: &Rehearsal) -> String {
        let schedule = &plan.schedule;
        let (n_trials, n_views) = (schedule.trials_a_view(), schedule.n_views());
        match self {
            Self::Trials => format!("{} trials of each view instead of {n_trials}", 2 * n_trials),
            Self::Rate => "twice the frame rate, with as much light in a frame".into(),
            Self::View => format!("{} views over the same way instead of {n_views}", n_views + 1),
            Self::Noise => "half the noise: four times the light, or speckles of twice the contrast".into(),
            Self::StrikerScatter => match plan.setup.experiment.driven_otherwise() {
                Some(_) => "a drive that repeats twice as well".into(),
                None => "a striker that repeats twice as well".into(),
            },
            Self::Stated(stated) => format!("{} known twice as well", stated.in_words()),
        }
    }

    /// The source of error that it halves; `None` of one that repeats measurements.
    pub(super) fn halves(self) -> Option<&'static str> {
        match self {
            Self::Trials | Self::Rate | Self::View => None,
            Self::Noise => Some("noise of the pictures"),
            Self::StrikerScatter => Some("scatter of the striker"),
            Self::Stated(stated) => Some(stated.in_words()),
        }
    }
}

impl Stated {
    fn in_words(self) -> &'static str {
        match self {
            Self::Scale => "the scale of the pictures",
            Self::ScaleOfViews => "the scale of each view",
            Self::Pitch => "the pitch",
            Self::BodyMass => "the bodies' mass",
            Self::StrikerMass => "the striker's mass",
            Self::ContactLaw => "the contact law",
            Self::Ground => "the springs to ground",
            Self::MassScatter => "the mass of each body",
            Self::StiffnessScatter => "the stiffness of each gap",
        }
    }

    /// Halves its uncertainty; whether there was one.
    fn halve(self, experiment: &mut Experiment) -> bool {
        let (chain, camera) = (&mut experiment.chain, &mut experiment.camera);
        match self {
            Self::Scale => {
                let of_ruler = camera
                    .ruler
                    .as_mut()
                    .is_some_and(|ruler| halve(&mut ruler.sigma_px) | halve(&mut ruler.length_sigma_m));
                let of_marks = camera.marks.as_mut().is_some_and(|marks| halve(&mut marks.sigma_px));
                of_ruler | of_marks | halve_stated(&mut camera.scale_sigma_px_per_m)
            }
            Self::ScaleOfViews => {
                camera.view_scale_sigma = camera.view_scale_sigma.map(|sigma| Positive(0.5 * sigma.get()));
                camera.view_scale_sigma.is_some()
            }
            Self::Pitch => halve_stated(&mut chain.pitch_sigma_m),
            Self::BodyMass => halve_stated(&mut chain.mass_sigma_kg),
            Self::StrikerMass => {
                experiment.striker.as_mut().is_some_and(|striker| halve_stated(&mut striker.mass_sigma_kg))
            }
            Self::ContactLaw => {
                let sigmas = experiment.contact.relative_sigmas();
                experiment.contact.state_sigmas(sigmas.map(|sigma| 0.5 * sigma));
                sigmas.iter().any(|sigma| *sigma > 0.0)
            }
            Self::Ground => halve_stated(&mut chain.ground_stiffness_sigma_n_per_m),
            Self::MassScatter => halve_stated(&mut chain.mass_scatter),
            Self::StiffnessScatter => halve_stated(&mut experiment.contact.stiffness_scatter),
        }
    }
}

fn halve_stated(sigma: &mut Option<NotNegative>) -> bool {
    sigma.as_mut().is_some_and(halve)
}

fn halve(sigma: &mut NotNegative) -> bool {
    let is_stated = sigma.get() > 0.0;
    *sigma = sigma.half();
    is_stated
}
