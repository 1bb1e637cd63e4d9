//! The page in a headless browser, where there is one: it shows the recording, its subsets and no error.

#![cfg(test)]

mod support;

use std::process::{Command, Stdio};

use support::Site;

/// Names under which systems install a browser that shows a page without a screen.
const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

#[test]
fn the_page_shows_the_recording() {
    let runs = |name: &&&str| {
        let version =
            Command::new(name).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
        version.is_ok_and(|status| status.success())
    };
    let Some(browser) = BROWSERS.iter().find(runs) else {
        chainwave_testkit::skip("no headless browser is installed (chromium)");
        return;
    };
    let site = Site::start();
    let profile = site.folder.path().join("profile");
    let shown = Command::new(browser)
        .args(["--headless=new", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=8000", "--dump-dom"])
        .args(["--enable-logging=stderr", "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1"])
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg(site.address())
        .output()
        .unwrap();
    let (page, log) = (String::from_utf8_lossy(&shown.stdout), String::from_utf8_lossy(&shown.stderr));
    assert!(page.contains("shot: 3 frames"), "{page}\n{log}");
    assert!(page.contains("t = 0.0000 ms"), "{page}");
    let errors: Vec<&str> = log.lines().filter(|line| line.contains("CONSOLE")).collect();
    assert!(errors.is_empty(), "{errors:?}");
}
