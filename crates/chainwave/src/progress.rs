//! Progress of long work: bars on a terminal, nothing in a pipe.

use std::io::IsTerminal;
use std::time::Duration;

use chainwave_experiment::{Monitor, Progress, Stage};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::interrupt;
use crate::terminal::is_quiet;

/// How often a bar of long steps shows the time.
const TICK: Duration = Duration::from_secs(1);

/// A bar over `n` steps of a stage, on standard error, hidden where that is no terminal.
pub(crate) fn bar(stage: &str, n: u64) -> ProgressBar {
    let target = match std::io::stderr().is_terminal() && !is_quiet() {
        true => ProgressDrawTarget::stderr(),
        false => ProgressDrawTarget::hidden(),
    };
    let bar = ProgressBar::with_draw_target(Some(n), target).with_message(stage.to_owned());
    let style = ProgressStyle::with_template("{msg:24} {wide_bar} {pos}/{len} {eta}");
    bar.with_style(style.unwrap_or_else(|_invalid| ProgressStyle::default_bar()))
}

/// A bar over steps of unequal length, which says how long it has been at it in place of when it will end.
pub(crate) fn stepped(stage: &str) -> ProgressBar {
    let bar = bar(stage, 0);
    let style = ProgressStyle::with_template("{msg:24} {wide_bar} {pos}/{len} {elapsed} so far");
    let bar = bar.with_style(style.unwrap_or_else(|_invalid| ProgressStyle::default_bar()));
    if !bar.is_hidden() {
        bar.enable_steady_tick(TICK);
    }
    bar
}

/// Hears of progress through `show`, and stops where the user asks.
pub(crate) fn monitor<'a>(show: &'a (dyn Fn(Progress) + Sync)) -> Monitor<'a> {
    Monitor { on_progress: show, is_cancelled: &interrupt::is_asked }
}

/// Shows what a stage of the library reports on a bar of its name.
pub(crate) fn shown_on(bar: &ProgressBar) -> impl Fn(Progress) + Sync + '_ {
    move |progress| match progress {
        Progress::Planned(Stage::Evaluating, steps) => {
            interrupt::stop_at_once(true);
            bar.inc_length(steps);
        }
        Progress::Ended(Stage::Evaluating) => {
            interrupt::stop_at_once(false);
            bar.finish_and_clear();
        }
        Progress::Planned(_, steps) => bar.inc_length(steps),
        Progress::Done(_, steps) => bar.inc(steps),
        Progress::Ended(_) => bar.finish_and_clear(),
        _ => {}
    }
}
