//! Errors of the motion that many samples share: of drives, trigger offsets, places at rest, and of what priors stand in for.

use chainwave_measurement::{ErrorModes, ErrorPattern, ErrorSource, SharedReadingError};
use nalgebra::{DMatrix, DVector};
use ndarray::Array2;

use crate::body_response::Contribution;
use crate::fitted::{Fitted, tells_curvature};
use crate::fitted_body::{FittedBody, FittedTime};
use crate::gauge::Exchange;
use crate::normal_equations::{error_sensitivity, offset_sensitivity};
use crate::reading_error::{RowError, on_time_base};
use crate::response_sizes::ResponseSizes;
use crate::rest::Displacement;
use crate::state::{AlignmentState, Scale};
use crate::stated_response::MISTRUST;

/// What is known of the errors of drives and offsets.
pub(crate) struct AlignmentErrors {
    /// Covariance of (s, tau) from the readings' independent noise, before the gauge was fixed.
    pub(crate) covariance: DMatrix<f64>,
    /// What fixing the gauge did.
    pub(crate) exchange: Exchange,
    /// How far (s, tau) may still have to go, where the alignment did not settle.
    pub(crate) left: Option<DVector<f64>>,
}

/// One independent error of the alignment, of one standard deviation.
pub(crate) struct AlignmentDirection {
    /// Where it comes from.
    source: ErrorSource,
    /// Error of the drives, then of the offsets in seconds.
    pub(crate) error: DVector<f64>,
    /// What is behind it.
    cause: ModeCause,
}

/// What moves an alignment, and the motion beside that.
enum ModeCause {
    /// Nothing that moves the motion otherwise.
    Alignment,
    /// The error of a place at rest.
    PlaceAtRest { recording: usize, row: usize, sigma_m: f64 },
    /// An error that readings of several recordings share.
    Readings(Vec<RowError>),
    /// A power of the drives' deviation that the responses do not have, as errors of the readings; the mean motion has it as well.
    Order { rows: Vec<RowError>, kind: Order },
}

/// A power of the drives' deviation in the stated responses.
#[derive(Debug, Clone, Copy)]
struct Order {
    /// Of those of [`FittedBody::stated_orders_m`], the first is the square.
    index: usize,
    /// Share of what is stated that is not known.
    share: f64,
}

impl Order {
    const ALL: [Self; 2] = [Self { index: 0, share: MISTRUST }, Self { index: 1, share: 1.0 }];

    fn power(self) -> i32 {
        self.index as i32 + 2
    }
}

impl AlignmentState<'_> {
    /// Every displacement error that many samples share: of the alignment and the places at rest, and of what the responses'
    /// priors stand in for. Those of the alignment are sums of its `effects` ([`AlignmentState::effects`]).
    pub(crate) fn error_modes(
        &self,
        field: &Fitted,
        directions: &[AlignmentDirection],
        effects: ErrorModes,
    ) -> ErrorModes {
        let mut modes = effects;
        for direction in directions {
            let by_alignment = direction.error.iter().copied().enumerate().filter(|(_, error)| *error != 0.0);
            let mut parts: Vec<(usize, f64)> = by_alignment.collect();
            match &direction.cause {
                ModeCause::Alignment => {}
                ModeCause::PlaceAtRest { recording, row, sigma_m } => {
                    let rest = self.end_of_rest();
                    let unit = |r: usize, i: usize| f64::from(u8::from(r == *recording && i >= rest));
                    parts.push((modes.add_pattern(self.effect_of_readings(field, *row, unit)), *sigma_m));
                }
                ModeCause::Readings(rows) => parts.extend(rows.iter().map(|one| {
                    let error_m = |r: usize, i: usize| one.at(r, i);
                    (modes.add_pattern(self.effect_of_readings(field, one.row, error_m)), 1.0)
                })),
                ModeCause::Order { rows, kind } => parts.extend(rows.iter().map(|one| {
                    let taken_m = self.effect_of_readings_m(field, one.row, |r, i| one.at(r, i));
                    let in_mean = kind.share * self.mean_power(kind.power());
                    let orders_m = &field[one.row].stated_orders_m;
                    let error_m = Array2::from_shape_fn(taken_m.dim(), |(_, i)| {
                        taken_m[(0, i)] - in_mean * orders_m[i][kind.index]
                    });
                    (modes.add_pattern(ErrorPattern::new(one.row, error_m)), 1.0)
                })),
            }
            modes.push_sum(direction.source.clone(), parts);
        }
        self.add_prior_modes(field, &mut modes);
        modes
    }

    /// No error yet, and the patterns that errors of the alignment are sums of: what one unit of each recording's drive, then of each one's
    /// offset (seconds), changes of the motion.
    pub(crate) fn effects(&self, field: &Fitted) -> ErrorModes {
        let mut effects = ErrorModes::default();
        for unknown in [0, 1] {
            for r in 0..self.observations.len() {
                let rows = || self.displacements[r].iter().map(|displacement| displacement.row);
                let (first, last) = (rows().min().unwrap_or(0), rows().max().unwrap_or(0));
                let mut effect_m = Array2::zeros((last + 1 - first, self.times_s.len()));
                for ((row, i), effect_m) in effect_m.indexed_iter_mut() {
                    let FittedTime { contributions, response } = field[first + row].at(i);
                    let slope = response.residual_slopes(self.drive[r])[unknown];
                    let own = contributions.iter().filter(|one| one.recording == r);
                    *effect_m = own.map(|one| response.gain(one, &self.drive) * slope).sum();
                }
                effects.add_pattern(ErrorPattern::new(first, effect_m));
            }
        }
        effects
    }

    /// What errors of a body's readings, by recording and time, change of that body's motion, beside what they do to drives and offsets.
    fn effect_of_readings(
        &self,
        field: &Fitted,
        row: usize,
        error_m: impl Fn(usize, usize) -> f64,
    ) -> ErrorPattern {
        ErrorPattern::new(row, self.effect_of_readings_m(field, row, error_m))
    }

    /// The same in metres by time, in one row.
    fn effect_of_readings_m(
        &self,
        field: &Fitted,
        row: usize,
        error_m: impl Fn(usize, usize) -> f64,
    ) -> Array2<f64> {
        Array2::from_shape_fn((1, self.times_s.len()), |(_, i)| {
            let FittedTime { contributions, response } = field[row].at(i);
            contributions.iter().map(|one| response.gain(one, &self.drive) * error_m(one.recording, i)).sum()
        })
    }

    /// The mean of a power of the recordings' drives.
    fn mean_power(&self, power: i32) -> f64 {
        self.drive.iter().map(|s| s.powi(power)).sum::<f64>() / self.drive.len() as f64
    }

    /// The independent errors of the alignment: principal directions of the covariance that the readings' noise leaves, the
    /// gauge's delay, one for each place at rest, whose error pulls at drives and offsets too, and those that readings share.
    pub(crate) fn alignment_directions(
        &self,
        field: &Fitted,
        errors: &AlignmentErrors,
    ) -> Vec<AlignmentDirection> {
        let mut directions = self.noise_directions(field, errors);
        let delay = errors.exchange.delay_error.clone();
        directions.push(AlignmentDirection {
            source: ErrorSource::DelayByDrive,
            error: delay,
            cause: ModeCause::Alignment,
        });
        directions.extend(errors.left.iter().map(|left| AlignmentDirection {
            source: ErrorSource::Unsettled,
            error: left.clone(),
            cause: ModeCause::Alignment,
        }));
        directions.extend(self.rest_directions(field, errors));
        directions.extend(self.reading_directions(field, errors));
        directions.extend(self.order_directions(field, errors));
        directions
    }

    /// What is not known of the responses' second order, and their third one, which is not fitted: alignments take up what they can of both.
    fn order_directions(&self, field: &Fitted, errors: &AlignmentErrors) -> Vec<AlignmentDirection> {
        let response = &errors.exchange.errors * &errors.covariance;
        let direction = |kind: Order| {
            let of_row = |(row, of_body): (usize, &FittedBody)| {
                let is_known = of_body.stated_orders_m.iter().any(|orders_m| orders_m[kind.index] != 0.0);
                let of_recording = |s: &f64| -> Vec<f64> {
                    let factor = kind.share * s.powi(kind.power());
                    of_body.stated_orders_m.iter().map(|orders_m| factor * orders_m[kind.index]).collect()
                };
                is_known.then(|| RowError::new(row, self.drive.iter().map(of_recording).collect()))
            };
            let rows: Vec<RowError> = field.iter().enumerate().filter_map(of_row).collect();
            let moved = rows.iter().fold(DVector::zeros(2 * self.observations.len()), |sum, one| {
                sum + error_sensitivity(&field[one.row], &self.drive, |r, i| one.at(r, i))
            });
            (!rows.is_empty()).then(|| AlignmentDirection {
                source: ErrorSource::Response { first_body: 1 },
                error: &response * moved,
                cause: ModeCause::Order { rows, kind },
            })
        };
        Order::ALL.into_iter().filter_map(direction).collect()
    }

    fn noise_directions(&self, field: &Fitted, errors: &AlignmentErrors) -> Vec<AlignmentDirection> {
        let n = self.observations.len();
        let ratio = field.iter().map(|of_body| self.scatter_ratio(of_body, |_| true)).fold(1.0, f64::max);
        let covariance = &errors.exchange.errors * &errors.covariance * errors.exchange.errors.transpose();
        // Drives in per cent and offsets in frames, so that the directions compare like with like.
        let unit = |i: usize| if i < n { 0.01 } else { self.frame_interval_s };
        let scaled =
            |i: usize, j: usize| 0.5 * (covariance[(i, j)] + covariance[(j, i)]) / (unit(i) * unit(j));
        let eigen = DMatrix::from_fn(2 * n, 2 * n, scaled).symmetric_eigen();
        let largest = eigen.eigenvalues.max();
        let kept = (0..2 * n).filter(|k| eigen.eigenvalues[*k] > 1e-8 * largest);
        kept.map(|k| {
            let amplitude = ratio * eigen.eigenvalues[k].sqrt();
            let error = DVector::from_fn(2 * n, |i, _| amplitude * unit(i) * eigen.eigenvectors[(i, k)]);
            AlignmentDirection {
                source: ErrorSource::Alignment { direction: k },
                error,
                cause: ModeCause::Alignment,
            }
        })
        .collect()
    }

    fn rest_directions(&self, field: &Fitted, errors: &AlignmentErrors) -> Vec<AlignmentDirection> {
        let rest = self.end_of_rest();
        let response = &errors.exchange.errors * &errors.covariance;
        let of_body = |row: usize| &response * offset_sensitivity(field[row].times().skip(rest), &self.drive);
        let by_offset: Vec<DMatrix<f64>> = (0..field.len()).map(of_body).collect();
        let of_recording = |(r, displacements): (usize, &Vec<Displacement>)| {
            let direction = |displacement: &Displacement| AlignmentDirection {
                source: ErrorSource::Rest {
                    recording: self.observations[r].recording.clone(),
                    body: displacement.row + 1,
                },
                error: by_offset[displacement.row].column(r) * displacement.rest_sigma_m,
                cause: ModeCause::PlaceAtRest {
                    recording: r,
                    row: displacement.row,
                    sigma_m: displacement.rest_sigma_m,
                },
            };
            displacements.iter().map(direction).collect::<Vec<_>>()
        };
        self.displacements.iter().enumerate().flat_map(of_recording).collect()
    }

    fn reading_directions(&self, field: &Fitted, errors: &AlignmentErrors) -> Vec<AlignmentDirection> {
        let shared = &self.settings.reading_errors;
        let response = &errors.exchange.errors * &errors.covariance;
        let direction = |error: &SharedReadingError| {
            let rows = on_time_base(error, self.observations, &self.offsets_s, &self.times_s);
            let n = 2 * self.observations.len();
            if rows.is_empty() {
                return None;
            }
            let moved = rows.iter().fold(DVector::zeros(n), |sum, one| {
                sum + error_sensitivity(&field[one.row], &self.drive, |r, i| one.at(r, i))
            });
            let cause = ModeCause::Readings(rows);
            Some(AlignmentDirection { source: error.source.clone(), error: &response * moved, cause })
        };
        shared.iter().filter_map(direction).collect()
    }

    /// Index of the first time at which the rest is over. The frames at rest define the places, so their own mean error is zero.
    pub(crate) fn end_of_rest(&self) -> usize {
        self.times_s.partition_point(|time_s| *time_s < self.settings.rest_until_s)
    }

    /// What one unit of the mean drive and of the mean trigger (seconds) changes of the motion, in metres.
    pub(crate) fn effects_of_means(&self, effects: &ErrorModes) -> [Array2<f64>; 2] {
        let n = self.observations.len();
        [0, 1].map(|unknown| {
            let all: Vec<(usize, f64)> =
                (unknown * n..(unknown + 1) * n).map(|pattern| (pattern, 1.0)).collect();
            effects.sum_m(&all, (self.settings.n_bodies, self.times_s.len()))
        })
    }

    /// For each group of bodies that the same recordings saw, the error of their responses beyond what readings tell: where the
    /// trials' drives leave slope and curvature to the priors, and of third order. A response follows the motion in time and
    /// is alike in neighbours, so this error is one for the group, in proportion to the motion.
    fn add_prior_modes(&self, field: &Fitted, modes: &mut ErrorModes) {
        let recordings = |row: usize| -> Vec<usize> {
            let sees = |r: &usize| self.displacements[*r].iter().any(|displacement| displacement.row == row);
            (0..self.displacements.len()).filter(sees).collect()
        };
        let groups: Vec<Vec<usize>> = (0..field.len()).map(recordings).collect();
        let rms_m: Vec<f64> = field.iter().map(rms_motion_m).collect();
        let most: Vec<usize> = field.iter().map(FittedBody::most_at_once).collect();
        // Of a body that no recording saw there is neither.
        let bend =
            |(of_body, rms_m): (&FittedBody, &f64)| rms_departure_m(of_body) / rms_m.max(f64::MIN_POSITIVE);
        let bends: Vec<f64> = field.iter().zip(&rms_m).map(bend).collect();
        let error_m = |row: usize, i: usize| {
            let relative = field[row].at(i).response.motion_m / rms_m[row].max(f64::MIN_POSITIVE);
            let sizes = self.settings.sizes_of(row);
            let bend = (!tells_curvature(most[row])).then_some(bends[row]);
            relative * self.response_error_m(field[row].at(i), bend, rms_m[row], sizes)
        };
        let leads = (0..groups.len())
            .filter(|row| !groups[*row].is_empty() && !groups[..*row].contains(&groups[*row]));
        for lead in leads {
            let alike =
                |(row, i): (usize, usize)| if groups[row] == groups[lead] { error_m(row, i) } else { 0.0 };
            let displacement_m = Array2::from_shape_fn((field.len(), self.times_s.len()), alike);
            modes.push(ErrorSource::Response { first_body: lead + 1 }, &displacement_m);
        }
    }

    /// A power of the drives' deviation in the mean of all recordings, less what the readings of a body at a time tell of it.
    fn untold_power(&self, FittedTime { contributions, response }: FittedTime<'_>, order: i32) -> f64 {
        let power = |c: &Contribution| self.drive[c.recording].powi(order);
        let taken: f64 = contributions.iter().map(|c| response.gain(c, &self.drive) * power(c)).sum();
        self.mean_power(order) - taken
    }

    /// Standard deviation of the mean motion beyond what the readings' own noise explains. Where too few recordings tell how the response is curved,
    /// `bend` is how far its slope departs from the motion, relative to that: a weak non-linearity curves it by as much.
    fn response_error_m(
        &self,
        at: FittedTime<'_>,
        bend: Option<f64>,
        rms_m: f64,
        sizes: ResponseSizes,
    ) -> f64 {
        let [slope_m, curvature_m] = at.response.prior_errors_m();
        // The priors let responses differ from plain scaling and from a weak non-linearity as the usual ones may at any scale of the drives; at the true
        // one curvatures differ from the latter by less, or by as much as those of the stated chain.
        let prior = self.settings.response_sizes;
        let slope = sizes.slope / prior.slope;
        let curvature = match self.scale {
            Scale::True => sizes.non_linearity,
            Scale::Open | Scale::Held => sizes.curvature,
        };
        // What an order of the response that is not fitted makes of the mean motion.
        let of_order_m = |order: i32, size: f64| size * rms_m * self.untold_power(at, order);
        let second_order_m = match bend {
            None => curvature / prior.curvature * curvature_m,
            Some(bend) => of_order_m(2, bend.hypot(sizes.non_linearity)),
        };
        (slope * slope_m).hypot(second_order_m).hypot(of_order_m(3, sizes.third_order))
    }
}

/// Root mean square of what the slope of a body's response differs by from its motion, over the times it was seen, in metres.
fn rms_departure_m(of_body: &FittedBody) -> f64 {
    let departure_m = |at: FittedTime<'_>| at.response.slope_m - at.response.motion_m;
    let squares: f64 = of_body.seen().map(|at| departure_m(at).powi(2)).sum();
    (squares / of_body.seen().count().max(1) as f64).sqrt()
}

/// Root mean square of a body's motion over the times it was seen, in metres.
fn rms_motion_m(of_body: &FittedBody) -> f64 {
    let squares: f64 = of_body.seen().map(|at| at.response.motion_m.powi(2)).sum();
    (squares / of_body.seen().count().max(1) as f64).sqrt()
}
