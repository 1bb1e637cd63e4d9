//! How it was measured: what the Good Practices Guide of the International DIC Society asks a paper to report (E. M. C. Jones, M. A. Iadicola,
//! 2018, ch. 5.4), as far as files tell it.

use chainwave_camera::open_with;
use chainwave_experiment::{Results, Setup};
use chainwave_measurement::median;
use chrono::{DateTime, Utc};

use super::markup::{Cell, table};

/// The settings and the noise floor of the first recording that was tracked.
pub(super) fn section(setup: &Setup, results: &Results) -> String {
    let mut rows: Vec<(&str, String)> = Vec::new();
    let first = results.tracked.recordings.first();
    let opened = first.and_then(|one| open_with(&setup.path_of(&one.trial), &setup.open_options()).ok());
    if let Some(recording) = &opened {
        let info = recording.info();
        let camera = info.camera.clone().unwrap_or_else(|| "not named by the file".into());
        rows.push(("camera", camera));
        rows.push((
            "picture",
            format!("{} x {} px, {} bit ({})", info.width_px, info.height_px, info.bit_depth, info.format),
        ));
        rows.extend(info.triggered_unix_s.and_then(date).map(|date| ("filmed", date)));
        rows.extend(info.rate_hz.map(|rate_hz| ("frame rate", format!("{rate_hz:.1} Hz"))));
        rows.extend(info.exposure_s.map(|exposure_s| ("exposure", format!("{:.2} µs", 1e6 * exposure_s))));
    }
    let tracking = &setup.experiment.tracking;
    let m_per_px = setup.map.m_per_px();
    let scale_sigma = match m_per_px.sigma > 0.0 {
        true => format!("± {:.2} µm/px", 1e6 * m_per_px.sigma),
        false => "µm/px, taken as exact".into(),
    };
    rows.push(("scale", format!("{:.2} {scale_sigma}", 1e6 * m_per_px.value)));
    rows.push((
        "subset",
        format!("{} x {} px", 2 * tracking.half_width_px + 1, 2 * tracking.half_height_px + 1),
    ));
    rows.push(("shape function", tracking.shape.to_string()));
    rows.push(("interpolation", tracking.interpolation.to_string()));
    rows.push(("matching", methods(results)));
    rows.push(("at rest", format!("until {:.3} ms after the trigger", 1e3 * tracking.rest_until_s)));
    if let Some((found_px, stated_px)) = noise_floor(setup, results) {
        rows.push((
            "noise floor",
            format!(
                "{found_px:.4} px = {:.3} µm along the chain (standard deviation at rest; stated {stated_px:.4} px)",
                1e6 * found_px * m_per_px.value
            ),
        ));
    }
    let rows = rows.into_iter().map(|(name, value)| vec![Cell::text(name), Cell::text(&value)]);
    format!("<h2>How it was measured</h2>{}", table(&["", ""], rows))
}

/// When the first recording was made, by the camera's clock.
fn date(unix_s: f64) -> Option<String> {
    let at: DateTime<Utc> = DateTime::from_timestamp(unix_s as i64, 0)?;
    Some(format!(
        "{} (trigger of the first recording, by the camera's clock)",
        at.format("%Y-%m-%d %H:%M:%S UTC")
    ))
}

/// The methods that bodies were followed with, each once.
fn methods(results: &Results) -> String {
    let bodies = results.tracked.recordings.iter().flat_map(|one| &one.tracks.bodies);
    let mut names: Vec<&str> = bodies.map(|body| body.method.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    names.join(", ")
}

/// Median over all bodies of the standard deviation at rest in pixels, and of the stated one; of bodies with ten frames at rest at least.
fn noise_floor(setup: &Setup, results: &Results) -> Option<(f64, f64)> {
    const LEAST: usize = 10;
    let rest_until_s = setup.experiment.tracking.rest_until_s;
    let (mut found, mut stated) = (Vec::new(), Vec::new());
    for one in &results.tracked.recordings {
        let n_rest = one.tracks.times_s.partition_point(|time_s| *time_s < rest_until_s);
        for body in &one.tracks.bodies {
            let rest: Vec<_> = body.positions.iter().take(n_rest).flatten().map(|found| found.x_px).collect();
            if rest.len() < LEAST {
                continue;
            }
            let n = rest.len() as f64;
            let mean = rest.iter().map(|x| x.value).sum::<f64>() / n;
            let squares = rest.iter().map(|x| (x.value - mean).powi(2)).sum::<f64>();
            found.push((squares / (n - 1.0)).sqrt());
            stated.extend(median(rest.iter().map(|x| x.sigma).collect()));
        }
    }
    Some((median(found)?, median(stated)?))
}
