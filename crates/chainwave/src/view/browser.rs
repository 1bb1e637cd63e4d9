//! Opens an address in the user's browser, where there is one.

use std::io::Write;
use std::process::{Command, Stdio};
use std::time::Duration;

/// How long the file that leads to the address stays.
const KEPT: Duration = Duration::from_secs(60);

/// Opens an address. Whether it works is no matter: the address stands on the screen.
///
/// Arguments of a process can be read by everybody on the machine, and the address holds the token; so the browser is given a file that
/// only its user may read, which leads there.
pub(crate) fn open(address: &str) {
    let has_screen = cfg!(not(target_os = "linux"))
        || ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some());
    if !has_screen {
        return;
    }
    let builder = || tempfile::Builder::new().prefix("chainwave-view-").suffix(".html").tempfile();
    let Ok(mut file) = builder() else { return };
    let page = format!(
        "<!doctype html><meta http-equiv=\"refresh\" content=\"0; url={address}\"><a href=\"{address}\">chainwave view</a>"
    );
    if file.write_all(page.as_bytes()).is_err() {
        return;
    }
    let (program, arguments): (&str, &[&str]) = match std::env::consts::OS {
        "macos" => ("open", &[]),
        "windows" => ("cmd", &["/C", "start", ""]),
        _ => ("xdg-open", &[]),
    };
    let mut command = Command::new(program);
    command.args(arguments).arg(file.path()).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    // Without such a program the user has the address.
    let Ok(mut child) = command.spawn() else { return };
    std::thread::spawn(move || {
        let _ = child.wait();
        std::thread::sleep(KEPT);
        drop(file);
    });
}
