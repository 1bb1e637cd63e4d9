//! An experiment written from what was picked in the page of a folder of recordings.

use std::path::{Path, PathBuf};

use chainwave_camera::OpenOptions;
use chainwave_measurement::{RecordingInfo, Subset};
use chainwave_view::{ExperimentDraft, Picked, Question, WriteExperiment};

use crate::error::Error;
use crate::init::SeenInRecording;
use crate::init::draft::{
    Draft, PITCH, PictureLines, QUESTIONS, RULER_LENGTH, STAGE_STEP, file_name, first_lines, stage_at,
    subset_lines, trials_table, view_and_trial,
};
use crate::output::write_text;

/// Standard uncertainty of a place that is picked or proposed: the middle of a marker is known to 2 px or so.
const PICKED_SIGMA_PX: f64 = 2.0;

/// How the recordings of a folder become an experiment, where none lies there by now.
pub(super) fn of_folder(folder: &Path, recordings: Vec<PathBuf>, options: OpenOptions) -> ExperimentDraft {
    let question =
        |[key, label, hint]: [&str; 3]| Question { key: key.into(), label: label.into(), hint: hint.into() };
    let rest_until_s = recordings
        .first()
        .and_then(|first| SeenInRecording::of(first).ok())
        .and_then(|seen| seen.rest_until_s);
    let folder = folder.to_owned();
    ExperimentDraft {
        questions: QUESTIONS.map(question).into(),
        rest_until_s,
        path: folder.join("experiment.toml").display().to_string(),
        write: WriteExperiment::by(move |picked, overwrite| {
            let paper = Paper { folder: &folder, recordings: &recordings, options: &options };
            paper.write(picked, overwrite).map_err(|error| error.to_string())
        }),
    }
}

/// Where an experiment is written about which recordings.
struct Paper<'a> {
    folder: &'a Path,
    recordings: &'a [PathBuf],
    options: &'a OpenOptions,
}

impl Paper<'_> {
    fn write(&self, picked: &Picked, overwrite: bool) -> Result<String, Error> {
        let paths = ["experiment.toml", "trials.csv"].map(|name| self.folder.join(name));
        if let Some(path) = paths.iter().find(|path| path.exists() && !overwrite) {
            let path = path.display();
            return Err(Error::Argument(format!("{path}: is there already; nothing was written")));
        }
        let names: Vec<String> = self.recordings.iter().map(|path| file_name(path)).collect();
        let Some(path) = self.recordings.get(picked.recording) else {
            return Err(Error::Argument("the recording is not of this folder".into()));
        };
        let info = chainwave_camera::open_with(path, self.options)?.info().clone();
        let number = |key: &str| picked.answers.get(key).and_then(|answer| answer.parse::<f64>().ok());
        let stage_m = view_and_trial(&file_name(path))
            .zip(number(STAGE_STEP))
            .map(|([view, _], step_m)| stage_at(&names, view, step_m));
        let line = BodyLine::through(picked, number(PITCH), number(RULER_LENGTH))?;
        let draft = Draft {
            name: file_name(self.folder),
            info: &info,
            known: &picked.answers,
            pictures: lines(picked, &info, &line, stage_m.zip(number(PITCH))),
        };
        let [experiment_path, trials_path] = &paths;
        let (experiment, trials) = (draft.text(), trials_table(&names, number(STAGE_STEP)));
        write_text(trials_path, &trials)?;
        write_text(experiment_path, &experiment)?;
        Ok(said(&paths, &[experiment, trials]))
    }
}

/// What was written, what is missing, and what comes next.
fn said([experiment, trials]: &[PathBuf; 2], texts: &[String; 2]) -> String {
    let missing = |text: &String| {
        text.lines().filter(|line| !line.starts_with('#') && line.contains("FILL_IN")).count()
    };
    let left = match missing(&texts[0]) + missing(&texts[1]) {
        0 => String::new(),
        n => format!("{n} line(s) still say FILL_IN.\n"),
    };
    let (experiment, trials) = (experiment.display(), trials.display());
    format!(
        "wrote {experiment} and {trials}.\n{left}Next: chainwave check {experiment}, then chainwave run {experiment} --out RESULTS"
    )
}

/// Places of bodies by their numbers: on a line, at equal distances.
#[derive(Debug, PartialEq)]
struct BodyLine {
    /// Column and row of body 1.
    first_px: [f64; 2],
    /// From one body to the next, where it is known.
    step_px: Option<[f64; 2]>,
}

impl BodyLine {
    /// The line through the subsets, by least squares; of a single one, by a ruler of known length and the pitch.
    fn through(picked: &Picked, pitch_m: Option<f64>, ruler_m: Option<f64>) -> Result<Self, Error> {
        let number = |subset: &Subset| -> Result<f64, Error> {
            let number: Option<u32> = subset.name.parse().ok().filter(|number| *number > 0);
            number.map(f64::from).ok_or_else(|| {
                let name = &subset.name;
                Error::Argument(format!("subset {name:?}: expected the number of a body, from 1 next to the striker (hint: the button that numbers them)"))
            })
        };
        let numbers: Vec<f64> = picked.subsets.iter().map(number).collect::<Result<_, _>>()?;
        let n = numbers.len() as f64;
        let mean = numbers.iter().sum::<f64>() / n;
        let places = |axis: usize| picked.subsets.iter().map(move |subset| [subset.x_px, subset.y_px][axis]);
        let middle = [0, 1].map(|axis| places(axis).sum::<f64>() / n);
        let spread: f64 = numbers.iter().map(|number| (number - mean).powi(2)).sum();
        let slope = |axis: usize| {
            numbers.iter().zip(places(axis)).map(|(number, place)| (number - mean) * place).sum::<f64>()
                / spread
        };
        let by_ruler = || {
            let ([[x0, y0], [x1, y1]], share) =
                picked.ruler_px.zip(pitch_m.zip(ruler_m).map(|(pitch, ruler)| pitch / ruler))?;
            Some([share * (x1 - x0), share * (y1 - y0)])
        };
        let step_px = if spread > 0.0 { Some([0, 1].map(slope)) } else { by_ruler() };
        let back = step_px.unwrap_or([0.0; 2]);
        if step_px.is_none() && mean > 1.0 {
            return Err(Error::Argument(format!(
                "body {mean}: expected two bodies or more, body 1, or a ruler of known length: nothing else tells where body 1 lies"
            )));
        }
        Ok(Self { first_px: [0, 1].map(|axis| middle[axis] - (mean - 1.0) * back[axis]), step_px })
    }

    /// Where body 1 would be seen with the stage at 0, where that is known to stand at a place now.
    fn first_at_zero(&self, stage_and_pitch_m: Option<(f64, f64)>) -> [f64; 2] {
        let share = stage_and_pitch_m.map_or(0.0, |(stage_m, pitch_m)| stage_m / pitch_m);
        let step_px = self.step_px.unwrap_or([0.0; 2]);
        [0, 1].map(|axis| self.first_px[axis] + share * step_px[axis])
    }
}

/// The lines about the pictures.
fn lines(
    picked: &Picked,
    info: &RecordingInfo,
    line: &BodyLine,
    stage_and_pitch_m: Option<(f64, f64)>,
) -> PictureLines {
    let PictureLines { scale, rest, .. } = first_lines(info, None);
    let scale_table = match picked.ruler_px {
        Some([[x0, y0], [x1, y1]]) => format!(
            "
[camera.ruler]                    # laid in the page, its ends known to a pixel or so
ends_px = [[{x0:.1}, {y0:.1}], [{x1:.1}, {y1:.1}]]
sigma_px = 1.0
length_m = {}
length_sigma_m = 0.0
",
            picked.answers.get(RULER_LENGTH).map_or("FILL_IN", String::as_str)
        ),
        None if picked.subsets.len() > 1 => {
            // `02` is no number for whoever reads the file.
            let number =
                |name: &str| name.parse::<u64>().map_or(name.to_owned(), |number| number.to_string());
            let numbers: Vec<String> = picked.subsets.iter().map(|subset| number(&subset.name)).collect();
            let at: Vec<String> = picked
                .subsets
                .iter()
                .map(|subset| format!("[{:.1}, {:.1}]", subset.x_px, subset.y_px))
                .collect();
            format!(
                "
[camera.marks]                    # picked in the page; the scale is as sure as these places: a calibration knows it better
bodies = [{}]
at_px = [{}]
sigma_px = {PICKED_SIGMA_PX:?}
",
                numbers.join(", "),
                at.join(", ")
            )
        }
        None => String::new(),
    };
    let [x, y] = line.first_at_zero(stage_and_pitch_m);
    let half = |of: fn(&Subset) -> usize| picked.subsets.iter().map(of).min().unwrap_or(16);
    let mut subset =
        subset_lines([half(|subset| subset.half_width_px), half(|subset| subset.half_height_px)]);
    if let Some(outlined) = picked.subsets.iter().find(|subset| !subset.outline_px.is_empty()) {
        subset = subset_lines([outlined.half_width_px, outlined.half_height_px]);
        let corners: Vec<String> =
            outlined.outline_px.iter().map(|[x, y]| format!("[{x:?}, {y:?}]")).collect();
        subset.push_str(&format!("\noutline_px = [{}]", corners.join(", ")));
    }
    PictureLines {
        scale: if scale_table.is_empty() { scale } else { String::new() },
        scale_table,
        first_body: format!("[{x:.2}, {y:.2}]   # body 1's marker at rest, with the stage at 0"),
        subset,
        rest: picked.rest_until_s.map_or(rest, |rest_s| {
            format!(
                "{rest_s:.4e}        # frames before this time (after the trigger) show the chain at rest"
            )
        }),
    }
}
