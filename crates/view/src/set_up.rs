//! An experiment that is set up in the page: what was picked in a picture, and the numbers that no picture tells.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use chainwave_measurement::{RecordingInfo, Subset};
use serde::{Deserialize, Serialize};

use crate::points::{SentPoint, checked};
use crate::refusal::Refusal;

const MOST_ANSWER_CHARS: usize = 40;

/// What the page asks for, and what writes the experiment.
#[derive(Debug, Clone)]
pub struct ExperimentDraft {
    /// What is asked for, in the order of the form.
    pub questions: Vec<Question>,
    /// The last frame of each recording's rest as a time, in seconds after the trigger, where it is known beforehand.
    pub rest_until_s: Option<f64>,
    /// Where the experiment is written to, for the page.
    pub path: String,
    /// Writes it.
    pub write: WriteExperiment,
}

/// A number that only the user knows.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Question {
    /// The name that the answer is sent under.
    pub key: String,
    /// What is asked for, with its unit.
    pub label: String,
    /// What helps to answer; may be empty.
    pub hint: String,
}

/// What was picked in the picture of one recording, and what was answered.
#[derive(Debug, Clone, PartialEq)]
pub struct Picked {
    /// The recording's place in the collection.
    pub recording: usize,
    /// Subsets named by the numbers of their bodies.
    pub subsets: Vec<Subset>,
    /// Both ends of a known length, column and row in pixels.
    pub ruler_px: Option<[[f64; 2]; 2]>,
    /// Until when nothing moves, in seconds after the trigger.
    pub rest_until_s: Option<f64>,
    /// Answers by the keys of their questions; none is empty.
    pub answers: BTreeMap<String, String>,
}

/// Writes an experiment, over one that is there where that is allowed. What was written, or what hinders it, is said in words.
#[derive(Clone)]
pub struct WriteExperiment(Arc<Write>);

type Write = dyn Fn(&Picked, bool) -> Result<String, String> + Send + Sync;

impl WriteExperiment {
    /// Writes it by a function.
    pub fn by(write: impl Fn(&Picked, bool) -> Result<String, String> + Send + Sync + 'static) -> Self {
        Self(Arc::new(write))
    }
}

impl fmt::Debug for WriteExperiment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("WriteExperiment")
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Sent {
    points: Vec<SentPoint>,
    ruler_px: Option<[[f64; 2]; 2]>,
    rest_until_s: Option<f64>,
    answers: BTreeMap<String, String>,
}

impl ExperimentDraft {
    /// Writes what was sent about a recording; what there is to say.
    pub(crate) fn write(
        &self,
        path: &str,
        body: &[u8],
        (recording, info): (usize, &RecordingInfo),
        overwrite: bool,
    ) -> Result<String, Refusal> {
        let refuse = |expected: String, found: String| Refusal::new(400, path, expected, found);
        let sent: Sent = serde_json::from_slice(body)
            .map_err(|error| refuse("{points, ruler_px, rest_until_s, answers}".into(), error.to_string()))?;
        let numbers = sent.ruler_px.iter().flatten().flatten().chain(&sent.rest_until_s);
        if !numbers.clone().all(|number| number.is_finite()) {
            return Err(refuse("finite numbers".into(), "another one".into()));
        }
        let mut answers = BTreeMap::new();
        for (key, answer) in sent.answers {
            let Some(question) = self.questions.iter().find(|question| question.key == key) else {
                return Err(refuse("answers to what was asked".into(), shortened(&key)));
            };
            // Some write decimals behind a comma.
            let number = answer.trim().replacen(',', ".", 1);
            // As it is written for whoever reads the file: `.03` and `5.` are none there.
            let written = match (number.parse::<u64>(), number.parse::<f64>()) {
                (Ok(whole), _) => Some(whole.to_string()),
                (_, Ok(value)) if value.is_finite() => Some(format!("{value:?}")),
                _ => None,
            };
            match (number.is_empty(), written) {
                (true, _) => {}
                (false, Some(written)) => {
                    answers.insert(key, written);
                }
                (false, None) => {
                    return Err(refuse(
                        format!("{}: a number, or nothing", question.label),
                        shortened(&answer),
                    ));
                }
            }
        }
        let picked = Picked {
            recording,
            subsets: checked(path, sent.points, info)?,
            ruler_px: sent.ruler_px,
            rest_until_s: sent.rest_until_s,
            answers,
        };
        let WriteExperiment(write) = &self.write;
        write(&picked, overwrite)
            .map_err(|why| Refusal::new(409, path, "an experiment that can be written", why))
    }
}

fn shortened(text: &str) -> String {
    text.chars().take(MOST_ANSWER_CHARS).collect()
}
