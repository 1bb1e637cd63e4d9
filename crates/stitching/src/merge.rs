//! Merging observations into one motion, group by group of recordings that share bodies.

use chainwave_measurement::Observation;

use crate::by_trigger::{averaged_by_trigger, is_contradicted};
use crate::consistency::{check_shown, check_spans, with_rest};
use crate::detached::{MergedGroup, joined};
use crate::error::StitchingError;
use crate::groups::{first_body, tied_groups, without_glimpses};
use crate::phases::Aligned;
use crate::settings::Settings;
use crate::stitched::Stitched;
use crate::time_base::common_interval_s;

/// Merges observations of one chain into its motion.
///
/// The common time base has the observations' median frame interval, rounded to five digits, and contains t = 0. Recordings that
/// share no body with the others, or too little of its way to settle where they stand, are joined to them by their trigger: their
/// motion has the error of their own mean drive and mean trigger. Where no smooth response to the drive tells how trials differ, they are
/// averaged by their triggers. A track that does not show its body at rest is left out, with a warning, where other trials show the body.
///
/// # Errors
/// [`StitchingError`] when there is nothing to merge, an observation contradicts itself or lies at other times than the others, a body was never
/// at rest, or contradictory recordings leave nothing to average.
pub fn merge(observations: &[Observation], settings: &Settings) -> Result<Stitched, StitchingError> {
    let interval_s = common_interval_s(observations).ok_or(StitchingError::Empty)?;
    check_spans(observations, settings.rest_until_s)?;
    let (resting, left_out) = with_rest(observations, settings.rest_until_s)?;
    check_shown(observations, &resting, settings.rest_until_s)?;
    let observations = resting.as_ref();
    let everyone: Vec<usize> = (0..observations.len()).collect();
    let parts = merged_groups(observations, &everyone, settings, interval_s)?;
    let mut settled = Vec::with_capacity(parts.len());
    for part in parts {
        if part.stitched.unsettled.is_none() {
            settled.push(part);
            continue;
        }
        // Ties too weak to settle on: without them, what is left is known by the trigger.
        let own: Vec<Observation> = part.members.iter().map(|r| observations[*r].clone()).collect();
        let firm = without_glimpses(&own);
        if tied_groups(&firm).iter().filter(|group| first_body(&firm, group).is_some()).count() > 1 {
            settled.extend(merged_groups(&firm, &part.members, settings, interval_s)?);
        } else {
            settled.push(part);
        }
    }
    let n_groups = settled.len();
    let stitched = joined(observations, settled, settings, interval_s).ok_or(StitchingError::Empty)?;
    let mut stitched =
        match is_contradicted(&stitched, observations, n_groups, settings.trigger_prior_s(interval_s)) {
            true => averaged_by_trigger(observations, settings, interval_s, &stitched)?,
            false => stitched,
        };
    stitched.warnings.extend(left_out);
    Ok(stitched)
}

/// Merges each group of recordings that share bodies; `places` are the recordings' places among all observations. Only where the stated chain
/// tells how the onsets of later bodies answer to the drive can other groups than that with the first body tell what the impact tells; else,
/// and where recordings that answer otherwise do not settle where it leads, what their readings leave open stays as the priors put it.
fn merged_groups(
    observations: &[Observation],
    places: &[usize],
    settings: &Settings,
    interval_s: f64,
) -> Result<Vec<MergedGroup>, StitchingError> {
    let groups = tied_groups(observations);
    let nearest = groups.iter().filter_map(|group| first_body(observations, group)).min();
    let mut parts = Vec::with_capacity(groups.len());
    for group in groups {
        let Some(first) = first_body(observations, &group) else { continue };
        let own: Vec<Observation> = group.iter().map(|r| observations[*r].clone()).collect();
        let merged = |settings: &Settings| {
            let aligned = Aligned::of(&own, settings, interval_s)?;
            let is_told = Some(first) == nearest || settings.stated_responses.get(first - 1).is_some();
            let gauged = if is_told { aligned.gauged()? } else { aligned.ungauged() };
            gauged.trimmed()?.stitched()
        };
        let (mut stitched, mut of_mean_m) = merged(settings)?;
        if stitched.unsettled.is_some() && !settings.stated_responses.is_empty() {
            let by_no_chain = Settings { stated_responses: Vec::new(), ..settings.clone() };
            (stitched, of_mean_m) = merged(&by_no_chain)?;
        }
        let members = group.iter().map(|r| places[*r]).collect();
        parts.push(MergedGroup { first_body: first, members, stitched, of_mean_m });
    }
    Ok(parts)
}

/// Merges as [`merge`] does, with what the readings leave open as the priors put it: how well recordings agree does not depend on it, and
/// few recordings far from the impact tell it so badly that it would be put where even their agreement suffers.
pub(crate) fn merge_as_read(
    observations: &[Observation],
    settings: &Settings,
) -> Result<Stitched, StitchingError> {
    let interval_s = common_interval_s(observations).ok_or(StitchingError::Empty)?;
    check_spans(observations, settings.rest_until_s)?;
    let (resting, _) = with_rest(observations, settings.rest_until_s)?;
    Ok(Aligned::of(&resting, settings, interval_s)?.ungauged().trimmed()?.stitched()?.0)
}
