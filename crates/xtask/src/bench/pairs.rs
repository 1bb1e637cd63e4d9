//! Which benchmark is held against which: the obvious program, a peer, or the same on one thread, measured in the same minutes.

/// A program of benchmarks of one crate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Program {
    pub(crate) package: &'static str,
    pub(crate) name: &'static str,
    /// Whether it is built with OpenCV alone.
    pub(crate) opencv: bool,
}

const MATCHING: Program = Program { package: "chainwave-correlation", name: "matching", opencv: false };
const CHAIN: Program = Program { package: "chainwave-mechanics", name: "chain", opencv: false };
const RING: Program = Program { package: "chainwave-mechanics", name: "ring", opencv: false };
const REGIONS: Program = Program { package: "chainwave-camera", name: "regions", opencv: false };
const FRAMES: Program = Program { package: "chainwave-opencv", name: "frames", opencv: true };
const FOLLOW: Program = Program { package: "chainwave-opencv", name: "follow", opencv: true };

/// All of them. Pairs across two programs name the one whose turn comes later second.
pub(crate) const PROGRAMS: [Program; 6] = [MATCHING, CHAIN, RING, REGIONS, FRAMES, FOLLOW];

/// Two benchmarks, and what their ratio says: how many times faster ours is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Pair {
    /// What is measured.
    pub(crate) measure: &'static str,
    /// What it is held against.
    pub(crate) against: &'static str,
    /// Ours, by the path of its names.
    pub(crate) ours: (Program, &'static str),
    /// The other.
    pub(crate) other: (Program, &'static str),
}

const fn pair(
    measure: &'static str,
    against: &'static str,
    ours: (Program, &'static str),
    other: (Program, &'static str),
) -> Pair {
    Pair { measure, against, ours, other }
}

/// The table's rows, in their order.
pub(crate) const PAIRS: [Pair; 23] = [
    pair(
        "affine match, cubic",
        "the textbook's loops",
        (MATCHING, "solve_affine/cubic"),
        (MATCHING, "solve_plain"),
    ),
    pair(
        "preparation of a subset",
        "the textbook's loops",
        (MATCHING, "preparation"),
        (MATCHING, "preparation_plain"),
    ),
    pair(
        "26 bodies followed, affine, two threads",
        "one thread",
        (MATCHING, "follow_on_threads/2"),
        (MATCHING, "follow_on_threads/1"),
    ),
    pair(
        "RK4, 300 bodies, all of them",
        "a plain loop with powf",
        (CHAIN, "rk4_3750_steps_of_300_bodies/All"),
        (CHAIN, PLAIN_RK4),
    ),
    pair(
        "RK4, 300 bodies, those that are reached",
        "a plain loop with powf",
        (CHAIN, "rk4_3750_steps_of_300_bodies/Reached"),
        (CHAIN, PLAIN_RK4),
    ),
    pair(
        "velocity Verlet, 300 bodies, all of them",
        "RK4 by a plain loop",
        (CHAIN, "verlet_3750_steps_of_300_bodies/All"),
        (CHAIN, PLAIN_RK4),
    ),
    pair(
        "eight sensitivities of 26 bodies",
        "central differences",
        (CHAIN, "eight_sensitivities_of_26_bodies"),
        (CHAIN, "eight_central_differences_of_26_bodies"),
    ),
    pair("element-step of rings, 16 elements", "a plain loop", (RING, "vectors/16"), (RING, "plain_loop/16")),
    pair("element-step of rings, 32 elements", "a plain loop", (RING, "vectors/32"), (RING, "plain_loop/32")),
    pair("element-step of rings, 64 elements", "a plain loop", (RING, "vectors/64"), (RING, "plain_loop/64")),
    pair(
        "a push through eight rings, Verlet",
        "an implicit scheme",
        (RING, "explicit_push"),
        (RING, "implicit_push"),
    ),
    pair(
        "300 rings for 148 ms, two threads",
        "one thread",
        (RING, "study_of_300_rings_for_148_ms_on_two_threads/16"),
        (RING, "study_of_300_rings_for_148_ms_on_one_thread/16"),
    ),
    pair(
        "regions of 26 bodies, 8 bit",
        "a plain reader's frame",
        (REGIONS, "regions_of_a_frame/8"),
        (REGIONS, "frame_by_a_plain_reader/8"),
    ),
    pair(
        "regions of 26 bodies, 12 bit",
        "a plain reader's frame",
        (REGIONS, "regions_of_a_frame/12"),
        (REGIONS, "frame_by_a_plain_reader/12"),
    ),
    pair(
        "regions of 26 bodies, 16 bit",
        "a plain reader's frame",
        (REGIONS, "regions_of_a_frame/16"),
        (REGIONS, "frame_by_a_plain_reader/16"),
    ),
    pair(
        "whole frame, 12 bit",
        "a plain reader's frame",
        (REGIONS, "whole_frame/12"),
        (REGIONS, "frame_by_a_plain_reader/12"),
    ),
    pair(
        "whole frame, 16 bit",
        "a plain reader's frame",
        (REGIONS, "whole_frame/16"),
        (REGIONS, "frame_by_a_plain_reader/16"),
    ),
    pair(
        "regions of 26 bodies, 8 bit",
        "a frame by OpenCV",
        (REGIONS, "regions_of_a_frame/8"),
        (FRAMES, "frame/8"),
    ),
    pair(
        "regions of 26 bodies, 16 bit",
        "a frame by OpenCV",
        (REGIONS, "regions_of_a_frame/16"),
        (FRAMES, "frame/16"),
    ),
    pair(
        "26 bodies from a file, linear translation",
        "OpenCV's Lucas-Kanade",
        (FOLLOW, "on_one_thread/icgn-linear-translation"),
        (FOLLOW, LUCAS_KANADE),
    ),
    pair(
        "26 bodies from a file, cubic translation",
        "OpenCV's Lucas-Kanade",
        (FOLLOW, "on_one_thread/icgn-cubic-translation"),
        (FOLLOW, LUCAS_KANADE),
    ),
    pair(
        "26 bodies from a file, cubic affine",
        "OpenCV's Lucas-Kanade",
        (FOLLOW, "on_one_thread/icgn-cubic-affine"),
        (FOLLOW, LUCAS_KANADE),
    ),
    pair(
        "26 bodies from a file, two threads",
        "one thread",
        (FOLLOW, "on_threads/2"),
        (FOLLOW, "on_threads/1"),
    ),
];

const PLAIN_RK4: &str = "rk4_3750_steps_of_300_bodies_by_a_plain_loop";
const LUCAS_KANADE: &str = "on_one_thread/opencv-lk";

impl Program {
    /// The benchmarks of it that a pair names.
    pub(crate) fn wanted(self) -> Vec<&'static str> {
        let sides = PAIRS.iter().flat_map(|pair| [pair.ours, pair.other]);
        let mut wanted: Vec<_> = sides.filter(|side| side.0 == self).map(|side| side.1).collect();
        wanted.sort_unstable();
        wanted.dedup();
        wanted
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::command_line::workspace;

    #[test]
    fn every_benchmark_of_a_pair_is_there() {
        for program in PROGRAMS {
            let role = program.package.trim_start_matches("chainwave-");
            let path = workspace().join(format!("crates/{role}/benches/{}.rs", program.name));
            let source = fs::read_to_string(&path).unwrap();
            assert!(!program.wanted().is_empty(), "{program:?}");
            for wanted in program.wanted() {
                let function = wanted.split('/').next().unwrap();
                assert!(source.contains(&format!("fn {function}(")), "{}: {function}", path.display());
            }
        }
    }
}
