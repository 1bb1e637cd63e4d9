//! How far the mean drive and the mean trigger of recordings that nothing ties to the others may be off.
//!
//! Trials of one group of recordings scatter about the group's mean, which tells how far that mean itself is from the mean of all: by the
//! same scatter over the root of the number of trials. Triggers may also differ from view to view, in common for all trials of a view,
//! which no trial of it can show; but a wave arrives at one body after the other in nearly equal steps, and what the arrivals
//! scatter beyond what their trials explain is that difference.

use chainwave_measurement::{Estimate, median};
use nalgebra::{Matrix2, Vector2};

use crate::settings::Settings;

/// What one group of recordings tells of drives and triggers.
pub(crate) struct Sample {
    /// Its first body.
    pub(crate) first_body: usize,
    /// Its only view; `None` where it has several.
    pub(crate) only_view: Option<u32>,
    /// Number of its trials.
    pub(crate) n_trials: usize,
    /// Number of its views.
    pub(crate) n_views: usize,
    /// Sum of products of drive deviations and trigger offsets about their means in each view, (1, s; s, s^2).
    pub(crate) products: Matrix2<f64>,
    /// Trials less views: how many squares `products` sums up.
    pub(crate) degrees_of_freedom: f64,
    /// When the foot of the wave comes to the first body, and what one unit of mean drive and mean trigger changes of that.
    pub(crate) arrival: Option<Arrival>,
}

/// When the foot of the wave comes to a body.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Arrival {
    /// In seconds.
    pub(crate) time_s: f64,
    /// Its derivatives by the mean drive (seconds) and the mean trigger (1).
    pub(crate) by_mean: Vector2<f64>,
}

/// Freedom at which a group's neighbours are enough to tell its scatter with it: their bodies respond alike, far ones less so.
const ENOUGH: f64 = 32.0;
/// Below this, a scatter is taken from what is stated or usual.
const LEAST: f64 = 3.0;
/// Below this, arrivals do not tell how triggers differ from view to view: with fewer, Student's interval is wider than its expansion.
const LEAST_OF_ARRIVALS: f64 = 2.0;
/// An arrival tells nothing whose trials leave it so many times as uncertain as the others'.
const UNTOLD: f64 = 3.0;
/// Bodies at each end of the chain whose arrivals lie off the others': the first are under the striker, the last before the end.
const ENDS: usize = 2;

/// How far the mean drives and triggers of groups may be off.
pub(crate) struct ErrorsOfMeans {
    /// Covariance of the error of a group's mean drive and mean trigger, for groups in the order of their bodies.
    pub(crate) of_groups: Vec<Matrix2<f64>>,
    /// Whether it contains how triggers differ from view to view.
    pub(crate) has_views: bool,
}

/// Finds how far they may be off: by more than the best estimate by what Student's distribution adds, so that 1.96 standard deviations hold
/// 95 %.
pub(crate) fn errors_of_means(samples: &[Sample], settings: &Settings, interval_s: f64) -> ErrorsOfMeans {
    let of_trials: Vec<(Matrix2<f64>, f64)> =
        (0..samples.len()).map(|g| of_trials(samples, g, settings, interval_s)).collect();
    let found = between_views(samples, &of_trials, settings);
    let between = found.unwrap_or(Estimate::new(0.0, 0.0));
    let of_groups = samples
        .iter()
        .zip(&of_trials)
        .map(|(sample, (of_trial, degrees_of_freedom))| {
            let own = of_trial / sample.n_trials as f64;
            let common_s2 = between.value / sample.n_views as f64;
            let timing_s2 = own[(1, 1)] + common_s2;
            // Welch and Satterthwaite: the degrees of freedom of a sum of two variances.
            let squares = own[(1, 1)].powi(2) / degrees_of_freedom
                + (between.sigma / sample.n_views as f64).powi(2) / 2.0;
            let timing_freedom =
                if squares > 0.0 { timing_s2.powi(2) / squares } else { *degrees_of_freedom };
            let mut error = own * widening(*degrees_of_freedom).powi(2);
            error[(1, 1)] += (timing_s2 * widening(timing_freedom).powi(2) - error[(1, 1)]).max(0.0);
            error
        })
        .collect();
    ErrorsOfMeans { of_groups, has_views: found.is_some() }
}

/// Covariance of drive and trigger from trial to trial near a group, with its degrees of freedom.
fn of_trials(samples: &[Sample], g: usize, settings: &Settings, interval_s: f64) -> (Matrix2<f64>, f64) {
    let distance = |sample: &Sample| sample.first_body.abs_diff(samples[g].first_body);
    let mut near: Vec<&Sample> = samples.iter().collect();
    near.sort_by_key(|sample| distance(sample));
    let (mut products, mut degrees_of_freedom, mut reached) = (Matrix2::zeros(), 0.0, 0);
    for sample in near {
        // All groups at one distance count, so that none is preferred.
        if degrees_of_freedom >= ENOUGH && distance(sample) > reached {
            break;
        }
        reached = distance(sample);
        products += sample.products;
        degrees_of_freedom += sample.degrees_of_freedom;
    }
    let usual = Matrix2::from_diagonal(&Vector2::new(
        settings.drive_scatter.unwrap_or(settings.drive_prior).powi(2),
        settings.trigger_sigma_s.unwrap_or(interval_s).powi(2),
    ));
    if degrees_of_freedom < LEAST {
        return (usual, f64::INFINITY);
    }
    let mut found = products / degrees_of_freedom;
    if let Some(stated_s) = settings.trigger_sigma_s {
        // A drive that delays a body shows as a trigger's offset in proportion to it, which the statement does not mean.
        let with_drive_s2 = found[(0, 1)].powi(2) / found[(0, 0)].max(f64::MIN_POSITIVE);
        found[(1, 1)] = with_drive_s2 + stated_s.powi(2);
    }
    (found, degrees_of_freedom)
}

/// Variance of the triggers from view to view with its standard uncertainty, in square seconds: as stated, or what arrivals scatter
/// beyond what trials explain; `None` where too few arrivals are known to tell.
fn between_views(
    samples: &[Sample],
    of_trials: &[(Matrix2<f64>, f64)],
    settings: &Settings,
) -> Option<Estimate> {
    if let Some(stated_s) = settings.view_trigger_sigma_s {
        return Some(Estimate::new(stated_s.powi(2), 0.0));
    }
    let inner = samples.len().saturating_sub(2 * ENDS);
    let arrivals: Vec<(usize, Arrival, f64)> = samples
        .iter()
        .zip(of_trials)
        .skip(ENDS)
        .take(inner)
        .filter(|(sample, _)| sample.only_view.is_some())
        .filter_map(|(sample, (of_trial, _))| {
            let arrival = sample.arrival?;
            let explained_s2 = (arrival.by_mean.transpose() * of_trial * arrival.by_mean)[0];
            Some((sample.first_body, arrival, explained_s2 / sample.n_trials as f64))
        })
        .collect();
    // One that is hardly known would hide what the others tell.
    let usual_s2 = median(arrivals.iter().map(|(_, _, explained_s2)| *explained_s2).collect())?;
    let arrivals: Vec<(usize, Arrival, f64)> = arrivals
        .into_iter()
        .filter(|(_, _, explained_s2)| *explained_s2 <= UNTOLD.powi(2) * usual_s2)
        .collect();
    // How far each lies off the line through its neighbours.
    let (mut squares, mut explained, mut n) = (0.0, 0.0, 0.0);
    for three in arrivals.windows(3) {
        let [(a, t_a, v_a), (b, t_b, v_b), (c, t_c, v_c)] = [three[0], three[1], three[2]];
        let share = (b - a) as f64 / (c - a).max(1) as f64;
        let weights = [1.0 - share, share];
        let off_s = t_b.time_s - weights[0] * t_a.time_s - weights[1] * t_c.time_s;
        let gain = 1.0 + weights[0].powi(2) + weights[1].powi(2);
        squares += off_s.powi(2) / gain;
        explained += (v_b + weights[0].powi(2) * v_a + weights[1].powi(2) * v_c) / gain;
        n += 1.0;
    }
    // Neighbouring differences share arrivals: their squares count half.
    let degrees_of_freedom = n / 1.94;
    if degrees_of_freedom < LEAST_OF_ARRIVALS {
        return None;
    }
    let (found_s2, explained_s2) = (squares / n, explained / n);
    let excess_s2 = (found_s2 - explained_s2).max(0.0);
    Some(Estimate::new(
        excess_s2,
        if excess_s2 > 0.0 { found_s2 * (2.0 / degrees_of_freedom).sqrt() } else { 0.0 },
    ))
}

/// How much wider a 95 % interval of Student's distribution is than the normal one (Cornish and Fisher's expansion, which below one degree of
/// degrees of freedom, as a difference of variances may have, is none).
pub(crate) fn widening(degrees_of_freedom: f64) -> f64 {
    let degrees_of_freedom = degrees_of_freedom.max(1.0);
    let z = Estimate::COVERAGE_95;
    let first = (z.powi(2) + 1.0) / 4.0;
    let second = (5.0 * z.powi(4) + 16.0 * z.powi(2) + 3.0) / 96.0;
    let third = (3.0 * z.powi(6) + 19.0 * z.powi(4) + 17.0 * z.powi(2) - 15.0) / 384.0;
    1.0 + first / degrees_of_freedom
        + second / degrees_of_freedom.powi(2)
        + third / degrees_of_freedom.powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twelve bodies, one a view, five trials each, whose waves arrive every 0.5 ms but for their views' own triggers.
    fn one_body_a_view(view_s: [f64; 12], uncertain: Option<usize>) -> Vec<Sample> {
        let sample = |(group, off_s): (usize, f64)| {
            // What a unit of drive does to an arrival: a hundred times as much of one that is hardly known.
            let by_drive_s = if Some(group) == uncertain { 1e-1 } else { 1e-3 };
            Sample {
                first_body: group + 1,
                only_view: Some(group as u32),
                n_trials: 5,
                n_views: 1,
                products: Matrix2::from_diagonal(&Vector2::new(
                    4.0 * 0.018_f64.powi(2),
                    4.0 * 1e-5_f64.powi(2),
                )),
                degrees_of_freedom: 4.0,
                arrival: Some(Arrival {
                    time_s: 5e-4 * group as f64 + off_s,
                    by_mean: Vector2::new(by_drive_s, 1.0),
                }),
            }
        };
        view_s.into_iter().enumerate().map(sample).collect()
    }

    const VIEWS_S: [f64; 12] = [0.0, 0.0, 6e-5, -5e-5, 7e-5, -8e-5, 4e-5, -6e-5, 5e-5, -7e-5, 0.0, 0.0];

    #[test]
    fn an_arrival_that_is_hardly_known_does_not_hide_the_others() {
        let settings = Settings::new(12, 0.0);
        let timing_s = |samples: &[Sample]| {
            let found = errors_of_means(samples, &settings, 4e-5);
            assert!(found.has_views);
            found.of_groups[0][(1, 1)].sqrt()
        };
        let (all, without) =
            (timing_s(&one_body_a_view(VIEWS_S, None)), timing_s(&one_body_a_view(VIEWS_S, Some(5))));
        // Views that alternate by 6e-5 s lie twice that off their neighbours' mean, 1.5^-1/2 of which counts: 1e-4 s, and Student's width.
        // Without one arrival its neighbours' pairs tell less and are widened more; with it, its 2 ms would explain all.
        assert!(all > 8e-5 && all < 2.5e-4, "{all:e}");
        assert!(without > 5e-5 && without < 4e-4, "{without:e}");
    }

    #[test]
    fn too_few_arrivals_do_not_tell_how_views_differ() {
        let few: Vec<Sample> = one_body_a_view(VIEWS_S, None).into_iter().take(7).collect();
        assert!(!errors_of_means(&few, &Settings::new(7, 0.0), 4e-5).has_views);
        let stated = Settings { view_trigger_sigma_s: Some(6e-5), ..Settings::new(7, 0.0) };
        assert!(errors_of_means(&few, &stated, 4e-5).has_views);
    }

    #[test]
    fn students_interval_is_that_of_the_tables() {
        // t at 97.5 %: 2.228 at 10, 2.042 at 30, and 1.960 without end.
        for (degrees_of_freedom, expected) in [(10.0, 2.228), (30.0, 2.042), (f64::INFINITY, 1.960)] {
            assert!(
                (widening(degrees_of_freedom) * Estimate::COVERAGE_95 - expected).abs() < 2e-3,
                "{degrees_of_freedom}"
            );
        }
    }
}
