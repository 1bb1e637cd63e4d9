//! `r3xa.json`: the experiment in the words of photomechanics, by the specification R3XA 2024.7.1 (J.-C. Passieux et al., PM-IDICS 2024):
//! what was tested, which camera and which analysis made which data.

use std::path::Path;

use chainwave_measurement::RecordingInfo;
use serde_json::{Value, json};

/// Version of the specification.
const VERSION: &str = "2024.7.1";
/// What is said where nothing is known of a field that must be there.
const NOT_STATED: &str = "not stated";

/// What the description is made of.
pub(super) struct Described<'a> {
    /// Name of the experiment.
    pub(super) experiment: &'a str,
    pub(super) authors: Option<&'a str>,
    pub(super) license: Option<&'a str>,
    /// Day on which the results were written, as `YYYY-MM-DD`.
    pub(super) date: String,
    /// Bodies of the chain, and the mean distance of neighbours in metres.
    pub(super) chain: Option<(usize, f64)>,
    /// Pixels a metre.
    pub(super) scale_px_per_m: Option<f64>,
    /// What the first recording says of itself, where recordings are packed.
    pub(super) recording: Option<RecordingInfo>,
    pub(super) chainwave_version: &'a str,
    /// Names of the files of the package: recordings, and results.
    pub(super) recordings: Vec<&'a str>,
    pub(super) results: Vec<(&'a str, &'static str, &'static str)>,
}

/// The description. Files are data sets: recordings of the camera, tables of the analysis.
pub(super) fn description(of: &Described<'_>) -> Value {
    let mut root = json!({
        "title": format!("Impact experiment {}", of.experiment),
        "description": "A chain of bodies struck at one end and filmed by a high-speed camera; motion and wave quantities by digital image correlation",
        "version": VERSION,
        "authors": of.authors.unwrap_or(NOT_STATED),
        "date": of.date,
        "settings": [specimen(of)],
        "data_sources": [camera(of), analysis(of)],
        "data_sets": data_sets(of),
    });
    if let (Some(license), Some(root)) = (of.license, root.as_object_mut()) {
        root.insert("license".into(), license.into());
    }
    root
}

fn quantity(title: &str, value: Option<f64>, unit: &str) -> Value {
    match value {
        Some(value) => json!({ "kind": "unit", "title": title, "value": value, "unit": unit }),
        None => json!({ "kind": "unit", "title": title, "unit": unit }),
    }
}

fn specimen(of: &Described<'_>) -> Value {
    let bodies = of.chain.map(|(n_bodies, _)| n_bodies as f64);
    let pitch_m = of.chain.map(|(_, pitch_m)| pitch_m);
    json!({
        "id": "chain", "kind": "settings/specimen", "title": "Chain", "description": "Bodies in a row, touching or joined",
        "sizes": [quantity("number of bodies", bodies, "1"), quantity("distance of neighbours at rest", pitch_m, "m")],
        "patterning_technique": "Markers on the bodies",
    })
}

fn camera(of: &Described<'_>) -> Value {
    let info = of.recording.as_ref();
    let size = |px: fn(&RecordingInfo) -> usize| info.map(|info| px(info) as f64);
    let model = info.and_then(|info| info.camera.clone());
    let mut found = json!({
        "id": "camera", "kind": "data_sources/camera", "title": "High-speed camera",
        "description": "Films the bodies from the side, in one position of its stage a view",
        "output_components": 1, "output_dimension": "surface", "output_units": [quantity("grey value", None, "count")],
        "manufacturer": NOT_STATED, "model": model.unwrap_or_else(|| NOT_STATED.into()),
        "image_size": [
            quantity("width", size(|info| info.width_px), "px"), quantity("height", size(|info| info.height_px), "px"),
        ],
    });
    if let Some(entries) = found.as_object_mut() {
        if let Some(scale) = of.scale_px_per_m {
            entries.insert("image_scale".into(), quantity("scale", Some(scale), "px/m"));
        }
        if let Some(exposure_s) = info.and_then(|info| info.exposure_s) {
            entries.insert("exposure".into(), quantity("exposure", Some(exposure_s), "s"));
        }
    }
    found
}

fn analysis(of: &Described<'_>) -> Value {
    let inputs: Vec<String> = (1..=of.recordings.len()).map(|number| format!("recording-{number}")).collect();
    json!({
        "id": "chainwave", "kind": "data_sources/generic", "title": "chainwave",
        "description": "Digital image correlation (IC-GN), stitching of views and trials, wave quantities with standard uncertainties",
        "input_data_sets": inputs, "output_components": 1, "output_dimension": "curve",
        "output_units": [quantity("displacement", None, "m"), quantity("strain", None, "1")],
        "manufacturer": "chainwave", "model": of.chainwave_version,
    })
}

fn data_sets(of: &Described<'_>) -> Vec<Value> {
    let set = |id: String, title: &str, description: &str, source: &str, file_type: &str, path: &str| {
        json!({
            "id": id, "kind": "data_sets/generic", "title": title, "description": description,
            "data_sources": [source], "file_type": file_type, "path": path,
        })
    };
    let recordings = of.recordings.iter().enumerate().map(|(index, path)| {
        let name = Path::new(path).file_name().unwrap_or_default().to_string_lossy();
        let about = "Recording of the camera";
        set(format!("recording-{}", index + 1), &name, about, "camera", "application/octet-stream", path)
    });
    let results = of.results.iter().map(|(path, description, file_type)| {
        set((*path).to_owned(), path, description, "chainwave", file_type, path)
    });
    recordings.chain(results).collect()
}
