//! A first experiment as text: what recordings and pictures tell, and `FILL_IN` for what nobody has told.

use std::collections::BTreeMap;
use std::path::Path;

use chainwave_measurement::RecordingInfo;
use chainwave_view::table_cell;

use super::seen::SeenInRecording;

/// What stands for a number that only the user knows.
const FILL_IN: &str = "FILL_IN";

/// The key of the stage's step, which goes to the table of trials.
pub(crate) const STAGE_STEP: &str = "stage_step_m";
/// The keys of the pitch and of a ruler's length.
pub(crate) const PITCH: &str = "pitch_m";
pub(crate) const RULER_LENGTH: &str = "ruler_length_m";

/// What only the user knows: key, what it is, what helps.
pub(crate) const QUESTIONS: [[&str; 3]; 11] = [
    ["n_bodies", "bodies in the chain", ""],
    [PITCH, "pitch at rest (m)", "distance between neighbours"],
    ["mass_kg", "mass of a body (kg)", ""],
    ["striker_mass_kg", "mass of the striker (kg)", ""],
    ["velocity_m_per_s", "striker's velocity (m/s)", ""],
    ["velocity_sigma_m_per_s", "its scatter (m/s)", "standard deviation from trial to trial"],
    [
        "a",
        "contact law: a (N/m^p)",
        "force = a ((overlap + delta_0)^p - delta_0^p); chainwave contact fits it to a compression curve",
    ],
    ["delta_0_m", "delta_0 (m)", "overlap at rest"],
    ["p", "p", "exponent"],
    [STAGE_STEP, "stage from view to view (m)", "0 where the camera stays"],
    [RULER_LENGTH, "length of the ruler (m)", "where one is laid in the picture"],
];

/// A first experiment.
pub(crate) struct Draft<'a> {
    pub(crate) name: String,
    /// Of the first recording.
    pub(crate) info: &'a RecordingInfo,
    /// What the user told, by the keys of [`QUESTIONS`].
    pub(crate) known: &'a BTreeMap<String, String>,
    pub(crate) pictures: PictureLines,
}

/// What `experiment.toml` says of the pictures, in the form of its lines.
pub(crate) struct PictureLines {
    /// Key and value of the scale; nothing where a table behind says it.
    pub(crate) scale: String,
    /// The table that tells the scale otherwise, with its head; or nothing.
    pub(crate) scale_table: String,
    pub(crate) first_body: String,
    pub(crate) subset: String,
    pub(crate) rest: String,
}

/// The lines of the first recording, as far as it is known what it shows.
pub(crate) fn first_lines(info: &RecordingInfo, seen: Option<&SeenInRecording>) -> PictureLines {
    let middle = (info.height_px as f64 - 1.0) / 2.0;
    let asked = PictureLines {
        scale: "scale_px_per_m = FILL_IN          # pixels between neighbours over the pitch\n".into(),
        scale_table: String::new(),
        first_body: format!("[FILL_IN, {middle:.0}]   # column and row of body 1's marker at rest, with the stage at 0"),
        subset: "half_width_px = 16                # the subset is 33 x 33 px: the speckled part of a marker\nhalf_height_px = 16"
            .into(),
        rest: "-1e-4              # frames before this time (after the trigger) show the chain at rest".into(),
    };
    let Some((seen, first)) = seen.and_then(|seen| Some((seen, seen.row.markers.first()?))) else {
        return asked;
    };
    let subset = &first.subset;
    PictureLines {
        scale: seen.row.pitch_px.map_or(asked.scale, |pitch| {
            format!(
                "scale_px_per_m = FILL_IN          # pixels between neighbours over the pitch: {:.2} +- {:.2} px / pitch_m\n",
                pitch.value, pitch.sigma
            )
        }),
        scale_table: asked.scale_table,
        first_body: format!(
            "[{:.2}, {:.2}]   # the first marker of the first recording; right if that is body 1 and the stage stood at 0",
            subset.x_px, subset.y_px
        ),
        subset: subset_lines([subset.half_width_px, subset.half_height_px]),
        rest: seen.rest_until_s.map_or(asked.rest, |rest_s| {
            if info.rate_hz.is_none() {
                return format!(
                    "FILL_IN            # frames before this time show the chain at rest: {rest_s:.0} / rate_hz, as found in the first recording"
                );
            }
            format!("{rest_s:.3e}        # frames before this time (after the trigger) show the chain at rest: found in the first recording")
        }),
    }
}

/// The lines of a subset's size.
pub(crate) fn subset_lines([half_width_px, half_height_px]: [usize; 2]) -> String {
    format!(
        "half_width_px = {half_width_px}                # the part of a marker that has texture, off its edge\nhalf_height_px = {half_height_px}"
    )
}

/// A file's or folder's name as text; of a folder such as `.` its own.
pub(crate) fn file_name(path: &Path) -> String {
    let known = path.file_name().map(ToOwned::to_owned);
    let name = known.or_else(|| path.canonicalize().ok()?.file_name().map(ToOwned::to_owned));
    name.unwrap_or_default().to_string_lossy().into_owned()
}

/// View and trial of a recording: the last two numbers of its name, where it has two.
pub(crate) fn view_and_trial(name: &str) -> Option<[u64; 2]> {
    let stem = Path::new(name).file_stem().unwrap_or_default().to_string_lossy();
    let numbers: Vec<u64> =
        stem.split(|c: char| !c.is_ascii_digit()).filter_map(|digits| digits.parse().ok()).collect();
    numbers.last_chunk().copied()
}

/// One row a recording, with the stage's place where its step from view to view is known; it stands at 0 in the first view.
pub(crate) fn trials_table(names: &[String], stage_step_m: Option<f64>) -> String {
    let mut text = String::from("recording,view,trial,stage_m\n");
    for name in names {
        let row = match view_and_trial(name) {
            Some([view, trial]) => {
                let stage_m = stage_step_m.map(|step_m| stage_at(names, view, step_m).to_string());
                format!("{view},{trial},{}", stage_m.as_deref().unwrap_or(FILL_IN))
            }
            None => [FILL_IN; 3].join(","),
        };
        text.push_str(&format!("{},{row}\n", table_cell(name)));
    }
    text
}

/// Where the stage stands in a view, in metres from the first one of these recordings.
pub(crate) fn stage_at(names: &[String], view: u64, step_m: f64) -> f64 {
    let views = names.iter().filter_map(|name| view_and_trial(name)).map(|[view, _]| view);
    let first = views.min().unwrap_or(view);
    view.saturating_sub(first) as f64 * step_m
}

impl Draft<'_> {
    /// The text of `experiment.toml`.
    pub(crate) fn text(&self) -> String {
        let known = |key: &str| self.known.get(key).map_or(FILL_IN, String::as_str);
        let PictureLines { scale, scale_table, first_body, subset, rest } = &self.pictures;
        let first_ms = 1e3 * self.info.times_s.first().copied().unwrap_or(0.0);
        let last_ms = 1e3 * self.info.times_s.last().copied().unwrap_or(0.0);
        let (span, rate) = match self.info.rate_hz {
            Some(_) => (format!("from {first_ms:.3} to {last_ms:.3} ms"), ""),
            None => (
                "without a frame rate".to_owned(),
                "rate_hz = FILL_IN                 # frames per second, which the recordings do not state\n",
            ),
        };
        with_aligned_comments(&format!(
            "# The first recording: {format}, {width} x {height} px, {bits} bit, {n} frames {span}.
# FILL_IN marks what only you know. SI units.
name = {name}
trials = \"trials.csv\"             # recording, view, trial, stage_m (position of the stage along the chain)

[chain]
n_bodies = {n_bodies}
pitch_m = {pitch_m}                 # distance between neighbours at rest
mass_kg = {mass_kg}                 # of one body

[striker]
mass_kg = {striker_mass_kg}
velocity_m_per_s = {velocity_m_per_s}
velocity_sigma_m_per_s = {velocity_sigma_m_per_s}  # from trial to trial

[contact]                         # force = a ((overlap + delta_0)^p - delta_0^p), from a compression curve
law = \"power\"
a = {a}
delta_0_m = {delta_0_m}
p = {p}

[camera]
{rate}{scale}first_body_px = {first_body}
{scale_table}
[tracking]
{subset}
rest_until_s = {rest}
",
            format = self.info.format,
            width = self.info.width_px,
            height = self.info.height_px,
            bits = self.info.bit_depth,
            n = self.info.n_frames,
            name = toml::Value::String(self.name.clone()),
            n_bodies = known("n_bodies"),
            pitch_m = known(PITCH),
            mass_kg = known("mass_kg"),
            striker_mass_kg = known("striker_mass_kg"),
            velocity_m_per_s = known("velocity_m_per_s"),
            velocity_sigma_m_per_s = known("velocity_sigma_m_per_s"),
            a = known("a"),
            delta_0_m = known("delta_0_m"),
            p = known("p"),
        ))
    }
}

/// Spaces between the longest line of a paragraph and its comment.
const BEFORE_COMMENTS: usize = 2;

/// The same text, in which the comments behind values begin in one column of each paragraph.
fn with_aligned_comments(text: &str) -> String {
    let paragraphs = text.split("\n\n").map(|paragraph| {
        let lines: Vec<(&str, Option<&str>)> = paragraph.split('\n').map(value_and_comment).collect();
        let commented = lines.iter().filter(|(value, comment)| comment.is_some() && !value.is_empty());
        let width = commented.map(|(value, _)| value.chars().count()).max().unwrap_or(0) + BEFORE_COMMENTS;
        let line = |(value, comment): &(&str, Option<&str>)| match comment {
            Some(comment) if !value.is_empty() => format!("{value:<width$}{comment}"),
            Some(comment) => (*comment).to_owned(),
            None => (*value).to_owned(),
        };
        lines.iter().map(line).collect::<Vec<_>>().join("\n")
    });
    paragraphs.collect::<Vec<_>>().join("\n\n")
}

/// A line's value, and its comment from the mark on; a mark within a text in quotes begins none.
fn value_and_comment(line: &str) -> (&str, Option<&str>) {
    let mut is_quoted = false;
    let mark = line.char_indices().find(|(_, letter)| {
        is_quoted ^= *letter == '"';
        *letter == '#' && !is_quoted
    });
    match mark {
        Some((at, _)) => (line[..at].trim_end(), Some(&line[at..])),
        None => (line, None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_of_a_paragraph_begin_in_one_column() {
        let text = "# head\nname = \"a # b\"\ntrials = 1 # one\n\n[tracking]\na = 1        # two\nlong = -1e-4 # three\n";
        assert_eq!(
            with_aligned_comments(text),
            "# head\nname = \"a # b\"\ntrials = 1  # one\n\n[tracking]\na = 1         # two\nlong = -1e-4  # three\n"
        );
    }
}
