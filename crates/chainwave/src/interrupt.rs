//! Ctrl-C: the first ends the recording in hand, or the program at once where nothing is in hand that would be kept; a second one does so in any case.

use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::terminal::{complain, is_quiet};

static IS_ASKED: AtomicBool = AtomicBool::new(false);
static IS_AT_ONCE: AtomicBool = AtomicBool::new(false);

/// The exit code of a program that SIGINT ended, by the shells' convention: 128 and the number of the signal.
pub(crate) const EXIT_CODE: u8 = 130;

/// Listens for Ctrl-C and a termination by the system; where that is refused, they end the program as they always do.
pub(crate) fn listen() {
    let _refused = ctrlc::set_handler(|| {
        let is_at_once = IS_AT_ONCE.load(Ordering::SeqCst);
        let is_second = IS_ASKED.swap(true, Ordering::SeqCst);
        if !is_second && !is_quiet() {
            complain(if is_at_once {
                "stopped; what was tracked is kept"
            } else {
                "stopping after the step in hand, which is kept; Ctrl-C again stops at once"
            });
        }
        if is_second || is_at_once {
            std::process::exit(i32::from(EXIT_CODE));
        }
    });
}

/// Whether work has begun, or ended, of which nothing is kept before it is done: Ctrl-C then stops at once.
pub(crate) fn stop_at_once(is_at_once: bool) {
    IS_AT_ONCE.store(is_at_once, Ordering::SeqCst);
}

/// Whether the user asked to stop.
pub(crate) fn is_asked() -> bool {
    IS_ASKED.load(Ordering::SeqCst)
}

/// The exit code of a program that stopped as asked.
pub(crate) fn exit_code() -> ExitCode {
    ExitCode::from(EXIT_CODE)
}
