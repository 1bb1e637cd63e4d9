//! Ctrl-C: the first ends the recording in hand, a second one the program at once.

use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

static IS_ASKED: AtomicBool = AtomicBool::new(false);

/// The exit code of a program that SIGINT ended, by the shells' convention: 128 and the number of the signal.
pub(crate) const EXIT_CODE: u8 = 130;

/// Listens for Ctrl-C and a termination by the system; where that is refused, they end the program as they always do.
pub(crate) fn listen() {
    let _refused = ctrlc::set_handler(|| {
        if IS_ASKED.swap(true, Ordering::SeqCst) {
            std::process::exit(i32::from(EXIT_CODE));
        }
    });
}

/// Whether the user asked to stop.
pub(crate) fn is_asked() -> bool {
    IS_ASKED.load(Ordering::SeqCst)
}

/// The exit code of a program that stopped as asked.
pub(crate) fn exit_code() -> ExitCode {
    ExitCode::from(EXIT_CODE)
}
