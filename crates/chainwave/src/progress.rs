//! Progress of long work: bars on a terminal, nothing in a pipe.

use std::io::IsTerminal;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

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
