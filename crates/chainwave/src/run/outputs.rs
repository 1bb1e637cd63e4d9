//! Everything that a run writes into its folder, by name: what an earlier run left there would be taken for this one's, and goes by this list.
//! What no run writes stays, and so does the folder `.work`, whose tracks a later run may take again.

use std::ffi::OsStr;
use std::fs;
use std::path::Path;

use super::figures::Figure;
use crate::error::Error;
use crate::output::{FIGURES_FOLDER, remove};
pub(super) use crate::run_files::{MOTION, RESULTS, STRAIN, TRACKS};

/// What became of each recording.
pub(super) const RECORDINGS: &str = "recordings.csv";
/// Stands in a folder of results: their recordings by name, and their settings.
pub(crate) const PROVENANCE: &str = "provenance.toml";
/// What rehearsals told, where they were asked for.
pub(super) const ACCURACY: &str = "accuracy.json";
pub(super) const ERROR_BUDGET: &str = "error_budget.json";
/// The waves of several striker velocities beside each other.
pub(super) const GROUP_VELOCITY: &str = "group_velocity.parquet";
pub(super) const EXPONENTS: &str = "group_velocity.json";
/// Pages and decisions.
pub(super) const DECISIONS: &str = "decisions.json";
pub(super) const REPORT: &str = "report.html";
/// Tables of what follows from a motion.
pub(super) const MOTION_BY_MODEL: &str = "motion_by_model.parquet";
pub(super) const FRONT: &str = "front.parquet";
pub(super) const HWHM: &str = "hwhm.parquet";
pub(super) const ENERGY: &str = "energy.parquet";
pub(super) const PULSES: &str = "pulses.parquet";
pub(super) const SPECTRUM: &str = "spectrum.parquet";
pub(super) const DISPERSION: &str = "dispersion.parquet";
pub(super) const ALIGNMENT: &str = "alignment.parquet";

/// All of that but the tracks and the list of recordings: what is concluded from tracks.
const CONCLUSIONS: [&str; 18] = [
    MOTION,
    MOTION_BY_MODEL,
    STRAIN,
    FRONT,
    HWHM,
    ENERGY,
    PULSES,
    SPECTRUM,
    DISPERSION,
    ALIGNMENT,
    DECISIONS,
    REPORT,
    RESULTS,
    PROVENANCE,
    ACCURACY,
    ERROR_BUDGET,
    GROUP_VELOCITY,
    EXPONENTS,
];

/// The figures that runs draw, by name, and how names of numbered ones begin.
const FIGURES: [&str; 12] = [
    "displacements",
    "strain-map",
    "strain-profiles",
    "peak-trace",
    "front-width",
    "peak-energy",
    "tail-spectrum",
    "dispersion",
    "residual-map",
    "camera-motion",
    "group-velocity",
    "group-velocity-by-particles",
];
pub(super) const NUMBERED_FIGURE: &str = "subsets-view-";
/// Endings of a figure's files: pictures, the numbers of its curves, and what it is drawn from once more.
const FIGURE_ENDINGS: [&str; 5] = ["svg", "png", "pdf", "csv", "cbor"];

/// How the folder of one velocity among several is named.
const VELOCITY: [&str; 2] = ["striker-", "-m-per-s"];

/// The name of the folder of one striker velocity among several.
pub(super) fn velocity_folder(velocity_m_per_s: f64) -> String {
    let [before, behind] = VELOCITY;
    format!("{before}{velocity_m_per_s}{behind}")
}

/// Removes what an earlier run concluded from its tracks, and the figures that it drew.
pub(super) fn remove_conclusions(out: &Path) -> Result<(), Error> {
    CONCLUSIONS.iter().try_for_each(|name| remove(&out.join(name)))?;
    remove_figures(out, &[])
}

/// Removes the tracks of an earlier run.
pub(super) fn remove_tracks(out: &Path) -> Result<(), Error> {
    remove(&out.join(TRACKS))
}

/// Removes what an earlier run's rehearsals told, which is not this one's.
pub(super) fn remove_rehearsed(out: &Path) -> Result<(), Error> {
    [ACCURACY, ERROR_BUDGET].iter().try_for_each(|name| remove(&out.join(name)))
}

/// Removes how an earlier run compared several velocities.
pub(super) fn remove_comparison(out: &Path) -> Result<(), Error> {
    [GROUP_VELOCITY, EXPONENTS].iter().try_for_each(|name| remove(&out.join(name)))
}

/// Removes the results of velocities that this run does not have.
pub(super) fn remove_other_velocities(out: &Path, own: &[String]) -> Result<(), Error> {
    let Ok(entries) = fs::read_dir(out) else { return Ok(()) };
    let [before, behind] = VELOCITY;
    for entry in entries.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let velocity = name.strip_prefix(before).and_then(|rest| rest.strip_suffix(behind));
        let is_of_a_run = velocity.is_some_and(|velocity| velocity.parse::<f64>().is_ok());
        let folder = entry.path();
        if is_of_a_run && !own.contains(&name) && folder.is_dir() {
            remove_conclusions(&folder)?;
            remove_tracks(&folder)?;
            remove_if_empty(&folder);
        }
    }
    Ok(())
}

/// Removes the figures of an earlier run that this one did not draw.
pub(super) fn remove_figures(out: &Path, drawn: &[Figure]) -> Result<(), Error> {
    let folder = out.join(FIGURES_FOLDER);
    let Ok(entries) = fs::read_dir(&folder) else { return Ok(()) };
    for path in entries.filter_map(|entry| Some(entry.ok()?.path())) {
        let part = |of: Option<&OsStr>| of.and_then(OsStr::to_str).unwrap_or_default().to_owned();
        let (name, ending) = (part(path.file_stem()), part(path.extension()));
        let is_of_a_run = FIGURES.contains(&name.as_str())
            || name.strip_prefix(NUMBERED_FIGURE).is_some_and(|number| number.parse::<u32>().is_ok());
        let is_drawn = drawn.iter().any(|one| one.name == name);
        if is_of_a_run && FIGURE_ENDINGS.contains(&ending.as_str()) && !is_drawn {
            remove(&path)?;
        }
    }
    remove_if_empty(&folder);
    Ok(())
}

/// Removes a folder that holds nothing; one that cannot be removed does no harm.
fn remove_if_empty(folder: &Path) {
    let _ = fs::remove_dir(folder);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_run_writes_goes_and_what_is_the_users_stays() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path();
        let write = |name: &str| {
            let path = out.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "of an earlier run").unwrap();
        };
        let own = [
            "notes.txt",
            "figures/my-drawing.svg",
            "figures/peak-trace.psd",
            "figures/subsets-view-of-mine.svg",
            "striker-2.73-m-per-s/notes.txt",
            "striker-fast-m-per-s/results.json",
            "striker-0.83-m-per-s/.work/a.parquet",
        ];
        let of_run = [
            "results.json",
            "provenance.toml",
            "group_velocity.json",
            "figures/peak-trace.cbor",
            "figures/group-velocity-by-particles.csv",
            "figures/subsets-view-3.svg",
            "striker-2.73-m-per-s/results.json",
            "striker-2.73-m-per-s/tracks.parquet",
            "striker-0.83-m-per-s/figures/strain-map.svg",
            "striker-1.5-m-per-s/report.html",
        ];
        own.iter().chain(&of_run).for_each(|name| write(name));
        write("striker-4-m-per-s/results.json");
        remove_conclusions(out).unwrap();
        remove_other_velocities(out, &["striker-4-m-per-s".into()]).unwrap();
        own.iter().for_each(|name| assert!(out.join(name).exists(), "{name}"));
        of_run.iter().for_each(|name| assert!(!out.join(name).exists(), "{name}"));
        assert!(out.join("striker-4-m-per-s/results.json").exists(), "it is of this run");
        assert!(
            !out.join("striker-1.5-m-per-s").exists() && !out.join("striker-0.83-m-per-s/figures").exists()
        );
        assert_eq!(velocity_folder(0.83), "striker-0.83-m-per-s");
    }
}
