//! The command `chainwave`, without OpenCV: where something takes that, it becomes `chainwave-opencv`.

use std::process::ExitCode;

fn main() -> ExitCode {
    chainwave::main()
}
