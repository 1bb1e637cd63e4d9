//! The command as it is given to others: `chainwave` alone, which runs where no OpenCV is installed, without its symbols.

use std::env;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::command_line::{CommandLine, workspace};

/// Builds it, with the features that it has among the whole workspace, so that nothing is built twice; OpenCV is not.
pub(crate) fn build() -> CommandLine {
    CommandLine::new(["cargo", "build", "--release", "--workspace", "--bin", "chainwave"])
}

/// Builds the programs that count, likewise.
pub(crate) fn build_examples() -> CommandLine {
    CommandLine::new(["cargo", "build", "--release", "--workspace", "--examples"])
}

/// Where cargo puts it: in the workspace, or where its target folder is named.
pub(crate) fn built() -> PathBuf {
    let target = env::var_os("CARGO_TARGET_DIR").map_or_else(|| PathBuf::from("target"), PathBuf::from);
    workspace().join(target).join("release").join(format!("chainwave{}", env::consts::EXE_SUFFIX))
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
        assert!(build().to_string().ends_with(" --bin chainwave"));
    }
}
