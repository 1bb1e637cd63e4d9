//! Finds out whether OpenCV is older than 4.7, in which ChArUco boards moved to another module with another interface.

use std::fs;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(opencv_before_4_7)");
    let wanted = std::env::var_os("CARGO_FEATURE_OPENCV").is_some();
    if wanted && version().is_some_and(|version| version < (4, 7)) {
        println!("cargo::rustc-cfg=opencv_before_4_7");
    }
}

/// Major and minor version of the installed OpenCV; `None` where nobody says.
fn version() -> Option<(u32, u32)> {
    let asked = Command::new("pkg-config").args(["--modversion", "opencv4"]).output().ok();
    let told = asked
        .filter(|output| output.status.success())
        .and_then(|output| String::from_utf8(output.stdout).ok());
    told.as_deref().and_then(parsed).or_else(|| {
        let header = fs::read_to_string("/usr/include/opencv4/opencv2/core/version.hpp").ok()?;
        let number = |name: &str| {
            let line = header.lines().find(|line| line.starts_with("#define") && line.contains(name))?;
            line.split_whitespace().last()?.parse().ok()
        };
        Some((number("CV_VERSION_MAJOR")?, number("CV_VERSION_MINOR")?))
    })
}

fn parsed(version: &str) -> Option<(u32, u32)> {
    let mut numbers = version.trim().split('.').map(|number| number.parse().ok());
    Some((numbers.next()??, numbers.next()??))
}
