//! `chainwave-opencv`: the command `chainwave` with OpenCV, which that becomes where something takes it.

use std::process::ExitCode;

fn main() -> ExitCode {
    chainwave_opencv::register();
    chainwave::main()
}
