//! Protocols of filming a chain, one of each kind as a laboratory might have it, and the words by which a report names what they leave
//! uncertain.

use chainwave_synthetic::{Packing, ScaleError};

use super::rests_m;
use super::wrong_chains::{not_negative, positive};
use crate::configuration::{Experiment, FilmedView, Synthetic, Trial, Trigger};
use crate::error::Error;

/// A way of filming an experiment that is not its own.
#[derive(Debug, Clone, Copy)]
pub struct Protocol {
    /// Its name.
    pub name: &'static str,
    /// Words of which a warning has to say one for the cause to count as named; none where there is nothing to be named.
    pub causes: &'static [&'static str],
    follow: fn(&mut Laboratory<'_>) -> Result<(), Error>,
}

/// What a protocol may change.
struct Laboratory<'a> {
    experiment: &'a mut Experiment,
    synthetic: &'a mut Synthetic,
    trials: &'a mut Vec<Trial>,
}

impl Protocol {
    /// One of each kind; beside them stands the experiment's own protocol.
    pub const ALL: &'static [Self] = &[
        Self { name: "frame_rates", causes: &[], follow: frame_rates },
        Self { name: "misstated_rate", causes: &["frames follow each other"], follow: misstated_rate },
        Self { name: "lengths", causes: &[], follow: lengths },
        Self { name: "magnifications", causes: &[], follow: magnifications },
        Self { name: "numbers_of_trials", causes: &[], follow: |lab| trials_a_view(lab, &[5, 3, 2]) },
        Self { name: "one_trial", causes: &[], follow: |lab| trials_a_view(lab, &[1]) },
        Self { name: "unknown_striker", causes: &[], follow: |lab| state_striker_scatter(lab, 0.1) },
        Self {
            name: "understated_striker",
            causes: &["stated scatter"],
            follow: |lab| film_striker_scatter(lab, 0.05),
        },
        Self { name: "days", causes: &[], follow: |lab| days(lab, true) },
        Self { name: "days_not_stated", causes: &["magnified"], follow: |lab| days(lab, false) },
        Self { name: "one_body", causes: APART, follow: |lab| one_body(lab, Neighbour::Unseen) },
        Self {
            name: "one_body_struck_harder",
            causes: &["by the chain model"],
            follow: one_body_struck_harder,
        },
        Self { name: "one_body_and_next", causes: &[], follow: |lab| one_body(lab, Neighbour::AtFirst) },
        Self { name: "one_body_one_trial", causes: APART, follow: one_body_one_trial },
        Self { name: "trigger_jitter", causes: APART, follow: |lab| triggers(lab, [150e-6, 0.0], false) },
        Self {
            name: "stated_trigger_jitter",
            causes: APART,
            follow: |lab| triggers(lab, [150e-6, 0.0], true),
        },
        Self { name: "trigger_of_views", causes: APART, follow: |lab| triggers(lab, [10e-6, 60e-6], false) },
        Self {
            name: "stated_trigger_of_views",
            causes: APART,
            follow: |lab| triggers(lab, [10e-6, 60e-6], true),
        },
    ];

    /// Films an experiment so; what is known of it is stated.
    ///
    /// # Errors
    /// An experiment that says nothing of its film, and a chain whose pitches make no sense.
    pub fn apply(&self, experiment: &mut Experiment, trials: &mut Vec<Trial>) -> Result<(), Error> {
        let Some(mut synthetic) = experiment.synthetic.take() else {
            return Err(Error::Value(
                "expected a [synthetic] part that says what is filmed, found none".into(),
            ));
        };
        let followed = (self.follow)(&mut Laboratory { experiment, synthetic: &mut synthetic, trials });
        experiment.synthetic = Some(synthetic);
        followed
    }
}

/// Views that share no body are tied by the trigger alone.
const APART: &[&str] = &["share no body"];

/// The views of the trials table, in the order in which they stand there.
fn views(trials: &[Trial]) -> Vec<u32> {
    let mut views: Vec<u32> = Vec::new();
    for trial in trials {
        if !views.contains(&trial.view) {
            views.push(trial.view);
        }
    }
    views
}

/// Gives the views, in turn, one of some ways to be filmed.
fn film_views<Way: Copy>(
    lab: &mut Laboratory<'_>,
    ways: &[Way],
    entry: impl Fn(&Synthetic, Way) -> FilmedView,
) {
    let views = views(lab.trials);
    let of_view = |(view, way): (u32, &Way)| FilmedView { view, ..entry(lab.synthetic, *way) };
    let entries: Vec<FilmedView> = views.into_iter().zip(ways.iter().cycle()).map(of_view).collect();
    lab.synthetic.views = entries;
}

/// Of a view that is filmed as all are.
const AS_ALL: FilmedView = FilmedView {
    view: 0,
    rate_hz: None,
    stated_rate_hz: None,
    first_image: None,
    n_frames: None,
    scale_px_per_m: None,
    drive_factor: None,
};

/// Views at the camera's rate, at 1.6 and at 0.7 of it, for as long.
fn frame_rates(lab: &mut Laboratory<'_>) -> Result<(), Error> {
    film_views(lab, &[1.0, 1.6, 0.7], |synthetic, factor| FilmedView {
        rate_hz: positive(factor * synthetic.camera.rate_hz),
        first_image: Some((factor * synthetic.first_image as f64).round() as i64),
        n_frames: Some((factor * synthetic.n_frames as f64).round() as usize),
        ..AS_ALL
    });
    Ok(())
}

/// The second view states a frame rate that is half a per cent above the true one.
fn misstated_rate(lab: &mut Laboratory<'_>) -> Result<(), Error> {
    const STATED: f64 = 1.005;
    film_views(lab, &[None, Some(STATED), None], |synthetic, factor| FilmedView {
        stated_rate_hz: factor.and_then(|factor: f64| positive(factor * synthetic.camera.rate_hz)),
        ..AS_ALL
    });
    Ok(())
}

/// The first views are stopped earlier: at 0.7 and at 0.85 of the time.
fn lengths(lab: &mut Laboratory<'_>) -> Result<(), Error> {
    film_views(lab, &[0.7, 0.85, 1.0], |synthetic, share| FilmedView {
        n_frames: Some((share * synthetic.n_frames as f64).round() as usize),
        ..AS_ALL
    });
    Ok(())
}

/// Views magnified by 1, 1.08 and 0.92, as the trials table states.
fn magnifications(lab: &mut Laboratory<'_>) -> Result<(), Error> {
    film_views(lab, &[1.0, 1.08, 0.92], |synthetic, factor| FilmedView {
        scale_px_per_m: positive(factor * synthetic.camera.scale_px_per_m),
        ..AS_ALL
    });
    Ok(())
}

/// The first trials of each view alone, so many in turn.
fn trials_a_view(lab: &mut Laboratory<'_>, numbers: &[usize]) -> Result<(), Error> {
    let views = views(lab.trials);
    let mut kept = vec![0; views.len()];
    lab.trials.retain(|trial| {
        let place = views.iter().position(|view| *view == trial.view).unwrap_or(0);
        kept[place] += 1;
        kept[place] <= numbers[place % numbers.len()]
    });
    Ok(())
}

/// States another scatter of the striker than it is filmed with.
fn state_striker_scatter(lab: &mut Laboratory<'_>, stated: f64) -> Result<(), Error> {
    lab.synthetic.striker_scatter = Some(not_negative(lab.experiment.drive_scatter()));
    lab.experiment.state_drive_scatter(positive(stated));
    Ok(())
}

/// Films another scatter of the striker than is stated.
fn film_striker_scatter(lab: &mut Laboratory<'_>, filmed: f64) -> Result<(), Error> {
    lab.synthetic.striker_scatter = Some(not_negative(filmed));
    Ok(())
}

/// Views filmed on different days: the camera stands and is focused anew, and the trigger's sensor is glued on anew.
fn days(lab: &mut Laboratory<'_>, is_stated: bool) -> Result<(), Error> {
    const VIEW_SCALE: f64 = 0.004;
    const STAGE_M: f64 = 1e-4;
    const TRIGGER_S: f64 = 60e-6;
    let effects = &mut lab.synthetic.camera.effects;
    effects.seed = lab.synthetic.seed;
    effects.scale = Some(ScaleError { view_sigma: VIEW_SCALE, ..effects.scale.take().unwrap_or_default() });
    lab.synthetic.stage_sigma_m = not_negative(STAGE_M);
    lab.synthetic.trigger_view_s = not_negative(TRIGGER_S);
    rest_until_the_earliest(lab);
    if is_stated {
        lab.experiment.camera.view_scale_sigma = positive(VIEW_SCALE);
        lab.experiment.camera.stage_sigma_m = Some(not_negative(STAGE_M));
        let sigma_s = positive(lab.synthetic.trigger_jitter_s.get());
        lab.experiment.trigger = Trigger { sigma_s, view_sigma_s: Some(not_negative(TRIGGER_S)) };
    }
    Ok(())
}

/// What is seen of the body behind the one that a view is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Neighbour {
    Unseen,
    /// At rest, until it leaves the picture.
    AtFirst,
}

/// The camera before one body after the other, with as many trials of each as the views have.
fn one_body(lab: &mut Laboratory<'_>, neighbour: Neighbour) -> Result<(), Error> {
    let rests_m = rests_m(&lab.experiment.chain)?;
    let first = lab.trials.first().map(|trial| trial.view);
    let like: Vec<Trial> = lab.trials.iter().filter(|trial| Some(trial.view) == first).cloned().collect();
    let of_body = |(number, stage_m): (u32, f64)| {
        like.iter().map(move |trial| Trial {
            recording: format!("body{number}_trial{}.cine", trial.trial),
            view: number,
            stage_m,
            ..trial.clone()
        })
    };
    *lab.trials = (1..).zip(rests_m).flat_map(of_body).collect();
    lab.synthetic.views.clear();
    lab.synthetic.camera.width_px = width_px(lab, neighbour);
    Ok(())
}

/// Columns that show a body and its neighbour as is wished. A subset that is followed keeps four pixels from the border at rest.
fn width_px(lab: &Laboratory<'_>, neighbour: Neighbour) -> usize {
    const BORDER_PX: f64 = 4.0;
    /// Of a pitch, that the neighbour goes before it leaves.
    const WAY: f64 = 0.2;
    let pitch_px = lab.experiment.chain.mean_pitch_m() * lab.synthetic.camera.scale_px_per_m;
    let next_px = lab.experiment.camera.first_body_px[0] + pitch_px;
    let half_px = lab.experiment.tracking.half_width_px as f64;
    let width_px = match neighbour {
        Neighbour::Unseen => next_px - half_px,
        Neighbour::AtFirst => next_px + half_px + BORDER_PX + WAY * pitch_px,
    };
    let group = match lab.synthetic.camera.packing {
        Packing::P10 => 4,
        Packing::P12L => 2,
        Packing::Bits8 | Packing::Bits16 => 1,
    };
    (width_px as usize).next_multiple_of(group)
}

/// The camera before one body after the other, of which one was struck harder in all trials: no other view tells that.
fn one_body_struck_harder(lab: &mut Laboratory<'_>) -> Result<(), Error> {
    const HARDER: f64 = 1.2;
    one_body(lab, Neighbour::Unseen)?;
    let views = views(lab.trials);
    let view = views[views.len() / 2];
    lab.synthetic.views = vec![FilmedView { view, drive_factor: positive(HARDER), ..AS_ALL }];
    Ok(())
}

fn one_body_one_trial(lab: &mut Laboratory<'_>) -> Result<(), Error> {
    one_body(lab, Neighbour::Unseen)?;
    trials_a_view(lab, &[1])
}

/// The camera before one body after the other, with triggers that scatter within and between views.
fn triggers(lab: &mut Laboratory<'_>, [within_s, between_s]: [f64; 2], is_stated: bool) -> Result<(), Error> {
    one_body(lab, Neighbour::Unseen)?;
    lab.synthetic.trigger_jitter_s = not_negative(within_s);
    lab.synthetic.trigger_view_s = not_negative(between_s);
    rest_until_the_earliest(lab);
    if is_stated {
        lab.experiment.trigger =
            Trigger { sigma_s: positive(within_s), view_sigma_s: Some(not_negative(between_s)) };
    }
    Ok(())
}

/// Has the chain rest until the earliest trigger may have fired, with as many frames before that as there were.
fn rest_until_the_earliest(lab: &mut Laboratory<'_>) {
    /// One trial in 15 000 lies beyond so many standard deviations to one side.
    const MARGIN: f64 = 4.0;
    let rate_hz = lab.synthetic.camera.rate_hz;
    let triggers_s = lab.synthetic.trigger_jitter_s.get().hypot(lab.synthetic.trigger_view_s.get());
    let earlier_s = MARGIN * triggers_s + 2.0 / rate_hz + lab.experiment.tracking.rest_until_s;
    if earlier_s > 0.0 {
        let frames = (earlier_s * rate_hz).ceil();
        lab.experiment.tracking.rest_until_s -= frames / rate_hz;
        lab.synthetic.first_image -= frames as i64;
        lab.synthetic.n_frames += frames as usize;
    }
}
