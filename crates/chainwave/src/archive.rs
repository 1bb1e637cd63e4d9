//! `chainwave archive`: results as a package that an archive takes, every file with its hash.
//!
//! The package is an RO-Crate 1.1 (S. Soiland-Reyes et al., Data Science 5 (2022) 97-138) by the profile Process Run Crate 0.5: a folder
//! with `ro-crate-metadata.json`, which names each file, what made it, and from what. `r3xa.json` says the same in the words of
//! photomechanics.

mod photomechanics;

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use chainwave_camera::OpenOptions;
use chrono::{DateTime, SecondsFormat, Utc};
use serde::Deserialize;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use self::photomechanics::{Described, description};
use crate::cli;
use crate::error::Error;
use crate::kept::digest;
use crate::on_demand;
use crate::outcome::Outcome;
use crate::output::{found_in_place_of, make_folder, stays_within, write_json, write_whole};
use crate::run::PROVENANCE;
use crate::terminal::say;
use chainwave_experiment::read_toml;

/// The file of an RO-Crate that says what is in it.
const METADATA: &str = "ro-crate-metadata.json";
/// The file that describes the experiment as photomechanics does.
const PHOTOMECHANICS: &str = "r3xa.json";
const PROFILE: &str = "https://w3id.org/ro/wfrun/process/0.5";
/// Bytes that are copied at a time.
const PIECE: usize = 1 << 20;

/// What is read of `provenance.toml`.
#[derive(Deserialize)]
struct Provenance {
    version: String,
    recordings: Vec<Source>,
    experiment: Named,
}

#[derive(Deserialize)]
struct Source {
    recording: String,
    fingerprint: String,
}

#[derive(Deserialize)]
struct Named {
    name: String,
    chain: Option<NamedChain>,
    camera: Option<NamedCamera>,
}

/// The chain as far as its description needs it; patterns of pitches are not spelled out.
#[derive(Deserialize)]
struct NamedChain {
    n_bodies: usize,
    pitch_m: toml::Value,
}

#[derive(Deserialize)]
struct NamedCamera {
    scale_px_per_m: Option<f64>,
}

/// A file of the package.
struct Packed {
    /// Where it lies in the package, parts divided by `/`.
    name: String,
    n_bytes: u64,
    sha256: String,
}

/// Copies results, and the recordings where they are given, into a new folder, and writes beside them what they are.
pub(crate) fn archive(arguments: &cli::Archive) -> Result<Outcome, Error> {
    let cli::Archive { results, out, recordings, license, authors } = arguments;
    let provenance = provenance(results)?;
    let files = match recordings {
        Some(folder) => files_of_recordings(folder, &provenance)?,
        None => Vec::new(),
    };
    // Of several striker velocities each has its results in a folder of its own.
    let written = fs::metadata(results.join(PROVENANCE)).and_then(|about| about.modified());
    let written = written.map_err(Error::file(&results.join(PROVENANCE), "read"))?;
    expect_outside(results, out)?;
    expect_new(out)?;
    let mut made = Vec::new();
    for path in files_in(results)? {
        made.push(pack(results, &path, out, "")?);
    }
    let mut sources = Vec::new();
    if let Some(folder) = recordings {
        for file in &files {
            sources.push(pack(folder, file, out, "recordings/")?);
        }
    }
    let about = Described {
        experiment: &provenance.experiment.name,
        authors: authors.as_deref(),
        license: license.as_deref(),
        date: DateTime::<Utc>::from(written).format("%Y-%m-%d").to_string(),
        chain: provenance
            .experiment
            .chain
            .as_ref()
            .and_then(|chain| Some((chain.n_bodies, chain.pitch_m.as_float()?))),
        scale_px_per_m: provenance.experiment.camera.as_ref().and_then(|camera| camera.scale_px_per_m),
        recording: sources
            .first()
            .and_then(|first| chainwave_camera::open(&out.join(&first.name)).ok())
            .map(|recording| recording.info().clone()),
        chainwave_version: &provenance.version,
        recordings: sources.iter().map(|one| one.name.as_str()).collect(),
        results: made
            .iter()
            .map(|one| (one.name.as_str(), described(&one.name), format_of(&one.name)))
            .collect(),
    };
    write_json(&out.join(PHOTOMECHANICS), &description(&about))?;
    made.push(hashed(out, PHOTOMECHANICS)?);
    let metadata = metadata(&provenance, &made, &sources, license.as_deref(), written);
    // Written last: a package without it is none.
    write_json(&out.join(METADATA), &metadata)?;
    say(out, made.iter().chain(&sources));
    Ok(Outcome::default())
}

/// All files of the recordings, which lie in their folder and are there.
fn files_of_recordings(folder: &Path, provenance: &Provenance) -> Result<Vec<PathBuf>, Error> {
    let paths = || provenance.recordings.iter().map(|source| folder.join(&source.recording));
    on_demand::expect_readable(paths(), &OpenOptions::default())?;
    let mut files = Vec::new();
    for (path, source) in paths().zip(&provenance.recordings) {
        if !stays_within(&source.recording) {
            return Err(Error::Argument(format!(
                "{}: expected recordings that lie in the folder itself, found {}",
                folder.display(),
                source.recording
            )));
        }
        files.extend(chainwave_camera::files_of(&path)?);
    }
    if let Some(missing) = files.iter().find(|file| !file.is_file()) {
        return Err(Error::Argument(format!("{}: expected a file, found none", missing.display())));
    }
    // A pair of files may have been named by either.
    let mut named = BTreeSet::new();
    files.retain(|file| named.insert(file.clone()));
    Ok(files)
}

fn say<'a>(out: &Path, files: impl Iterator<Item = &'a Packed>) {
    let (n, n_bytes) = files.fold((0_u32, 0), |(n, sum), file| (n + 1, sum + file.n_bytes));
    say!("wrote {}: {n} files, {:.1} MB, and {METADATA}", out.display(), n_bytes as f64 / 1e6);
}

fn provenance(results: &Path) -> Result<Provenance, Error> {
    let path = results.join(PROVENANCE);
    if !path.is_file() {
        let found = found_in_place_of(results, "a folder without it");
        return Err(Error::Argument(format!(
            "{}: expected results of `chainwave run` with provenance.toml, found {found} (hint: the folder given to run's --out; a run that \
             was cut off goes on when it is started again)",
            results.display()
        )));
    }
    Ok(read_toml(&path)?)
}

/// Refuses a package within the results that it is made from: the next one would hold this one. The results' own folder is refused as one that is
/// in use.
fn expect_outside(results: &Path, out: &Path) -> Result<(), Error> {
    let there = |path: &Path| {
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        path.canonicalize().ok()
    };
    let (folder, results_there) = (out.ancestors().find_map(there), there(results));
    let is_itself = there(out).is_some_and(|out| results_there.as_ref() == Some(&out));
    match folder.zip(results_there).is_some_and(|(folder, results)| !is_itself && folder.starts_with(results))
    {
        true => Err(Error::Argument(format!(
            "{}: expected a folder outside of the results {}, found one within (hint: a folder beside them)",
            out.display(),
            results.display()
        ))),
        false => Ok(()),
    }
}

/// Makes the folder; one that holds anything is refused, so that nothing is overwritten and nothing foreign is archived.
fn expect_new(out: &Path) -> Result<(), Error> {
    make_folder(out)?;
    let mut entries = fs::read_dir(out).map_err(Error::file(out, "list"))?;
    match entries.next() {
        None => Ok(()),
        Some(_) => Err(Error::Argument(format!(
            "{}: expected a new or empty folder for the package, found files in it",
            out.display()
        ))),
    }
}

/// All files of a folder and its folders in the order of their names, but for hidden ones, which are kept work.
pub(crate) fn files_in(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let entries = fs::read_dir(folder).map_err(Error::file(folder, "list"))?;
    let mut paths = entries
        .map(|entry| entry.map(|entry| entry.path()).map_err(Error::file(folder, "list")))
        .collect::<Result<Vec<PathBuf>, Error>>()?;
    let is_shown =
        |path: &PathBuf| !path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
    paths.retain(is_shown);
    paths.sort();
    let mut files = Vec::new();
    for path in paths {
        match path.is_dir() {
            true => files.extend(files_in(&path)?),
            false => files.push(path),
        }
    }
    Ok(files)
}

/// Copies a file of a folder into the package, and hashes what is copied.
fn pack(folder: &Path, path: &Path, out: &Path, below: &str) -> Result<Packed, Error> {
    let inside = path.strip_prefix(folder).unwrap_or(path);
    let parts: Vec<_> = inside.components().map(|part| part.as_os_str().to_string_lossy()).collect();
    let name = format!("{below}{}", parts.join("/"));
    let target = out.join(&name);
    target.parent().map_or(Ok(()), make_folder)?;
    let mut source = File::open(path).map_err(Error::file(path, "read"))?;
    let (mut hash, mut n_bytes) = (Sha256::new(), 0);
    write_whole(&target, |writer| {
        let mut piece = vec![0; PIECE];
        loop {
            let n = source.read(&mut piece).map_err(Error::file(path, "read"))?;
            if n == 0 {
                return Ok(());
            }
            hash.update(&piece[..n]);
            n_bytes += n as u64;
            writer.write_all(&piece[..n]).map_err(Error::file(&target, "write"))?;
        }
    })?;
    let sha256 = hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    Ok(Packed { name, n_bytes, sha256 })
}

/// A file that was written into the package.
fn hashed(out: &Path, name: &str) -> Result<Packed, Error> {
    let path = out.join(name);
    let bytes = fs::read(&path).map_err(Error::file(&path, "read"))?;
    Ok(Packed { name: name.to_owned(), n_bytes: bytes.len() as u64, sha256: digest(&bytes) })
}

fn metadata(
    provenance: &Provenance,
    made: &[Packed],
    sources: &[Packed],
    license: Option<&str>,
    written: SystemTime,
) -> Value {
    let time = DateTime::<Utc>::from(written).to_rfc3339_opts(SecondsFormat::Secs, true);
    let named =
        |files: &[Packed]| -> Vec<Value> { files.iter().map(|file| id(&identifier(&file.name))).collect() };
    let experiment = &provenance.experiment.name;
    let used: Vec<Value> = match sources.is_empty() {
        true => {
            provenance.recordings.iter().map(|one| id(&format!("#{}", identifier(&one.recording)))).collect()
        }
        false => named(sources),
    };
    let mut root = json!({
        "@id": "./", "@type": "Dataset", "name": format!("Experiment {experiment}, evaluated by chainwave"),
        "description": format!(
            "Motion, strain, wave quantities and fitted damping of the chain in experiment {experiment}, with standard uncertainties, from {} \
             recordings of a high-speed camera",
            provenance.recordings.len()
        ),
        "datePublished": time, "conformsTo": id(PROFILE),
        "hasPart": ([named(made), named(sources)].concat()), "mentions": id("#run"),
    });
    if let (Some(license), Some(root)) = (license, root.as_object_mut()) {
        root.insert("license".into(), id(license));
    }
    let mut graph = vec![
        json!({
            "@id": METADATA, "@type": "CreativeWork", "about": id("./"),
            "conformsTo": id("https://w3id.org/ro/crate/1.1"),
        }),
        root,
        json!({ "@id": PROFILE, "@type": "CreativeWork", "name": "Process Run Crate", "version": "0.5" }),
        json!({
            "@id": "#chainwave", "@type": "SoftwareApplication", "name": "chainwave",
            "softwareVersion": provenance.version,
        }),
        json!({
            "@id": "#run", "@type": "CreateAction", "name": format!("chainwave run of experiment {experiment}"),
            "instrument": id("#chainwave"), "object": used, "result": named(made), "endTime": time,
            "actionStatus": id("http://schema.org/CompletedActionStatus"),
        }),
    ];
    if let Some(license) = license {
        graph.push(json!({ "@id": license, "@type": "CreativeWork", "name": license }));
    }
    if sources.is_empty() {
        graph.extend(provenance.recordings.iter().map(|one| {
            json!({
                "@id": format!("#{}", identifier(&one.recording)), "@type": "CreativeWork", "name": one.recording,
                "description": "A recording, which is not part of the package", "identifier": one.fingerprint,
            })
        }));
    }
    graph.extend(made.iter().chain(sources).map(entity));
    json!({
        "@context": ["https://w3id.org/ro/crate/1.1/context", "https://w3id.org/ro/terms/workflow-run"],
        "@graph": graph,
    })
}

fn id(of: &str) -> Value {
    json!({ "@id": of })
}

fn entity(file: &Packed) -> Value {
    json!({
        "@id": identifier(&file.name), "@type": "File", "name": file.name, "description": described(&file.name),
        "contentSize": file.n_bytes.to_string(), "encodingFormat": format_of(&file.name), "sha256": file.sha256,
    })
}

/// A name as part of an address: what an address does not take stands as its bytes in hexadecimal digits (RFC 3986, 2.1).
fn identifier(name: &str) -> String {
    let of_byte = |byte: u8| match byte {
        b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' | b'/' => {
            char::from(byte).to_string()
        }
        _ => format!("%{byte:02X}"),
    };
    name.bytes().map(of_byte).collect()
}

/// The media type by the ending.
fn format_of(name: &str) -> &'static str {
    match Path::new(name).extension().and_then(|ending| ending.to_str()).unwrap_or_default() {
        "parquet" => "application/vnd.apache.parquet",
        "json" => "application/json",
        "toml" => "application/toml",
        "csv" => "text/csv",
        "cbor" => "application/cbor",
        "html" => "text/html",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "pdf" => "application/pdf",
        "tif" | "tiff" => "image/tiff",
        "avi" => "video/x-msvideo",
        _ => "application/octet-stream",
    }
}

/// What a file of the results is.
fn described(name: &str) -> &'static str {
    match name.rsplit('/').next().unwrap_or(name) {
        "tracks.parquet" => "Positions of all subsets in all frames of all recordings, in pixels",
        "motion.parquet" => "Displacement of each body from rest over time, in metres, free of any model",
        "motion_by_model.parquet" => {
            "Displacement of each body over time, in metres, aligned by the accepted chain model"
        }
        "strain.parquet" => "Strain of each gap over time",
        "front.parquet" => "Peak and edge of the front in each gap",
        "hwhm.parquet" => "Half width at half maximum of the front over time, in metres",
        "energy.parquet" => "Peak potential energy of each gap, in joules",
        "pulses.parquet" => "Each pulse from gap to gap: time, strain, half width, speed",
        "spectrum.parquet" => "Spectra of the tail behind the front",
        "dispersion.parquet" => "Spectrum of the motion over frequency and wavenumber",
        "alignment.parquet" => "Trigger and drive of each recording",
        "results.json" => {
            "Group velocity, damping and other numbers with their standard uncertainties, warnings, and what became of each recording"
        }
        "decisions.json" => "What was modelled, by which test and on what evidence",
        "recordings.csv" => "What became of each recording",
        PHOTOMECHANICS => "The experiment in the words of photomechanics (R3XA)",
        "provenance.toml" => "Version, settings and recordings",
        "report.html" => "Report to be read",
        other if other.ends_with(".svg") || other.ends_with(".png") => "Figure",
        _ if name.starts_with("recordings/") => "Recording of the camera",
        _ => "Part of the results",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_addresses() {
        assert_eq!(identifier("figures/strain map.svg"), "figures/strain%20map.svg");
        assert_eq!(identifier("Gänge%.cine"), "G%C3%A4nge%25.cine");
    }

    #[test]
    fn results_that_are_none_and_folders_in_use_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let arguments = |results: &Path, out: PathBuf| cli::Archive {
            results: results.to_owned(),
            out,
            recordings: None,
            license: None,
            authors: None,
        };
        let refused = |arguments: cli::Archive| archive(&arguments).unwrap_err().to_string();
        let said = refused(arguments(folder.path(), folder.path().join("out")));
        assert!(said.contains("expected results of `chainwave run`") && said.contains("hint"), "{said}");
        assert!(!folder.path().join("out").exists());
        let text = "version = \"0.1.0\"\nrecordings = []\n[experiment]\nname = \"small\"\n";
        fs::write(folder.path().join("provenance.toml"), text).unwrap();
        let said = refused(arguments(folder.path(), folder.path().to_owned()));
        assert!(said.contains("expected a new or empty folder"), "{said}");
        let said = refused(arguments(folder.path(), folder.path().join("in/side")));
        assert!(said.contains("expected a folder outside of the results"), "{said}");
        assert!(!folder.path().join("in").exists());
    }
}
