//! OpenCV on demand: what takes it is done by the program `chainwave-opencv`, the same command with OpenCV, which this process becomes.
//!
//! A command finds out that it takes OpenCV before it has printed or written anything, and says so with an error. Then the process is
//! replaced, with the same arguments, so that users see one command; it starts without OpenCV's 250 libraries, and builds without them.

use std::env;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use chainwave_camera::{CameraError, OpenOptions, needs_opencv, open_with};
use chainwave_correlation::{CorrelationError, has_foreign};
use chainwave_experiment::{MethodChoice, Setup};

use crate::error::Error;

/// The program with OpenCV.
const PROGRAM: &str = "chainwave-opencv";
/// Version of the program that handed its command over. Where it is set nobody hands it on.
const HANDED_OVER: &str = "CHAINWAVE_HANDED_OVER";

/// Whether a program with OpenCV can take over.
pub(crate) fn is_there() -> bool {
    program().is_some()
}

/// Refuses recordings that take OpenCV, where a program that has it can take over. Where there is none they fail as others do, each by itself.
pub(crate) fn expect_readable<P: AsRef<Path>>(
    recordings: impl IntoIterator<Item = P>,
    options: &OpenOptions,
) -> Result<(), Error> {
    for recording in recordings {
        if needs_opencv(recording.as_ref(), options) && is_there() {
            open_with(recording.as_ref(), options)?;
        }
    }
    Ok(())
}

/// The same for the recordings of an experiment.
pub(crate) fn expect_recordings_of(setup: &Setup) -> Result<(), Error> {
    let paths = setup.trials.iter().map(|trial| setup.path_of(trial));
    expect_readable(paths, &setup.open_options())
}

/// Refuses a method that takes OpenCV.
pub(crate) fn expect_method(choice: &MethodChoice) -> Result<(), Error> {
    match choice {
        MethodChoice::Method(method) if method.is_foreign() && !has_foreign() => {
            Err(CorrelationError::NeedsOpenCv { method: method.to_string() }.into())
        }
        _ => Ok(()),
    }
}

/// Before a choice among all methods: an error where a program with OpenCV can take over, and where there is none, what is to be said of
/// the methods that are left out.
pub(crate) fn expect_all_methods() -> Result<Option<String>, Error> {
    if has_foreign() {
        return Ok(None);
    }
    if is_there() {
        return Err(Error::ChoiceWithOpenCv);
    }
    Ok(Some(format!(
        "OpenCV's methods are left out: there is no {PROGRAM} beside this program or on the path"
    )))
}

/// Becomes the program with OpenCV. Returns, with the reason, only where that cannot be.
pub(crate) fn hand_over() -> String {
    let Some(program) = program() else {
        return format!("there is no {PROGRAM} beside this program or on the path");
    };
    // Nothing should wait there; if it does, it was meant to be seen.
    let _ = std::io::stdout().flush();
    let mut arguments = env::args_os();
    let own_name = arguments.next();
    let mut command = Command::new(&program);
    command.args(arguments).env(HANDED_OVER, env!("CARGO_PKG_VERSION"));
    format!("{}: {}", program.display(), replaced_by(&mut command, own_name))
}

/// Refuses a command that a program of another version has handed over: its tracks may be others.
pub(crate) fn expect_same_version() -> Result<(), Error> {
    let own = env!("CARGO_PKG_VERSION");
    match env::var(HANDED_OVER) {
        Ok(theirs) if theirs != own => Err(Error::Argument(format!(
            "{PROGRAM}: expected version {theirs}, which chainwave has, found {own} (hint: build both anew)"
        ))),
        _ => Ok(()),
    }
}

/// Where the program with OpenCV lies: beside this one, or where the path leads.
fn program() -> Option<PathBuf> {
    if env::var_os(HANDED_OVER).is_some() {
        return None;
    }
    let name = format!("{PROGRAM}{}", env::consts::EXE_SUFFIX);
    let beside = env::current_exe().ok().map(|own| own.with_file_name(&name));
    let path = env::var_os("PATH").unwrap_or_default();
    let on_path =
        env::split_paths(&path).filter(|folder| folder.is_absolute()).map(|folder| folder.join(&name));
    beside.into_iter().chain(on_path).find(|program| program.is_file())
}

/// Replaces this process, under its own name; returns why that cannot be.
#[cfg(unix)]
fn replaced_by(command: &mut Command, own_name: Option<std::ffi::OsString>) -> std::io::Error {
    use std::os::unix::process::CommandExt;
    if let Some(name) = own_name {
        command.arg0(name);
    }
    command.exec()
}

/// Waits for the other program and ends as it does; returns why that cannot be.
#[cfg(not(unix))]
fn replaced_by(command: &mut Command, _own_name: Option<std::ffi::OsString>) -> std::io::Error {
    match command.status() {
        Ok(status) => std::process::exit(status.code().unwrap_or(2)),
        Err(error) => error,
    }
}

impl Error {
    /// Whether it says that this program is without OpenCV.
    pub(crate) fn needs_opencv(&self) -> bool {
        use chainwave_experiment::Error as Inner;
        matches!(
            self,
            Self::ChoiceWithOpenCv
                | Self::Camera(CameraError::NeedsOpenCv { .. })
                | Self::Correlation(CorrelationError::NeedsOpenCv { .. })
                | Self::Experiment(
                    Inner::Camera(CameraError::NeedsOpenCv { .. })
                        | Inner::Correlation(CorrelationError::NeedsOpenCv { .. })
                )
        )
    }
}
