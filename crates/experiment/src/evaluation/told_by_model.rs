//! What the chain model tells of the motion that is free of any model, and trials and views do not: it counts as an uncertainty there.

use chainwave_inference::{FitError, FittedRecording, TrackFit};
use chainwave_measurement::Estimate;
use chainwave_stitching::{Mean, MeanOff, Stitched, UntiedGroup};

use crate::finding::Finding;
use crate::merging::Merged;
use crate::merging::usual_geometry::ToldByModel;

/// A motion that stays where it is, with the whole of what the model tells among its errors.
pub(super) struct Widened {
    pub(super) stitched: Stitched,
    /// What was told.
    pub(super) findings: Vec<Finding>,
}

impl Widened {
    /// `None` where the model is not believed, or tells nothing.
    pub(super) fn of(merged: &Merged<'_>, track_fit: &Result<TrackFit, FitError>) -> Option<Self> {
        let stitched = &merged.joint.stitched;
        let believed = track_fit.as_ref().ok().filter(|fit| fit.is_believed());
        let geometry =
            believed.map(|fit| merged.usual_geometry.told(&fit.usual_amplitudes, &stitched.motion));
        let geometry = geometry.unwrap_or_default();
        let means = accepted(track_fit).map_or_else(Vec::new, |fit| means_off(stitched, fit));
        if geometry.is_empty() && means.is_empty() {
            return None;
        }
        let mut motion = ToldByModel::counted_in(&geometry, &stitched.motion);
        means.iter().for_each(|mean| mean.count_in(&mut motion, "the chain model"));
        let of_means = means.iter().map(of_mean);
        Some(Self {
            stitched: Stitched { motion, ..stitched.clone() },
            findings: ToldByModel::finding(&geometry).into_iter().chain(of_means).collect(),
        })
    }
}

/// A fit to the tracks that explains them.
pub(super) fn accepted(track_fit: &Result<TrackFit, FitError>) -> Option<&TrackFit> {
    track_fit.as_ref().ok().filter(|fit| fit.leaves_noise_alone())
}

/// Where the means of drives and triggers lie that only their own trials told.
fn means_off(stitched: &Stitched, fit: &TrackFit) -> Vec<MeanOff> {
    stitched.untied.iter().flat_map(|group| of_group(group, fit)).collect()
}

fn of_group(group: &UntiedGroup, fit: &TrackFit) -> Vec<MeanOff> {
    let own = |one: &&FittedRecording| group.recordings.contains(&one.recording);
    let recordings: Vec<&FittedRecording> = fit.recordings.iter().filter(own).collect();
    if recordings.len() < group.recordings.len() {
        return Vec::new();
    }
    let mean = |of: &dyn Fn(&FittedRecording) -> Estimate| {
        let n = recordings.len() as f64;
        let all = || recordings.iter().map(|one| of(one));
        // What errors have in common, they have in full in the mean.
        Estimate::new(all().map(|x| x.value).sum::<f64>() / n, all().map(|x| x.sigma).sum::<f64>() / n)
    };
    group.means_off(mean(&|one| one.drive_deviation), mean(&|one| one.trigger_offset_s))
}

fn of_mean(mean: &MeanOff) -> Finding {
    let what = match mean.of {
        Mean::Trigger => "triggers",
        Mean::Drive => "drives",
    };
    let text = format!(
        "by the chain model the mean of their {what} lies {:.1} standard deviations off what the trials' scatter lets expect. motion_by_model has it put \
         right; x_n(t), strains, times and energies do not, as they are free of any model, and count all of it as an uncertainty (hint: views that share \
         a body tell this without a model)",
        mean.in_sigmas.value
    );
    Finding {
        code: "untied_by_model",
        subject: format!("recordings that see body {} first", mean.first_body),
        text,
    }
}
