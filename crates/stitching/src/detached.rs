//! Groups of recordings that share no body, joined on the time base of their triggers.

use chainwave_measurement::{ChainMotion, ErrorModes, ErrorSource, Estimate, Observation, median};
use nalgebra::{Matrix2, Vector2};
use ndarray::{Array2, Zip, s};

use crate::settings::Settings;
use crate::spread::Spread;
use crate::stitched::{Alignment, Stitched};
use crate::trigger_scatter::{Arrival, ErrorsOfMeans, Sample, errors_of_means};
use crate::untied::UntiedGroup;

/// One group of recordings that share bodies, merged.
pub(crate) struct MergedGroup {
    /// The first body that it saw.
    pub(crate) first_body: usize,
    /// Places of its recordings among all observations.
    pub(crate) members: Vec<usize>,
    /// Its motion, at the mean drive and the mean trigger of its own recordings.
    pub(crate) stitched: Stitched,
    /// What one unit of mean drive and of mean trigger (seconds) changes of the displacements, in metres.
    pub(crate) of_mean_m: [Array2<f64>; 2],
}

/// The share of a usual body's way at which the foot of the wave has come to it.
const FOOT: f64 = 0.02;

/// Puts the groups' motions onto one time base; `None` without any.
pub(crate) fn joined(
    observations: &[Observation],
    mut parts: Vec<MergedGroup>,
    settings: &Settings,
    interval_s: f64,
) -> Option<Stitched> {
    parts.sort_by_key(|part| (part.first_body, part.members[0]));
    let ErrorsOfMeans { of_groups: errors, has_views } = match parts.len() {
        1 => ErrorsOfMeans { of_groups: vec![Matrix2::zeros()], has_views: true },
        _ => errors_of_means(&samples(&parts), settings, interval_s),
    };
    let is_whole = parts.len() == 1;
    let alignments = alignments(observations, &parts, &errors, settings, interval_s);
    let mut warnings = warnings(observations, &parts);
    if !has_views {
        warnings.push(VIEWS_UNTOLD.to_owned());
    }
    let rounds = parts.iter().map(|part| part.stitched.rounds).max()?;
    let unsettled = parts.iter().find_map(|part| part.stitched.unsettled);
    let by_trigger = parts.iter().any(|part| part.stitched.by_trigger);
    let drive_scale_sigma = parts.iter().filter_map(|part| part.stitched.drive_scale_sigma).reduce(f64::max);
    let clocks = parts.iter().flat_map(|part| part.stitched.clocks.clone()).collect();
    let shown = parts.iter().flat_map(|part| part.stitched.shown.clone()).collect();
    let left_by_views = parts.iter().flat_map(|part| part.stitched.left_by_views.clone()).collect();
    let untied = if is_whole { Vec::new() } else { untied(observations, &parts, &errors) };
    let (motion, spread) = match is_whole {
        true => parts.pop().map(|part| (part.stitched.motion, part.stitched.spread))?,
        false => on_one_time_base(&parts, &untied, interval_s),
    };
    Some(Stitched {
        motion,
        alignments,
        drive_scale_sigma,
        spread,
        rounds,
        unsettled,
        by_trigger,
        shown,
        clocks,
        untied,
        left_by_views,
        warnings,
    })
}

fn samples(parts: &[MergedGroup]) -> Vec<Sample> {
    let farthest = |part: &MergedGroup| {
        let way = |x: &Option<Estimate>| x.map_or(0.0, |x| x.value.abs());
        part.stitched.motion.displacement_m.iter().map(way).fold(0.0, f64::max)
    };
    let foot_m = FOOT * median(parts.iter().map(farthest).collect()).unwrap_or(0.0);
    parts.iter().map(|part| sample(part, foot_m)).collect()
}

fn sample(part: &MergedGroup, foot_m: f64) -> Sample {
    let mut views: Vec<u32> = part.stitched.alignments.iter().map(|one| one.view).collect();
    views.sort_unstable();
    views.dedup();
    let mut products = Matrix2::zeros();
    for view in &views {
        let of_view = || part.stitched.alignments.iter().filter(|one| one.view == *view);
        let place = |one: &Alignment| Vector2::new(one.drive_deviation.value, one.trigger_offset_s.value);
        let mean = of_view().map(place).sum::<Vector2<f64>>() / of_view().count() as f64;
        for one in of_view() {
            let from_mean = place(one) - mean;
            products += from_mean * from_mean.transpose();
        }
    }
    let n_trials = part.stitched.alignments.len();
    Sample {
        first_body: part.first_body,
        only_view: (views.len() == 1).then(|| views[0]),
        n_trials,
        n_views: views.len(),
        products,
        degrees_of_freedom: (n_trials - views.len()) as f64,
        arrival: arrival(part, foot_m),
    }
}

/// When the first body of a part has moved so far, on the cubic through two samples with the slopes of their neighbours.
fn arrival(part: &MergedGroup, foot_m: f64) -> Option<Arrival> {
    let (motion, row) = (&part.stitched.motion, part.first_body - 1);
    let x_m = |i: usize| Some(motion.displacement_m.get((row, i))?.as_ref()?.value.abs());
    let before = (1..motion.times_s.len()).find(|i| x_m(*i).is_some_and(|x| x >= foot_m))? - 1;
    let step_s = motion.times_s.get(before + 1)? - motion.times_s[before];
    let slope = |i: usize| Some(0.5 * (x_m(i + 1)? - x_m(i.checked_sub(1)?)?));
    let ends = [x_m(before)?, x_m(before + 1)?];
    let slopes = [slope(before)?, slope(before + 1)?];
    let cubic_m = |at: f64| {
        let rest = 1.0 - at;
        (1.0 + 2.0 * at) * rest * rest * ends[0]
            + at * at * (3.0 - 2.0 * at) * ends[1]
            + at * rest * (rest * slopes[0] - at * slopes[1])
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if cubic_m(middle) < foot_m { low = middle } else { high = middle }
    }
    let rate_m_per_s = (slopes[0] + low * (slopes[1] - slopes[0])) / step_s;
    let by = |effect_m: &Array2<f64>| {
        let at_m = (1.0 - low) * effect_m[(row, before)] + low * effect_m[(row, before + 1)];
        at_m / rate_m_per_s
    };
    let by_mean = Vector2::new(by(&part.of_mean_m[0]), by(&part.of_mean_m[1]));
    (rate_m_per_s > 0.0).then(|| Arrival { time_s: motion.times_s[before] + low * step_s, by_mean })
}

/// Each recording's own alignment, with the error of its group's mean. A recording that saw nothing is known as well as any before it was
/// looked at.
fn alignments(
    observations: &[Observation],
    parts: &[MergedGroup],
    errors: &[Matrix2<f64>],
    settings: &Settings,
    interval_s: f64,
) -> Vec<Alignment> {
    let unseen = |observation: &Observation| Alignment {
        recording: observation.recording.clone(),
        view: observation.view,
        trial: observation.trial,
        trigger_offset_s: Estimate::new(0.0, settings.trigger_prior_s(interval_s)),
        drive_deviation: Estimate::new(0.0, settings.drive_scatter.unwrap_or(settings.drive_prior)),
        scatter_ratio: 0.0,
    };
    let mut alignments: Vec<Alignment> = observations.iter().map(unseen).collect();
    let wider = |x: Estimate, variance: f64| Estimate::new(x.value, x.sigma.hypot(variance.sqrt()));
    for (part, error) in parts.iter().zip(errors) {
        for (place, own) in part.members.iter().zip(&part.stitched.alignments) {
            alignments[*place] = Alignment {
                trigger_offset_s: wider(own.trigger_offset_s, error[(1, 1)]),
                drive_deviation: wider(own.drive_deviation, error[(0, 0)]),
                ..own.clone()
            };
        }
    }
    alignments
}

/// Said where nothing tells how far triggers differ from view to view.
const VIEWS_UNTOLD: &str = "the views that share no body are too few to tell how far their triggers differ from view to view, which is in no uncertainty: if \
                            they differ by more than from trial to trial, times and strains are off by it (hint: state trigger.view_sigma_s)";

/// Groups of recordings that are named one by one; more are counted.
const NAMED: usize = 3;

fn warnings(observations: &[Observation], parts: &[MergedGroup]) -> Vec<String> {
    let own = parts.iter().flat_map(|part| part.stitched.warnings.iter().cloned());
    let mut warnings: Vec<String> = own.collect();
    let largest = parts.iter().map(|part| part.members.len()).max().unwrap_or(0);
    let main = parts.iter().position(|part| part.members.len() == largest);
    let others: Vec<&MergedGroup> =
        parts.iter().enumerate().filter(|(g, _)| Some(*g) != main).map(|(_, part)| part).collect();
    if others.len() > NAMED {
        warnings.push(format!(
            "the recordings fall into {} groups that share no body, or too little of its way: the time base rests on the trigger alone, \
             and each body's motion on its own group's mean drive",
            parts.len()
        ));
        return warnings;
    }
    for part in others {
        let names: Vec<&str> = part.members.iter().map(|r| observations[*r].recording.as_str()).collect();
        warnings.push(format!(
            "{} share no body with the other recordings: their time base rests on the trigger alone",
            names.join(", ")
        ));
    }
    warnings
}

fn untied(observations: &[Observation], parts: &[MergedGroup], errors: &[Matrix2<f64>]) -> Vec<UntiedGroup> {
    let of_part = |(part, error): (&MergedGroup, &Matrix2<f64>)| {
        let drive_sigma = error[(0, 0)].sqrt();
        let trigger_by_drive_s = if drive_sigma > 0.0 { error[(0, 1)] / drive_sigma } else { 0.0 };
        UntiedGroup {
            first_body: part.first_body,
            recordings: part.members.iter().map(|r| observations[*r].recording.clone()).collect(),
            drive_sigma,
            trigger_by_drive_s,
            trigger_sigma_s: (error[(1, 1)] - trigger_by_drive_s.powi(2)).max(0.0).sqrt(),
        }
    };
    parts.iter().zip(errors).map(of_part).collect()
}

fn on_one_time_base(parts: &[MergedGroup], untied: &[UntiedGroup], interval_s: f64) -> (ChainMotion, Spread) {
    let index = |time_s: f64| (time_s / interval_s).round() as i64;
    let span = |part: &MergedGroup| {
        let times_s = &part.stitched.motion.times_s;
        Some((index(*times_s.first()?), index(*times_s.last()?)))
    };
    let first = parts.iter().filter_map(span).map(|span| span.0).min().unwrap_or(0);
    let last = parts.iter().filter_map(span).map(|span| span.1).max().unwrap_or(0);
    let n_bodies = parts.iter().map(|part| part.stitched.motion.n_bodies()).max().unwrap_or(0);
    let shape = (n_bodies, (last - first + 1) as usize);
    let placed: Vec<(usize, &MergedGroup)> =
        parts.iter().filter_map(|part| Some(((span(part)?.0 - first) as usize, part))).collect();
    let spread_over = |factor: &dyn Fn(usize) -> f64, of: &dyn Fn(&MergedGroup) -> &Array2<f64>| {
        let mut whole = Array2::zeros(shape);
        for (g, (start, part)) in placed.iter().enumerate() {
            let own = of(part);
            let mut window = whole.slice_mut(s![.., *start..start + own.ncols()]);
            window.scaled_add(factor(g), own);
        }
        whole
    };
    let alike = |_: usize| 1.0;
    let mut motion = ChainMotion {
        times_s: (first..=last).map(|k| k as f64 * interval_s).collect(),
        displacement_m: Array2::from_elem(shape, None),
        independent_sigma_m: spread_over(&alike, &|part| &part.stitched.motion.independent_sigma_m),
        modes: ErrorModes::default(),
        n_trials: Array2::zeros(shape),
    };
    for (start, part) in &placed {
        let own = &part.stitched.motion;
        let columns = s![.., *start..start + own.times_s.len()];
        Zip::from(motion.displacement_m.slice_mut(columns))
            .and(&own.displacement_m)
            .for_each(|whole, x| *whole = whole.or(*x));
        Zip::from(motion.n_trials.slice_mut(columns)).and(&own.n_trials).for_each(|whole, n| *whole += n);
        motion.modes.append(own.modes.clone().placed(*start, shape.1), numbered);
    }
    let n_all: usize = parts.iter().map(|part| part.members.len()).sum();
    let mut means = ErrorModes::default();
    for (k, (part, group)) in parts.iter().zip(untied).enumerate() {
        // The mean of all follows a group's mean by the group's share.
        let share = part.members.len() as f64 / n_all as f64;
        let factor = |g: usize| if g == k { 1.0 - share } else { -share };
        let [of_drive_m, of_trigger_m] =
            [0, 1].map(|unknown| spread_over(&factor, &|part| &part.of_mean_m[unknown]));
        let with_drive_m = of_drive_m * group.drive_sigma + &of_trigger_m * group.trigger_by_drive_s;
        let first_body = group.first_body;
        means.push(ErrorSource::MeanDrive { first_body }, &with_drive_m);
        means.push(ErrorSource::MeanTrigger { first_body }, &(of_trigger_m * group.trigger_sigma_s));
    }
    motion.add_errors(means);
    let spread = Spread {
        within_m: spread_over(&alike, &|part| &part.stitched.spread.within_m),
        between_m: spread_over(&alike, &|part| &part.stitched.spread.between_m),
    };
    (motion, spread)
}

/// Directions are numbered over all groups.
fn numbered(source: ErrorSource, place: usize) -> ErrorSource {
    match source {
        ErrorSource::Alignment { .. } => ErrorSource::Alignment { direction: place },
        other => other,
    }
}
