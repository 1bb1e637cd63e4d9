//! The merged motion, with every error that belongs to it, from drives and offsets that are known.

use chainwave_measurement::{ChainMotion, Estimate, both_in_parallel, map_in_parallel};
use ndarray::Array2;

use crate::body_response::Contribution;
use crate::by_view::LeftByView;
use crate::clocks::ClockShown;
use crate::error::StitchingError;
use crate::fitted::Fitted;
use crate::fitted_body::{FittedBody, FittedTime};
use crate::gauge::scale_and_delay;
use crate::modes::{AlignmentDirection, AlignmentErrors};
use crate::shown::ShownByBody;
use crate::spread::Spread;
use crate::state::AlignmentState;
use crate::stitched::Alignment;

/// The merged motion, with what was found along with it.
pub(crate) struct Assembled {
    pub(crate) motion: ChainMotion,
    pub(crate) alignments: Vec<Alignment>,
    pub(crate) spread: Spread,
    /// What one unit of mean drive and mean trigger changes of the motion.
    pub(crate) of_means_m: [Array2<f64>; 2],
    /// What bodies show of the errors that were asked for.
    pub(crate) shown: Vec<ShownByBody>,
    pub(crate) clocks: Vec<ClockShown>,
    pub(crate) left_by_views: Vec<LeftByView>,
}

impl AlignmentState<'_> {
    /// The motion on the present time base, and where each recording stands.
    pub(crate) fn assembled(&self, errors: &AlignmentErrors) -> Result<Assembled, StitchingError> {
        let field = &self.responses_when_aligned()?;
        let n_threads = self.settings.n_threads;
        let ratio = |row: usize| self.scatter_ratio(&field[row], |_| true).max(1.0);
        let ratios = map_in_parallel(field.len(), n_threads, ratio);
        let beside_motion = || {
            // What is asked for beside the motion ends no merging.
            let shown = self.shown(field).unwrap_or_default();
            let clocks = match self.settings.asks_for_clocks {
                true => self.clocks(field).unwrap_or_default(),
                false => Vec::new(),
            };
            (shown, clocks, self.left_by_views(field, &ratios), self.spread(field, &ratios))
        };
        let ((shown, clocks, left_by_views, spread), (motion, alignments, of_means_m)) =
            both_in_parallel(n_threads, beside_motion, || self.moved(field, errors, &ratios));
        Ok(Assembled { motion, alignments, spread, of_means_m, shown, clocks, left_by_views })
    }

    /// The motion, where each recording stands, and what one unit of mean drive and mean trigger changes of the motion; `ratios` are the residuals'
    /// rms over what the trackers' sigma lets expect, by body.
    fn moved(
        &self,
        field: &Fitted,
        errors: &AlignmentErrors,
        ratios: &[f64],
    ) -> (ChainMotion, Vec<Alignment>, [Array2<f64>; 2]) {
        let shape = (self.settings.n_bodies, self.times_s.len());
        let n_threads = self.settings.n_threads;
        let directions = self.alignment_directions(field, errors);
        let effects = self.effects(field);
        let of_means_m = self.effects_of_means(&effects);
        let modes = self.error_modes(field, &directions, effects);
        let mut motion = ChainMotion {
            times_s: self.times_s.clone(),
            displacement_m: Array2::from_elem(shape, None),
            independent_sigma_m: Array2::zeros(shape),
            modes,
            n_trials: Array2::zeros(shape),
        };
        let of_rows = map_in_parallel(field.len(), n_threads, |row| {
            let shared_m2 = motion.modes.variance_m2(&[(row, 1.0)]);
            let noise_m2 = self.noise_m2(&field[row], ratios[row]);
            shared_m2.into_iter().zip(noise_m2).collect::<Vec<_>>()
        });
        for (row, of_row) in of_rows.into_iter().enumerate() {
            for (i, (shared_m2, [noise_m2, of_frames_m2])) in of_row.into_iter().enumerate() {
                let FittedTime { contributions, response } = field[row].at(i);
                if contributions.is_empty() {
                    continue;
                }
                let sigma_m = (noise_m2 + shared_m2).sqrt();
                motion.displacement_m[(row, i)] = Some(Estimate::new(response.motion_m, sigma_m));
                motion.independent_sigma_m[(row, i)] = of_frames_m2.sqrt();
                motion.n_trials[(row, i)] = contributions.len() as u32;
            }
        }
        let scale_sigma = errors.exchange.scale_sigma.unwrap_or(0.0);
        let bent_delay_s = self.bent_delay_s(field);
        let alignments = map_in_parallel(self.observations.len(), n_threads, |r| {
            self.alignment(r, field, &directions, scale_sigma, bent_delay_s)
        });
        (motion, alignments, of_means_m)
    }

    /// Variances that the readings' noise, so many times what is stated, gives a body's motion at each time, in square metres: between frames,
    /// and as noise that is independent from time to time, which adds up over many to as much: that of frames, times how many times share one.
    fn noise_m2(&self, of_body: &FittedBody, ratio: f64) -> Vec<[f64; 2]> {
        let of_time = |FittedTime { contributions, response }: FittedTime<'_>| {
            let noise_m2 = |gain: fn(&Contribution) -> f64| {
                let part =
                    |c: &Contribution| (response.gain(c, &self.drive) * c.read.sigma).powi(2) * gain(c);
                ratio.powi(2) * contributions.iter().map(part).sum::<f64>()
            };
            [noise_m2(|c| c.read.noise_gain), noise_m2(|c| c.n_shared)]
        };
        of_body.times().map(of_time).collect()
    }

    fn alignment(
        &self,
        r: usize,
        field: &Fitted,
        directions: &[AlignmentDirection],
        scale_sigma: f64,
        bent_delay_s: f64,
    ) -> Alignment {
        let n = self.observations.len();
        let observation = &self.observations[r];
        let rows = self.displacements[r].iter().map(|displacement| displacement.row);
        let ratios: Vec<f64> =
            rows.map(|row| self.scatter_ratio(&field[row], |c| c.recording == r)).collect();
        let scatter = ratios.iter().map(|ratio| ratio.powi(2)).sum::<f64>() / ratios.len().max(1) as f64;
        let square =
            |unknown: usize| directions.iter().map(move |direction| direction.error[unknown].powi(2));
        let sigma = |unknown: usize| square(unknown).sum::<f64>().sqrt();
        let mean_square = self.drive.iter().map(|s| s * s).sum::<f64>() / n as f64;
        let bent_s = bent_delay_s * (self.drive[r].powi(2) - mean_square).abs();
        Alignment {
            recording: observation.recording.clone(),
            view: observation.view,
            trial: observation.trial,
            trigger_offset_s: Estimate::new(self.offsets_s[r], sigma(n + r).hypot(bent_s)),
            drive_deviation: Estimate::new(self.drive[r], sigma(r).hypot(scale_sigma * self.drive[r])),
            scatter_ratio: scatter.sqrt(),
        }
    }

    /// Standard deviation of the delay with the square of the drive that the offsets may hold: nothing in the readings tells it, and the
    /// mean motion does not feel it (see [`crate::gauge`]). A pulse that a drive `1 + s` delays by `T(s)` has beta = -T' in its slope and
    /// beta - T''/2 times the velocity in its curvature; a weak non-linearity, which delays in proportion, makes beta of it.
    fn bent_delay_s(&self, field: &Fitted) -> f64 {
        let of_bodies = field.iter().filter(|of_body| of_body.most_at_once() > 2);
        let delays_s: Vec<f64> =
            of_bodies.filter_map(|of_body| Some(scale_and_delay(of_body.times())?.0[1])).collect();
        let squares: f64 = delays_s.iter().map(|delay_s| delay_s.powi(2)).sum();
        BENT_SHARE * (squares / delays_s.len().max(1) as f64).sqrt()
    }
}

/// T''/2 over beta: 0.02 to 0.09 in the bodies of the paper's chain, and 0.5 where T goes with the drive's logarithm.
pub(crate) const BENT_SHARE: f64 = 0.2;
