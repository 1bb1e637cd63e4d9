//! `chainwave archive`: every file of the results in the package, with its hash, and a description that holds together.

mod slow {
    use std::collections::BTreeSet;
    use std::fs;
    use std::path::Path;

    use serde_json::Value;
    use sha2::{Digest, Sha256};

    use crate::support::command::{chainwave, succeed};
    use crate::support::laboratory::Laboratory;
    use crate::support::python::{Python, text};

    fn entities(package: &Path) -> Vec<Value> {
        let text = fs::read(package.join("ro-crate-metadata.json")).expect("it is there");
        let found: Value = serde_json::from_slice(&text).expect("it is JSON");
        found["@graph"].as_array().expect("a list").clone()
    }

    fn is_of(entity: &Value, kind: &str) -> bool {
        entity["@type"] == kind
    }

    /// All addresses that an entity refers to.
    fn references(value: &Value, found: &mut Vec<String>) {
        match value {
            Value::Object(entries) => match (entries.len(), entries.get("@id").and_then(Value::as_str)) {
                (1, Some(id)) => found.push(id.to_owned()),
                _ => entries.values().for_each(|value| references(value, found)),
            },
            Value::Array(values) => values.iter().for_each(|value| references(value, found)),
            _ => {}
        }
    }

    /// Has the package read by the libraries of both specifications.
    fn accepted_by_others(package: &Path) {
        const READ: &str = r#"
import sys
from rocrate.rocrate import ROCrate
crate = ROCrate(sys.argv[1])
files = [one for one in crate.get_entities() if one.type == "File"]
print(len(files), crate.root_dataset["conformsTo"].id, crate.dereference("r3xa.json")["encodingFormat"])
"#;
        let Some(python) = Python::with(&["rocrate>=0.13,<0.17", "r3xa>=2024.7,<2025"]) else { return };
        let said = python.run(READ, &[package]);
        let n_files = entities(package).iter().filter(|one| is_of(one, "File")).count();
        assert_eq!(said.trim(), format!("{n_files} https://w3id.org/ro/wfrun/process/0.5 application/json"));
        text(&python.program("r3xa-validate").arg(package.join("r3xa.json")).output().expect("it starts"));
    }

    #[test]
    fn a_package_holds_all_results_and_recordings_with_their_hashes() {
        let laboratory = Laboratory::new();
        let (results, _) = laboratory.evaluate();
        let recordings = laboratory.path("recordings");
        let package = laboratory.path("package");
        let said = succeed(
            chainwave()
                .arg("archive")
                .arg(&results)
                .arg("--out")
                .arg(&package)
                .arg("--recordings")
                .arg(&recordings)
                .args(["--authors", "E. Hamster"]),
        );
        assert!(said.contains("wrote") && said.contains("ro-crate-metadata.json"), "{said}");
        let entities = entities(&package);
        let files: Vec<&Value> = entities.iter().filter(|one| is_of(one, "File")).collect();
        for file in &files {
            let name = file["name"].as_str().expect("a name");
            let bytes = fs::read(package.join(name)).expect("it is in the package");
            let hash: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
            assert_eq!(
                (file["sha256"].as_str(), file["contentSize"].as_str()),
                (Some(&*hash), Some(&*bytes.len().to_string())),
                "{name}"
            );
        }
        let names: BTreeSet<&str> = files.iter().filter_map(|file| file["name"].as_str()).collect();
        for expected in [
            "motion.parquet",
            "results.json",
            "provenance.toml",
            "report.html",
            "recordings/view1_trial1.cine",
        ] {
            assert!(names.contains(expected), "{expected} of {names:?}");
        }
        // Everything that is referred to is there, but for what lies outside: the specification and the status.
        let known: BTreeSet<&str> = entities.iter().filter_map(|one| one["@id"].as_str()).collect();
        let mut referred = Vec::new();
        entities.iter().for_each(|one| {
            one.as_object().into_iter().flatten().for_each(|(_, value)| references(value, &mut referred));
        });
        let outside = ["https://w3id.org/ro/crate/1.1", "http://schema.org/CompletedActionStatus"];
        let missing: Vec<&String> = referred
            .iter()
            .filter(|id| !known.contains(id.as_str()) && !outside.contains(&id.as_str()))
            .collect();
        assert!(missing.is_empty(), "{missing:?}");
        let run = entities.iter().find(|one| is_of(one, "CreateAction")).expect("what was done");
        assert_eq!(run["object"].as_array().map(Vec::len), Some(15));
        let described = fs::read(package.join("r3xa.json")).expect("it is there");
        let described: Value = serde_json::from_slice(&described).expect("it is JSON");
        assert_eq!(described["authors"], "E. Hamster");
        assert_eq!(described["data_sources"][0]["image_scale"]["unit"], "px/m");
        accepted_by_others(&package);
        // A second one into the same folder is refused.
        let again =
            chainwave().arg("archive").arg(&results).arg("--out").arg(&package).output().expect("it starts");
        assert_eq!(again.status.code(), Some(2));
    }
}
