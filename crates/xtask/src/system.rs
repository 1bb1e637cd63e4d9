//! What this system has: programs, OpenCV, libclang, and rights to install.

use std::env;
use std::fs;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

use crate::command_line::CommandLine;
use crate::needs::{Need, Rights};

/// What meets a need on this system (a path or a version), or `None` where nothing does.
pub(crate) fn find(need: Need) -> Option<String> {
    match need {
        Need::CCompiler => compiler("CC", "cc"),
        Need::CppCompiler => compiler("CXX", "c++"),
        Need::PkgConfig => program("pkg-config").as_deref().map(shown),
        Need::OpenCv => opencv(),
        Need::Clang => program("clang").as_deref().map(shown),
        Need::LibClang => libclang().as_deref().map(shown),
        Need::Ffmpeg => program("ffmpeg").as_deref().map(shown),
    }
}

/// Whether packages are installed with apt-get here.
pub(crate) fn has_apt() -> bool {
    program("apt-get").is_some()
}

/// How this user may install packages.
pub(crate) fn rights() -> Rights {
    if CommandLine::new(["id", "-u"]).output().as_deref() == Some("0") {
        Rights::Root
    } else if program("sudo").is_none() {
        Rights::Nothing
    } else if CommandLine::new(["sudo", "-n", "true"]).output().is_some() {
        Rights::SudoSilently
    } else if io::stdin().is_terminal() {
        Rights::SudoAsking
    } else {
        Rights::Nothing
    }
}

fn compiler(variable: &str, name: &str) -> Option<String> {
    match env::var(variable) {
        Ok(chosen) if !chosen.is_empty() => Some(format!("{chosen} (from {variable})")),
        _ => program(name).as_deref().map(shown),
    }
}

fn opencv() -> Option<String> {
    // Somebody who points the bindings at an OpenCV of their own knows where it is.
    let variables = ["OPENCV_LINK_LIBS", "OpenCV_DIR", "OPENCV_PKGCONFIG_NAME"];
    if let Some(variable) = variables.iter().find(|name| env::var_os(name).is_some()) {
        return Some(format!("from {variable}"));
    }
    ["opencv4", "opencv"].iter().find_map(|name| {
        CommandLine::new(["pkg-config", "--modversion", name])
            .output()
            .map(|version| format!("{name} {version}"))
    })
}

fn libclang() -> Option<PathBuf> {
    if let Some(path) = env::var_os("LIBCLANG_PATH").map(PathBuf::from) {
        return if path.is_file() { Some(path) } else { libclang_in(&path) };
    }
    library_folders().iter().find_map(|folder| libclang_in(folder))
}

/// Where distributions put libclang: LLVM's own folders first, then the system's.
fn library_folders() -> Vec<PathBuf> {
    let mut folders = Vec::new();
    for system in ["/usr/lib", "/usr/lib64", "/usr/local/lib"].map(Path::new) {
        let inside = entries(system);
        folders.extend(inside.iter().filter(|path| has_prefix(path, "llvm")).map(|path| path.join("lib")));
        folders.push(system.to_owned());
        folders.extend(inside.into_iter().filter(|path| path.is_dir()));
    }
    folders
}

fn libclang_in(folder: &Path) -> Option<PathBuf> {
    let is_library = |path: &PathBuf| {
        path.file_name().is_some_and(|name| is_libclang(&name.to_string_lossy())) && path.is_file()
    };
    entries(folder).into_iter().find(is_library)
}

/// The names that the OpenCV bindings' build loads: `libclang.so`, `libclang.so.1`, `libclang-14.so`, `libclang-14.so.1`.
fn is_libclang(name: &str) -> bool {
    let Some(rest) = name.strip_prefix("libclang") else { return false };
    let (version, ending) = rest.split_at(rest.find(".so").unwrap_or(rest.len()));
    let is_version = |text: &str| text.chars().all(|c| c.is_ascii_digit() || c == '.');
    let version_fits = version.is_empty() || version.strip_prefix('-').is_some_and(is_version);
    version_fits && ending.strip_prefix(".so").is_some_and(is_version)
}

/// The entries of a folder in the order of their names; none where it cannot be read.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> =
        fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    paths.sort();
    paths
}

fn has_prefix(path: &Path, prefix: &str) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(prefix))
}

fn program(name: &str) -> Option<PathBuf> {
    let path = env::var_os("PATH")?;
    env::split_paths(&path).map(|folder| folder.join(name)).find(|candidate| candidate.is_file())
}

fn shown(path: &Path) -> String {
    path.display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn libclang_is_told_from_its_neighbours() {
        for name in
            ["libclang.so", "libclang.so.1", "libclang-14.so", "libclang-14.so.1", "libclang-14.0.6.so"]
        {
            assert!(is_libclang(name), "{name}");
        }
        for name in [
            "libclang-cpp.so.14",
            "libclangAST.a",
            "libclang.a",
            "libclang-14.so.old",
            "libclang",
            "clang.so",
        ] {
            assert!(!is_libclang(name), "{name}");
        }
    }

    #[test]
    fn a_program_on_the_path_is_found() {
        assert!(program("sh").is_some());
        assert!(program("no-such-program-here").is_none());
    }

    #[test]
    fn a_folder_that_cannot_be_read_holds_nothing() {
        assert!(entries(Path::new("/no/such/folder")).is_empty());
    }
}
