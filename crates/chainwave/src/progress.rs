//! Progress of long work: bars on a terminal, nothing in a pipe.

use std::io::IsTerminal;

use chainwave_experiment::{Monitor, Progress};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::interrupt;

/// A bar over `n` steps of a stage, on standard error, hidden where that is no terminal.
pub(crate) fn bar(stage: &str, n: u64) -> ProgressBar {
    let target = match std::io::stderr().is_terminal() {
        true => ProgressDrawTarget::stderr(),
        false => ProgressDrawTarget::hidden(),
    };
    let bar = ProgressBar::with_draw_target(Some(n), target).with_message(stage.to_owned());
    let style = ProgressStyle::with_template("{msg:24} {wide_bar} {pos}/{len} {eta}");
    bar.with_style(style.unwrap_or_else(|_invalid| ProgressStyle::default_bar()))
}

/// Hears of progress through `show`, and stops where the user asks.
pub(crate) fn monitor<'a>(show: &'a (dyn Fn(Progress) + Sync)) -> Monitor<'a> {
    Monitor { on_progress: show, is_cancelled: &interrupt::is_asked }
}

/// Shows what a stage of the library reports on a bar of its name.
pub(crate) fn shown_on(bar: &ProgressBar) -> impl Fn(Progress) + Sync + '_ {
    move |progress| match progress {
        Progress::Planned(_, steps) => bar.inc_length(steps),
        Progress::Done(_, steps) => bar.inc(steps),
        Progress::Ended(_) => bar.finish_and_clear(),
        _ => {}
    }
}
