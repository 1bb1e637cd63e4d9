//! An experiment as a library: its configuration, and the way from its recordings to tracks, motion, wave quantities and fitted damping.
//!
//! A [`Setup`] is an experiment with everything that was read for it. [`Setup::run`] goes the whole way: [`check`] looks whether it makes
//! sense, [`track`] follows bodies through the recordings and keeps what it found in a [`TrackStore`]; [`Setup::conclude`] stitches,
//! measures, fits, compares with a truth where there is one, and decides what was modelled; [`plan()`] says before a frame is filmed how
//! uncertain its results will be. The crate knows neither a command line nor a
//! terminal, no clock, no table format and no page: progress leaves it through a [`Monitor`], warnings and failures as values.
//!
//! ```
//! use std::num::NonZero;
//! use std::path::Path;
//!
//! use chainwave_experiment::{MemoryStore, Monitor, Setup};
//! # use chainwave_experiment::film_experiment;
//! # let experiment = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/small-experiment/experiment.toml"));
//! # let filmed = tempfile::tempdir()?;
//! # let recordings = filmed.path();
//! # let setup = Setup::read(experiment, None)?;
//! # let two = NonZero::new(2).ok_or("two")?;
//! # film_experiment(&setup.experiment, &setup.table, experiment, recordings, two, &Monitor::SILENT)?;
//!
//! let setup = Setup::read(experiment, Some(recordings))?;
//! let n_threads = std::thread::available_parallelism().unwrap_or(NonZero::<usize>::MIN);
//! let results = setup.run(&MemoryStore::default(), n_threads, &Monitor::SILENT)?;
//! let c_g = results.evaluation.measurement.group_velocity.map_err(|missing| missing.as_str())?.velocity_m_per_s;
//! println!("c_g = {:.3} +- {:.3} m/s", c_g.value, c_g.sigma);
//! # // A pulse of compression in a softening chain is slower than sound, and in so slow a strike not by half.
//! # let pitch_m = setup.experiment.chain.mean_pitch_m();
//! # let sound_m_per_s = setup.experiment.linear_chain()?.sound_speed_m_per_s(pitch_m);
//! # assert!((0.5 * sound_m_per_s..sound_m_per_s).contains(&c_g.value), "{c_g:?}, sound {sound_m_per_s}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod camera;
mod chain;
mod configuration;
mod corrections;
mod error;
mod evaluation;
mod film;
mod finding;
mod fitting;
mod geometry;
mod input;
mod merging;
mod monitor;
mod plan;
mod recordings;
mod results;
mod review;
mod sanity;
mod setup;
mod summaries;
mod tables;
mod timing;
mod tracked;
mod tracking;
mod tracks;
mod wording;

pub use camera::calibration::{CalibrationFile, ChainMap, ErrorTable, MapTable};
pub use camera::sensor::SensorFiles;
pub use chain::measuring::measure_motion;
pub use chain::scene::{BandPoint, ChainScene, n_kappa};
pub use configuration::{
    Analysis, BodyState, Camera, Chain, Contact, ContactTable, DriveTable, Experiment, FAULT_KINDS,
    FarEndTable, FarStrikerTable, Fault, FilmedRings, FilmedView, Gaps, GroundTable, Law, Marks, Pattern,
    Ruler, Striker, Synthetic, Tracking, Trial, Trigger, TrueChain, imposed_motion,
};
pub use corrections::{
    CORRECTIONS_FILE, Correction, Corrections, CorrectionsSource, Remedy, corrections_csv,
};
pub use error::Error;
pub use evaluation::decisions::Decision;
pub use evaluation::recording_alignment::{RecordingAlignment, RecordingAlignments};
pub use evaluation::strikers::{StrikerWave, WaveSource, compare_strikers, speed_exponent};
pub use evaluation::truth::{FILMED, KnownTruth, TRUTH};
pub use evaluation::{EVALUATION_VERSION, Evaluation, evaluate};
pub use film::{
    CameraEffect, FilmTruth, MeanMotion, OtherChain, Protocol, StrikerTruth, TrueTrial, Truth, WrongChain,
    film_experiment, ring_centres,
};
pub use finding::{Finding, LeftOutRecording, Sanity};
pub use fitting::damping::{BEHIND_BODY_1, ITS_C_D, PEAK_ENERGIES, RELEASE, StatedDamping, TRACKS};
pub use fitting::fits::Departures;
pub use fitting::model_beside::ModelBeside;
pub use geometry::stages::Stages;
pub use input::content::fingerprint;
pub use input::numbers::{NotNegative, Positive};
pub use input::table::{Column, Table};
pub use input::text_file::{parse_toml, read_text, read_toml};
pub use merging::side_motion::SideMotion;
pub use monitor::{Monitor, Progress, Stage};
pub use plan::{
    Aim, Cost, DampingBound, Economy, Forecast, LargestSigma, Outlook, Plan, PlannedChange, PlannedResult,
    Precision, VarianceShare, damping_bound, economy, foreseen, outcome, plan, typical_half_width,
};
pub use recordings::failed_recording::FailedRecording;
pub use recordings::recording_state::{RecordingState, State, recording_states};
pub use recordings::unreadable_frames::unreadable_frames;
pub use recordings::view::{PlannedView, View, first_view, planned_view, unreadable};
pub use results::Results;
pub use review::{Doubt, DoubtfulReading, ReviewedRecording, review_queue};
pub use sanity::{LeftRest, check, check_share, first_to_leave_rest};
pub use setup::{HeldRecordings, Setup};
pub use summaries::{RecordingSummary, SimulationSummary};
pub use tables::field::field_table;
pub use tables::motion::{motion_by_model_table, motion_table};
pub use tables::pulses::pulse_table;
pub use tables::result_table::{ResultTable, Values};
pub use tables::simulated::simulated_table;
pub use tables::tracks::{TRACK_COLUMNS, TrackRows};
pub use tables::wave::{
    dispersion_table, energy_table, front_table, half_width_table, spectrum_table, strain_table,
};
pub use timing::unresolved::add_unresolved_motion;
pub use tracked::{Origin, Tracked, TrackedRecording};
pub use tracking::follow::{Followed, FollowedSubset, follow, threads_of_each};
pub use tracking::key::TrackKey;
pub use tracking::matching::{MethodChoice, NamedMatching, USUAL_ERROR_PX};
pub use tracking::picture_field::{FieldRequest, FoundField};
pub use tracking::points::{FollowedPoints, PlacedPoint, PlacedSubset, PointTracking, subsets_in};
pub use tracking::share::Share;
pub use tracking::shot::{LookedAt, Shot};
pub use tracking::store::{Kept, MemoryStore, TrackStore};
pub use tracking::{TrackedShare, track, track_share};
pub use tracks::{FollowedBody, RecordingTracks};
