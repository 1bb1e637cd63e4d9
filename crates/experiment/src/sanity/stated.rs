//! Numbers that contradict each other before any picture is looked at: the scale, the masses, the striker's velocity.

use chainwave_measurement::{RecordingInfo, median_interval_s};

use super::view_at_rest::ViewAtRest;
use crate::error::Error;
use crate::finding::Finding;
use crate::setup::Setup;

/// The smallest subset that the tracker takes, across.
const LEAST_SUBSET_PX: f64 = 11.0;
/// Half of a usual subset, for a hint.
const USUAL_HALF_PX: f64 = 16.0;

/// The key that the scale comes from.
pub(super) fn scale_key(setup: &Setup) -> &'static str {
    let camera = &setup.experiment.camera;
    match (&camera.ruler, &camera.marks, &camera.calibration) {
        (Some(_), ..) => "camera.ruler",
        (_, Some(_), _) => "camera.marks",
        (.., Some(_)) => "camera.calibration",
        _ => "camera.scale_px_per_m",
    }
}

/// Neighbours must be apart in the picture, and several of them in it.
///
/// # Errors
/// [`Error::Configuration`] where neighbours lie inside each other's subsets.
pub(super) fn scale(setup: &Setup, views: &[ViewAtRest]) -> Result<Option<Finding>, Error> {
    let (chain, tracking) = (&setup.experiment.chain, &setup.experiment.tracking);
    let px_per_m = setup.map.m_per_px().value.recip();
    let pitch_px = chain.mean_pitch_m() * px_per_m;
    let subset_px = (2 * tracking.half_width_px + 1) as f64;
    let lengths_px = views.iter().map(|view| {
        let info = view.recording.info();
        setup.map.length_px(info.width_px, info.height_px)
    });
    let length_px = lengths_px.fold(0.0, f64::max);
    let key = scale_key(setup);
    let stated = format!(
        "neighbours should lie {pitch_px:.4} px apart (chain.pitch_m = {}, {px_per_m} px/m)",
        chain.mean_pitch_m()
    );
    let fits = |factor: f64| (subset_px..=length_px).contains(&(factor * pitch_px));
    let of_scale = [(1e3, "px/mm"), (1e2, "px/cm"), (1e6, "px/um")].into_iter().map(|(factor, unit)| {
        (
            factor,
            format!(" (hint: {} px/m if {key} is in {unit}, or pitch_m in another unit)", factor * px_per_m),
        )
    });
    let of_pitch = [(1e-3, "mm"), (1e-2, "cm"), (1e-6, "um")].into_iter().map(|(factor, unit)| {
        let pitch_m = factor * chain.mean_pitch_m();
        (factor, format!(" (hint: pitch_m = {pitch_m} if the pitch is in {unit}, or {key} in another unit)"))
    });
    let unit =
        of_scale.chain(of_pitch).find(|(factor, _)| fits(*factor)).map(|(_, hint)| hint).unwrap_or_default();
    if pitch_px <= 0.5 * subset_px {
        // Neighbours that lie well apart in the picture have no wrong unit: their subsets are too large.
        let (key, hint) = match pitch_px >= LEAST_SUBSET_PX {
            true => {
                let half_px = (0.5 * (pitch_px - 1.0)).floor().min(USUAL_HALF_PX);
                ("tracking.half_width_px", format!(" (hint: half_width_px = {half_px})"))
            }
            false => (key, unit),
        };
        return Err(Error::Configuration {
            path: setup.path.clone(),
            message: format!("{key}: {stated}, inside each other's subsets of {subset_px} px{hint}"),
        });
    }
    let found = |code, text| Ok(Some(Finding { code, subject: key.into(), text }));
    if pitch_px < subset_px {
        return found(
            "subsets_overlap",
            format!("{stated}, and subsets of {subset_px} px overlap: each sees its neighbours move{unit}"),
        );
    }
    if pitch_px > length_px {
        return found(
            "scale",
            format!("{stated}, in a picture of {length_px:.0} px that then shows one body at most{unit}"),
        );
    }
    Ok(None)
}

/// Recordings without a frame rate: times count frames, and so does whatever follows from them.
pub(super) fn frame_rate(setup: &Setup, views: &[ViewAtRest]) -> Option<Finding> {
    let view = views.iter().find(|view| view.recording.info().rate_hz.is_none())?;
    let recording = &view.trial.recording;
    setup.experiment.camera.rate_hz.is_none().then(|| Finding {
        code: "frame_rate",
        subject: "camera.rate_hz".into(),
        text: format!(
            "{recording} states no frame rate: times count frames and not seconds, also tracking.rest_until_s, and no speed or damping can be \
             right (hint: rate_hz = 25000, say)"
        ),
    })
}

/// The rest must end while something is still filmed.
///
/// # Errors
/// [`Error::Configuration`] where it lasts as long as every recording.
pub(super) fn rest(setup: &Setup, views: &[ViewAtRest]) -> Result<(), Error> {
    let rest_until_s = setup.experiment.tracking.rest_until_s;
    let infos = || views.iter().map(|view| view.recording.info());
    let last_s = infos().filter_map(RecordingInfo::last_s).fold(f64::NEG_INFINITY, f64::max);
    if rest_until_s < last_s || last_s == f64::NEG_INFINITY {
        return Ok(());
    }
    let first_s = infos().filter_map(|info| info.times_s.first().copied()).fold(f64::INFINITY, f64::min);
    let in_ms = 1e-3 * rest_until_s;
    let hint = match (first_s..last_s).contains(&in_ms) {
        true => format!("{in_ms} if it is in ms"),
        false => "frames before it show the chain at rest; times count from the trigger".into(),
    };
    Err(Error::Configuration {
        path: setup.path.clone(),
        message: format!(
            "tracking.rest_until_s: expected a time before the last frame, at {last_s:.6} s, found {rest_until_s} s: nothing is left that moves \
             (hint: {hint})"
        ),
    })
}

/// Times of profiles that are filmed; a time that no recording reaches is drawn nowhere.
pub(super) fn profile_times(setup: &Setup, views: &[ViewAtRest]) -> Option<Finding> {
    let last_s =
        views.iter().filter_map(|view| view.recording.info().last_s()).fold(f64::NEG_INFINITY, f64::max);
    let times_s = setup.experiment.analysis.profile_times_s.as_ref()?;
    let outside_s = *times_s.iter().find(|time_s| !(0.0..=last_s).contains(*time_s))?;
    let in_ms = (0.0..=last_s).contains(&(1e-3 * outside_s));
    let hint = if in_ms { "are they in milliseconds?" } else { "times count from the trigger" };
    last_s.is_finite().then(|| Finding {
        code: "profile_times",
        subject: "analysis.profile_times_s".into(),
        text: format!(
            "expected times from 0 to {last_s:.4} s, which are filmed, found {outside_s} s, of which no profile is drawn \
             (hint: {hint})"
        ),
    })
}

/// Force over overlap of the first gap where it holds the energy that the striker brings; 0 where there is no striker.
fn struck_stiffness_n_per_m(setup: &Setup) -> Result<f64, Error> {
    /// Doublings of the first overlap: from a nanometre to metres.
    const DOUBLINGS: i32 = 32;
    let Some(striker) = &setup.experiment.striker else { return Ok(0.0) };
    let brought_j = 0.5 * striker.mass_kg.get() * striker.velocity_m_per_s.get().powi(2);
    let chain = setup.experiment.chain_model()?;
    let contact = chain.contact.of_gap(0);
    let overlaps_m = (0..DOUBLINGS).map(|k| 1e-9 * 2.0_f64.powi(k));
    let holds = |overlap_m: &f64| contact.energy()(*overlap_m) >= brought_j;
    Ok(overlaps_m
        .into_iter()
        .find(holds)
        .map_or(0.0, |overlap_m| contact.force_and_energy(overlap_m).0 / overlap_m))
}

/// A striker so many times as heavy or light as a body is none.
const MOST_MASS_RATIO: f64 = 1000.0;
/// Fewer gaps than this in a whole recording are no wave that could be measured.
const LEAST_GAPS: f64 = 2.0;
/// More gaps than this between two frames cannot be told apart.
const MOST_GAPS_A_FRAME: f64 = 2.0;

/// Masses and contact law say how fast a wave runs: it should pass a few gaps while it is filmed, and not many from frame to frame.
///
/// # Errors
/// A contact law that makes no sense.
pub(super) fn masses(setup: &Setup, views: &[ViewAtRest]) -> Result<Vec<Finding>, Error> {
    let chain = &setup.experiment.chain;
    let mut findings = Vec::new();
    let striker_kg = setup.experiment.striker.as_ref().map(|striker| striker.mass_kg.get());
    let ratio = striker_kg.map(|mass_kg| mass_kg / chain.mean_mass_kg());
    let is_odd = |ratio: &f64| !(MOST_MASS_RATIO.recip()..=MOST_MASS_RATIO).contains(ratio);
    if let Some((mass_kg, ratio)) = striker_kg.zip(ratio.filter(is_odd)) {
        findings.push(Finding {
            code: "masses",
            subject: "striker.mass_kg".into(),
            text: format!(
                "{mass_kg} kg is {ratio:.3e} times chain.mass_kg = {} kg (hint: is one of them in grams?)",
                chain.mean_mass_kg()
            ),
        });
    }
    let linear = setup.experiment.linear_chain()?;
    let infos = || views.iter().map(|view| view.recording.info());
    let longest_s = infos().filter_map(RecordingInfo::last_s).fold(0.0, f64::max);
    let frame_s = infos().filter_map(|info| median_interval_s(&info.times_s)).fold(f64::INFINITY, f64::min);
    let bodies_per_s = linear.bodies_per_s();
    // Contacts that stiffen, as Hertz's do, carry a strong wave faster than a weak one.
    let stiffer = struck_stiffness_n_per_m(setup)? / linear.stiffness_n_per_m;
    let (in_all, in_a_frame) = (bodies_per_s * stiffer.max(1.0).sqrt() * longest_s, bodies_per_s * frame_s);
    let speed = linear.sound_speed_m_per_s(chain.mean_pitch_m());
    let told = format!(
        "with a mass of {} kg and a stiffness of {:.4e} N/m a wave runs at {speed:.3e} m/s",
        chain.mean_mass_kg(),
        linear.stiffness_n_per_m
    );
    let subject = || "chain.mass_kg and contact".to_owned();
    if longest_s > 0.0 && in_all < LEAST_GAPS {
        let hint = "are masses in grams, or is the contact law in other units?";
        let text = format!(
            "{told} and passes {in_all:.2} gaps in the {longest_s:.4} s that are filmed after the trigger (hint: {hint})"
        );
        findings.push(Finding { code: "masses", subject: subject(), text });
    } else if in_a_frame > MOST_GAPS_A_FRAME {
        let hint = "is the mass in other units, or the frame rate wrong?";
        let text =
            format!("{told} and passes {in_a_frame:.1} gaps from one frame to the next (hint: {hint})");
        findings.push(Finding { code: "masses", subject: subject(), text });
    }
    Ok(findings)
}

/// Pitches that a striker flies from one frame to the next beyond which no frame shows its impact.
const MOST_PITCHES_A_FRAME: f64 = 2.0;

/// A striker flies a pitch or so while many frames are taken, and farther than a pixel while all are.
pub(super) fn velocity(setup: &Setup, views: &[ViewAtRest]) -> Option<Finding> {
    let velocity_m_per_s = setup.experiment.striker.as_ref()?.velocity_m_per_s.get();
    let infos = || views.iter().map(|view| view.recording.info());
    let longest_s = infos().filter_map(RecordingInfo::last_s).fold(0.0, f64::max);
    let frame_s = infos().filter_map(|info| median_interval_s(&info.times_s)).fold(f64::INFINITY, f64::min);
    let m_per_px = setup.map.m_per_px().value;
    let (in_all_px, in_a_frame) = (
        velocity_m_per_s * longest_s / m_per_px,
        velocity_m_per_s * frame_s / setup.experiment.chain.mean_pitch_m(),
    );
    let moves = if frame_s.is_finite() && in_a_frame > MOST_PITCHES_A_FRAME {
        format!("{in_a_frame:.1} pitches from one frame to the next")
    } else if longest_s > 0.0 && in_all_px < 1.0 {
        format!("{in_all_px:.3} px in the {longest_s:.4} s that are filmed after the trigger")
    } else {
        return None;
    };
    Some(Finding {
        code: "velocity",
        subject: "striker.velocity_m_per_s".into(),
        text: format!(
            "at {velocity_m_per_s} m/s the striker flies {moves} (hint: is it in mm/s or km/s, or the frame rate wrong?)"
        ),
    })
}
