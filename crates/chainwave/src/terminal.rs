//! What a command says: lines of text on standard output, or with `--json` one object that holds them.
//!
//! Every command speaks through [`say!`]; one whose results are numbers also [`tell`]s them by key, and one that has an object of its own
//! [`answer`]s with it.

use std::fmt::Display;
use std::io::{ErrorKind, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use serde_json::{Map, Value, json};

static IS_QUIET: AtomicBool = AtomicBool::new(false);
static IS_JSON: AtomicBool = AtomicBool::new(false);
static PRINTED: Mutex<Printed> = Mutex::new(Printed {
    said: Vec::new(),
    failed: Vec::new(),
    keys: Vec::new(),
    has_answered: false,
    unwritten: None,
});

/// What was said so far.
struct Printed {
    said: Vec<String>,
    failed: Vec<String>,
    keys: Vec<(&'static str, Value)>,
    has_answered: bool,
    unwritten: Option<String>,
}

/// How the user wants to be spoken to: with nothing but errors on standard error, and with JSON on standard output.
pub(crate) fn set(is_quiet: bool, is_json: bool) {
    IS_QUIET.store(is_quiet, Ordering::Relaxed);
    IS_JSON.store(is_json, Ordering::Relaxed);
}

/// Whether nothing is to be said on standard error but errors.
pub(crate) fn is_quiet() -> bool {
    IS_QUIET.load(Ordering::Relaxed)
}

/// Whether standard output is to be JSON.
pub(crate) fn is_json() -> bool {
    IS_JSON.load(Ordering::Relaxed)
}

/// Says a line, as `println!` takes it.
macro_rules! say {
    ($($argument:tt)*) => { $crate::terminal::say_line(format!($($argument)*)) };
}
pub(crate) use say;

/// Says a line.
pub(crate) fn say_line(line: String) {
    match is_json() {
        true => told(|told| told.said.push(line)),
        false => print(&line),
    }
}

/// Prints a line; to a reader who has heard enough and closed the pipe, nothing more, while the work goes on. What else keeps it from being
/// written is told at the end ([`unwritten`]).
fn print(line: &str) {
    let mut stdout = std::io::stdout();
    match writeln!(stdout, "{line}").and_then(|()| stdout.flush()) {
        Err(why) if why.kind() != ErrorKind::BrokenPipe => {
            told(|told| told.unwritten = Some(why.to_string()));
        }
        _ => {}
    }
}

/// Why standard output could not be written, where it could not.
pub(crate) fn unwritten() -> Option<String> {
    told(|told| told.unwritten.take())
}

/// Writes a line on standard error; where that is gone, the work goes on.
pub(crate) fn complain(line: impl Display) {
    let _gone = writeln!(std::io::stderr(), "chainwave: {line}");
}

/// Puts an input that failed, with its reason, into the object.
pub(crate) fn tell_failure(reason: String) {
    if is_json() {
        told(|told| told.failed.push(reason));
    }
}

/// Puts a value under a key of the object, for programs; a key that is told twice has the later value.
pub(crate) fn tell(key: &'static str, value: Value) {
    if is_json() {
        told(|told| {
            told.keys.retain(|(known, _)| *known != key);
            told.keys.push((key, value));
        });
    }
}

/// Answers with an object of its own in place of the lines.
pub(crate) fn answer(value: &Value) {
    told(|told| told.has_answered = true);
    print(&format!("{value:#}"));
}

/// Prints the object, where the user wants one and the command has not answered: the inputs that failed, or why nothing was done, among it.
pub(crate) fn close(error: Option<&str>) {
    if !is_json() {
        return;
    }
    let object = told(|told| {
        if told.has_answered {
            return None;
        }
        let mut object = Map::new();
        object.insert("failed".into(), json!(told.failed));
        if let Some(error) = error {
            object.insert("error".into(), json!(error));
        }
        object.extend(told.keys.drain(..).map(|(key, value)| (key.to_owned(), value)));
        object.insert("said".into(), json!(told.said));
        Some(Value::Object(object))
    });
    object.iter().for_each(|object| print(&format!("{object:#}")));
}

fn told<R>(with: impl FnOnce(&mut Printed) -> R) -> R {
    with(&mut PRINTED.lock().unwrap_or_else(PoisonError::into_inner))
}
