//! Films of an experiment whose truth is known: what is drawn for each trial, the motion it makes, and the recording.

mod camera_effects;
mod faults;
mod other_chains;
mod protocols;
mod resisted;
mod rings;
mod truth;
mod wrong_chains;

use std::num::NonZero;
use std::path::Path;

use chainwave_measurement::{Estimate, Trajectory, map_in_parallel};
use chainwave_mechanics::{Chain, Contacts, Resistance, Schedule};
use chainwave_synthetic::trials::{
    BodyQuantity, Draw, Scatter, body_factors, draw, stage_error_m, view_trigger_s,
};
use chainwave_synthetic::{FileFaults, Scene, Shot, Specimen, film};

pub use self::camera_effects::CameraEffect;
use self::faults::Faults;
pub use self::other_chains::OtherChain;
pub use self::protocols::Protocol;
use self::resisted::resisted;
pub use self::rings::ring_centres;
pub use self::truth::{MeanMotion, StrikerTruth, TrueTrial, Truth};
pub use self::wrong_chains::WrongChain;
use crate::camera::calibration::ChainMap;
use crate::configuration::{self, Experiment, Synthetic, Trial};
use crate::error::Error;
use crate::monitor::{Monitor, Stage};

/// The truth behind a film.
pub struct FilmTruth {
    /// What stands for all sound trials.
    pub parameters: Truth,
    /// The mean motion of the sound trials, for each nominal striker velocity.
    pub motions: Vec<MeanMotion>,
    /// What was drawn for each trial.
    pub trials: Vec<TrueTrial>,
    /// The bodies' masses, in kilograms.
    pub masses_kg: Vec<f64>,
    /// Whether a striker drives the chain; otherwise its velocities above are strengths of another drive over the stated one.
    pub is_struck: bool,
}

impl Experiment {
    /// Refuses an experiment that cannot be filmed: without a synthetic part, or with faults of recordings, or views, that are not in the
    /// table.
    ///
    /// # Errors
    /// What is missing; `path` is where the experiment lies.
    pub fn check_film(&self, trials: &[Trial], path: &Path) -> Result<&Synthetic, Error> {
        let synthetic = self.synthetic.as_ref().ok_or_else(|| Error::Configuration {
            path: path.to_owned(),
            message: "expected a [synthetic] part that says what is filmed, found none".into(),
        })?;
        Faults(&synthetic.faults).check(trials, path)?;
        synthetic.check_views(trials, path)?;
        if self.camera.marks.is_some() && ChainMap::read(self, path)?.goes_left() {
            return Err(Error::Configuration {
                path: path.to_owned(),
                message: "camera.marks: films show chains that go to the right, and by these it goes to the left (hint: count their columns, and \
                          first_body_px, from the other side)"
                    .into(),
            });
        }
        Ok(synthetic)
    }
}

/// Films every recording of a trials table into a folder, and returns the truth behind them. A recording that is there already is kept.
///
/// `path` is where the experiment lies, for messages.
///
/// # Errors
/// An experiment without a synthetic part, faults of recordings that are not in the table, a chain or camera that cannot be computed,
/// files that cannot be written, or the caller asked to stop.
pub fn film_experiment(
    experiment: &Experiment,
    trials: &[Trial],
    path: &Path,
    folder: &Path,
    n_threads: NonZero<usize>,
    monitor: &Monitor<'_>,
) -> Result<FilmTruth, Error> {
    let synthetic = experiment.check_film(trials, path)?;
    synthetic.camera.check()?;
    let studio = Studio::new(experiment, synthetic)?;
    let takes = studio.takes(trials)?;
    let mut truth = studio.truth(&takes);
    monitor.planned(Stage::Filming, trials.len() as u64);
    let filmed = |take: &Take<'_>| -> Result<Trajectory, Error> {
        if (monitor.is_cancelled)() {
            return Err(Error::Cancelled { n_done: 0, n: takes.len() });
        }
        let motion = studio.motion(&take.draw)?;
        studio.film(take, &motion, folder).inspect(|()| monitor.done(Stage::Filming, 1))?;
        Ok(motion)
    };
    let every: Vec<&Take<'_>> = takes.iter().collect();
    let filmed = one_after_the_other(&every, n_threads, filmed, |take, motion| truth.add(take, &motion));
    monitor.ended(Stage::Filming);
    filmed?;
    Ok(truth.finished())
}

/// Works out the motion of each take and hands it on in the takes' order. No more motions are held at a time than there are threads: one is as large as the
/// chain is long, and is filmed for as long as its wave runs. A take that fails does not keep the others from their turn; the first failure is told.
fn one_after_the_other<T: Copy + Sync, M: Send + Sync>(
    takes: &[T],
    n_threads: NonZero<usize>,
    motion_of: impl Fn(T) -> Result<M, Error> + Sync,
    mut hand_on: impl FnMut(T, M),
) -> Result<(), Error> {
    let mut first = Ok(());
    for together in takes.chunks(n_threads.get()) {
        let motions = map_in_parallel(together.len(), n_threads, |i| motion_of(together[i]));
        for (take, motion) in together.iter().zip(motions) {
            match motion {
                Ok(motion) => hand_on(*take, motion),
                Err(why) => first = first.and(Err(why)),
            }
        }
    }
    first
}

/// The chain that is filmed, and how.
pub(crate) struct Studio<'a> {
    experiment: &'a Experiment,
    synthetic: &'a Synthetic,
    contact: Contacts,
    masses_kg: Vec<f64>,
    /// The bodies as far apart as the chain states, where it does so gap by gap.
    specimen: Specimen,
}

/// One trial as it really was.
pub(crate) struct Take<'a> {
    trial: &'a Trial,
    draw: Draw,
    /// What the experiment takes its striker velocity for.
    nominal_m_per_s: f64,
    /// Where the stage really stands.
    stage_m: f64,
}

impl<'a> Studio<'a> {
    pub(crate) fn new(experiment: &'a Experiment, synthetic: &'a Synthetic) -> Result<Self, Error> {
        let chain = &experiment.chain;
        let masses_kg = chain.masses_kg()?;
        let scatter = synthetic.mass_sigma_kg.get() / chain.mean_mass_kg();
        let stiffness_scatter = synthetic.stiffness_scatter.get();
        if synthetic.rings.is_some() && scatter + stiffness_scatter > 0.0 {
            return Err(Error::Value(
                "[synthetic] mass_sigma_kg, stiffness_scatter: expected 0 with [synthetic.rings], whose rings are all alike, \
                 found more"
                    .into(),
            ));
        }
        let factors = body_factors(synthetic.seed, BodyQuantity::Mass, chain.n_bodies, scatter)?;
        let stiffness =
            body_factors(synthetic.seed, BodyQuantity::Stiffness, chain.n_bodies, stiffness_scatter)?;
        let mut specimen = synthetic.specimen.clone();
        let unequal_m = experiment.unequal_gaps_at_rest_m()?;
        if !unequal_m.is_empty() {
            specimen.gaps_m = unequal_m;
        }
        Ok(Self {
            specimen,
            experiment,
            synthetic,
            contact: scattered(experiment.contact.contacts(chain.n_bodies)?, stiffness_scatter, &stiffness),
            masses_kg: factors.iter().zip(&masses_kg).map(|(factor, mass_kg)| factor * mass_kg).collect(),
        })
    }

    fn faults(&self) -> Faults<'a> {
        Faults(&self.synthetic.faults)
    }

    /// Draws every trial.
    pub(crate) fn takes<'b>(&self, trials: &'b [Trial]) -> Result<Vec<Take<'b>>, Error> {
        let scatters: Vec<Scatter> = trials.iter().map(|trial| self.scatter(trial)).collect();
        let mut draws = draw(self.synthetic.seed, &scatters)?;
        if let Some(noise_seed) = self.synthetic.noise_seed {
            let others = draw(noise_seed, &scatters)?;
            draws.iter_mut().zip(others).for_each(|(own, other)| own.noise_seed = other.noise_seed);
        }
        trials.iter().zip(draws).map(|(trial, draw)| self.take(trial, draw)).collect()
    }

    fn take<'b>(&self, trial: &'b Trial, mut draw: Draw) -> Result<Take<'b>, Error> {
        let (seed, view) = (self.synthetic.seed, trial.view.into());
        draw.striker_velocity_m_per_s *=
            self.faults().striker_factor(trial) * self.synthetic.drive_factor(trial.view);
        draw.trigger_delay_s += view_trigger_s(seed, view, self.synthetic.trigger_view_s.get())?;
        Ok(Take {
            nominal_m_per_s: self.nominal(trial).value,
            stage_m: trial.stage_m + stage_error_m(seed, view, self.synthetic.stage_sigma_m.get())?,
            trial,
            draw,
        })
    }

    fn scatter(&self, trial: &Trial) -> Scatter {
        let nominal_m_per_s = self.nominal(trial);
        let own_scatter = self.synthetic.striker_scatter.map(|scatter| scatter.get() * nominal_m_per_s.value);
        Scatter {
            striker_velocity_m_per_s: nominal_m_per_s.value,
            striker_velocity_sigma_m_per_s: own_scatter.unwrap_or(nominal_m_per_s.sigma),
            trigger_jitter_s: self.synthetic.trigger_jitter_s.get(),
            trigger_walk_s: self.synthetic.trigger_walk_s.get(),
            rate_hz: self.synthetic.footage(trial.view).rate_hz,
        }
    }

    /// The striker velocity that the trials table names, else the strength of the experiment's drive, with its scatter.
    fn nominal(&self, trial: &Trial) -> Estimate {
        trial.striker_velocity_m_per_s.unwrap_or_else(|| self.experiment.nominal_drive())
    }

    /// Films a trial, unless its recording is there or lost.
    fn film(&self, take: &Take, motion: &Trajectory, folder: &Path) -> Result<(), Error> {
        let faults = self.faults();
        let path = folder.join(faults.file_name(take.trial));
        if path.exists() || faults.is_lost(take.trial) {
            return Ok(());
        }
        if let Some(beside) = path.parent() {
            // A name may lead into a folder within.
            std::fs::create_dir_all(beside).map_err(Error::file(beside, "make the folder"))?;
        }
        let footage = self.synthetic.footage(take.trial.view);
        let camera = footage.camera(&self.synthetic.camera);
        let specimen = footage.specimen(&self.specimen);
        let shot = Shot {
            stage_m: take.stage_m,
            first_body_px: footage.moved_px(self.experiment.camera.first_body_px, &camera),
            first_image: footage.first_image,
            n_frames: footage.n_frames,
            trigger_delay_s: take.draw.trigger_delay_s,
            frame_phase_s: take.draw.frame_phase_s,
            noise_seed: take.draw.noise_seed,
            covers: faults.covers(take.trial),
            view: take.trial.view.into(),
        };
        let scene = Scene::new(&camera, &specimen, &shot, motion)?;
        let rings = self.synthetic.rings.as_ref();
        let shapes = rings.map(|rings| rings.shapes(self, &take.draw)).transpose()?;
        let scene = match &shapes {
            Some(shapes) => scene.with_shapes(shapes)?,
            None => scene,
        };
        let clock_rate_hz = self.synthetic.stated_rate_hz(take.trial.view);
        Ok(film(&path, &scene, &FileFaults { clock_rate_hz, ..faults.of_file(take.trial) })?)
    }

    fn motion(&self, draw: &Draw) -> Result<Trajectory, Error> {
        if let Some(rings) = &self.synthetic.rings {
            self.expect_no_far_striker("[synthetic.rings]: expected none")?;
            self.expect_plainly_struck()?;
            return rings.motion(self, draw);
        }
        let (duration_s, interval_s) = (self.last_time_s() + 1e-3, self.synthetic.truth_interval_s());
        let dampings = [self.synthetic.damping_kg_per_s.get(), self.synthetic.c_s_kg_per_s()];
        let stated = self.experiment.chain_driven(draw.striker_velocity_m_per_s, dampings, duration_s)?;
        let chain = Chain { mass_kg: self.masses_kg.clone(), contact: self.contact.clone(), ..stated };
        if let (Some(truth), Some(drive)) = (&self.synthetic.chain, self.experiment.driven_otherwise()) {
            truth.expect_no_striker_held_back(drive)?;
        }
        let (model, resistance) = match &self.synthetic.chain {
            Some(truth) => (truth.of(chain), truth.resistance()),
            None => (chain, Resistance::default()),
        };
        if resistance != Resistance::default() {
            self.expect_no_far_striker(
                "[synthetic.chain] friction_n, drag_kg_per_m, striker_friction_n: expected 0",
            )?;
            return resisted(&model, resistance, duration_s, interval_s);
        }
        let schedule = Schedule::automatic(duration_s, interval_s);
        Ok(self.experiment.seen_from_rest(chainwave_mechanics::simulate(&model, &schedule)?.trajectory))
    }

    /// Refuses a far striker where what is asked for knows none.
    fn expect_no_far_striker(&self, expected: &str) -> Result<(), Error> {
        match self.experiment.far_striker {
            Some(_) => Err(Error::Value(format!("{expected} with [far_striker], found it beside one"))),
            None => Ok(()),
        }
    }

    /// Refuses what rings do not know.
    fn expect_plainly_struck(&self) -> Result<(), Error> {
        let refuse = |what: &str| {
            Err(Error::Value(format!(
                "[synthetic.rings]: expected a chain that a striker drives and nothing holds to ground, found {what}"
            )))
        };
        match self.experiment.driven_otherwise() {
            Some(drive) => refuse(drive),
            None if self.experiment.ground.is_some() => refuse("[ground]"),
            None if self.experiment.chain.ground_stiffness_n_per_m.is_some() => {
                refuse("chain.ground_stiffness_n_per_m")
            }
            None => Ok(()),
        }
    }

    /// Time that no image reaches, in seconds after the trigger.
    fn last_time_s(&self) -> f64 {
        self.synthetic.span_s()[1]
    }
}

/// Where the bodies of a chain rest, in metres from the first one.
fn rests_m(chain: &configuration::Chain) -> Result<Vec<f64>, Error> {
    let spacing = chain.spacing()?;
    Ok((1..).take(chain.n_bodies).map(|body| spacing.of_body_m(body)).collect())
}

/// The contacts of bodies whose stiffnesses scatter: a gap is half of either neighbour, in series.
fn scattered(contacts: Contacts, scatter: f64, stiffness: &[f64]) -> Contacts {
    if scatter <= 0.0 {
        return contacts;
    }
    let mut each = contacts.one_by_one(stiffness.len().saturating_sub(1));
    for (gap, pair) in stiffness.windows(2).enumerate() {
        let factor = 2.0 / (pair[0].recip() + pair[1].recip());
        each.change_gap(gap, |contact| contact.law = contact.law.times(factor));
    }
    each
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    /// Counts those of its kind that are held.
    struct Motion<'a>(usize, &'a AtomicUsize);

    impl Drop for Motion<'_> {
        fn drop(&mut self) {
            self.1.fetch_sub(1, Ordering::SeqCst);
        }
    }

    #[test]
    fn no_more_motions_are_held_than_there_are_threads() {
        for n_threads in [1, 2, 3] {
            let (held, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
            let takes: Vec<usize> = (0..10).collect();
            let motion_of = |take: usize| {
                if take == 5 {
                    return Err(Error::Value("no motion".into()));
                }
                most.fetch_max(held.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                Ok(Motion(take, &held))
            };
            let mut order = Vec::new();
            let n_threads = NonZero::new(n_threads).unwrap();
            let told = one_after_the_other(&takes, n_threads, motion_of, |take, motion| {
                assert_eq!(take, motion.0);
                order.push(take);
            });
            assert!(told.is_err_and(|why| why.to_string().contains("no motion")));
            assert_eq!(order, [0, 1, 2, 3, 4, 6, 7, 8, 9]);
            assert!(most.into_inner() <= n_threads.get());
        }
    }
}
