//! What a build needs from the system, and the plan to install what is missing.

use crate::command_line::{CommandLine, OpenCv};

/// Something that chainwave needs from the system, besides the Rust toolchain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Need {
    /// Compiles the C parts of polars' compression libraries.
    CCompiler,
    /// Compiles the C++ side of the OpenCV bindings.
    CppCompiler,
    /// Tells where OpenCV lies.
    PkgConfig,
    /// OpenCV 4 with its headers.
    OpenCv,
    /// Tells libclang where the system's headers lie.
    Clang,
    /// Reads OpenCV's headers when the bindings are generated.
    LibClang,
    /// Decodes videos of more than 8 bits when the program runs.
    Ffmpeg,
}

impl Need {
    /// What a build needs, and what it runs.
    pub(crate) fn of_build(opencv: OpenCv) -> &'static [Self] {
        match opencv {
            OpenCv::With => &[
                Self::CCompiler,
                Self::CppCompiler,
                Self::PkgConfig,
                Self::OpenCv,
                Self::Clang,
                Self::LibClang,
                Self::Ffmpeg,
            ],
            OpenCv::Without => &[Self::CCompiler],
        }
    }

    /// What it is called in messages.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::CCompiler => "C compiler (cc)",
            Self::CppCompiler => "C++ compiler (c++)",
            Self::PkgConfig => "pkg-config",
            Self::OpenCv => "OpenCV 4 development files",
            Self::Clang => "clang",
            Self::LibClang => "libclang",
            Self::Ffmpeg => "the program ffmpeg",
        }
    }

    /// The package of Debian and Ubuntu that brings it.
    fn debian_package(self) -> &'static str {
        match self {
            Self::CCompiler | Self::CppCompiler => "build-essential",
            Self::PkgConfig => "pkg-config",
            Self::OpenCv => "libopencv-dev",
            Self::Clang => "clang",
            Self::LibClang => "libclang-dev",
            Self::Ffmpeg => "ffmpeg",
        }
    }
}

/// How this user may install packages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rights {
    /// The user is root.
    Root,
    /// sudo works without a password.
    SudoSilently,
    /// sudo may ask for a password, and somebody is there to type it.
    SudoAsking,
    /// Not at all.
    Nothing,
}

/// What to do about the missing needs.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Plan {
    /// Run these commands, in this order.
    Install { update: CommandLine, install: CommandLine },
    /// Tell the user what to install.
    Tell(String),
}

/// Decides what to do about what is missing, on a system with or without apt-get.
pub(crate) fn plan(missing: &[Need], apt: bool, rights: Rights) -> Plan {
    let prefix: &[&str] = match rights {
        Rights::Root => &[],
        Rights::SudoSilently => &["sudo", "-n"],
        Rights::SudoAsking => &["sudo"],
        Rights::Nothing => return Plan::Tell(advice(missing)),
    };
    if !apt {
        return Plan::Tell(advice(missing));
    }
    let [update, install] = apt_commands(missing, prefix);
    Plan::Install { update, install }
}

/// What to install by hand, and how to do without it.
pub(crate) fn advice(missing: &[Need]) -> String {
    let mut lines = vec!["Please install:".to_owned()];
    lines.extend(missing.iter().map(|need| format!("  {}", need.name())));
    lines.push("On Debian or Ubuntu that is:".to_owned());
    let install = packages(missing).join(" ");
    lines.push(format!("  sudo apt-get update && sudo apt-get install --no-install-recommends {install}"));
    if missing.iter().all(|need| !Need::of_build(OpenCv::Without).contains(need)) {
        lines.push("Or leave OpenCV out with --no-opencv: that needs none of these.".to_owned());
    }
    lines.join("\n")
}

fn apt_commands(missing: &[Need], prefix: &[&str]) -> [CommandLine; 2] {
    // Through env, because sudo drops the variables of the user.
    let apt_get =
        || CommandLine::new(prefix).with(["env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "--yes"]);
    [
        apt_get().with(["update"]),
        apt_get().with(["install", "--no-install-recommends"]).with(packages(missing)),
    ]
}

/// Debian's packages for what is missing, each once.
fn packages(missing: &[Need]) -> Vec<&'static str> {
    let mut packages: Vec<_> = missing.iter().map(|need| need.debian_package()).collect();
    packages.dedup();
    packages
}

#[cfg(test)]
mod tests {
    use super::*;

    const EVERYTHING: &[Need] = &[
        Need::CCompiler,
        Need::CppCompiler,
        Need::PkgConfig,
        Need::OpenCv,
        Need::Clang,
        Need::LibClang,
        Need::Ffmpeg,
    ];

    #[test]
    fn root_installs_each_package_once() {
        let Plan::Install { update, install } = plan(EVERYTHING, true, Rights::Root) else {
            panic!("expected commands")
        };
        assert_eq!(update.to_string(), "env DEBIAN_FRONTEND=noninteractive apt-get --yes update");
        assert_eq!(
            install.to_string(),
            "env DEBIAN_FRONTEND=noninteractive apt-get --yes install --no-install-recommends \
             build-essential pkg-config libopencv-dev clang libclang-dev ffmpeg"
        );
    }

    #[test]
    fn others_install_through_sudo() {
        for (rights, start) in [(Rights::SudoSilently, "sudo -n env"), (Rights::SudoAsking, "sudo env")] {
            let Plan::Install { update, install } = plan(&[Need::OpenCv], true, rights) else {
                panic!("expected commands")
            };
            assert!(update.to_string().starts_with(start), "{update}");
            assert!(install.to_string().starts_with(start), "{install}");
            assert!(install.to_string().ends_with(" libopencv-dev"), "{install}");
        }
    }

    #[test]
    fn without_rights_or_apt_the_user_is_told() {
        for (apt, rights) in [(true, Rights::Nothing), (false, Rights::Root), (false, Rights::SudoAsking)] {
            let Plan::Tell(advice) = plan(&[Need::OpenCv, Need::LibClang], apt, rights) else {
                panic!("expected advice")
            };
            assert!(advice.contains("  OpenCV 4 development files\n  libclang\n"), "{advice}");
            assert!(
                advice.contains("install --no-install-recommends libopencv-dev libclang-dev"),
                "{advice}"
            );
            assert!(advice.contains("--no-opencv"), "{advice}");
        }
    }

    #[test]
    fn a_missing_c_compiler_is_not_blamed_on_opencv() {
        assert!(!advice(&[Need::CCompiler]).contains("--no-opencv"));
    }

    #[test]
    fn without_opencv_a_c_compiler_is_enough() {
        assert_eq!(Need::of_build(OpenCv::Without), [Need::CCompiler]);
        assert_eq!(Need::of_build(OpenCv::With), EVERYTHING);
    }
}
