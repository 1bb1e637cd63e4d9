//! The command as it is given to others: without OpenCV, so that it runs where that is not installed, and without its symbols.

use std::env;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::command_line::CommandLine;

/// Builds it, with the features that the tests without OpenCV have, so that nothing is built twice.
pub(crate) fn build() -> CommandLine {
    CommandLine::new([
        "cargo",
        "build",
        "--release",
        "--workspace",
        "--no-default-features",
        "--bin",
        "chainwave",
    ])
}

/// Copies the command that was built last into a folder, without its symbols where the system can take them off.
pub(crate) fn copy_into(folder: &Path) -> io::Result<PathBuf> {
    let name = format!("chainwave{}", env::consts::EXE_SUFFIX);
    let copy = folder.join(&name);
    fs::create_dir_all(folder)?;
    fs::copy(env::current_exe()?.with_file_name(name), &copy)?;
    if CommandLine::new(["strip".into(), copy.clone().into_os_string()]).output().is_none() {
        println!("There is no `strip`: the command keeps its symbols.");
    }
    Ok(copy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_given_to_others_has_no_opencv() {
        assert!(build().to_string().ends_with("--no-default-features --bin chainwave"));
    }
}
