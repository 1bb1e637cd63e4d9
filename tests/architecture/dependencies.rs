//! Which crate may know which, and where heavy libraries stay: the manifests against the design's table.

use std::path::Path;

use toml::{Table, Value};

use crate::support::repository::{files, names_in, root};

/// Which crates of the workspace a crate's product may depend on. `None`: on all of them.
const ALLOWED: [(&str, Option<&[&str]>); 18] = [
    ("analysis", Some(&["measurement", "vectors"])),
    ("camera", Some(&["measurement"])),
    ("chainwave", None),
    ("correlation", Some(&["measurement", "vectors"])),
    ("durable", Some(&[])),
    (
        "experiment",
        Some(&[
            "analysis",
            "camera",
            "correlation",
            "inference",
            "measurement",
            "mechanics",
            "stitching",
            "synthetic",
        ]),
    ),
    ("figures", Some(&["durable", "measurement"])),
    ("inference", Some(&["analysis", "measurement", "mechanics"])),
    ("measurement", Some(&[])),
    ("mechanics", Some(&["measurement", "vectors"])),
    ("opencv", Some(&["camera", "chainwave", "correlation", "measurement"])),
    (
        "python",
        Some(&[
            "analysis",
            "camera",
            "correlation",
            "experiment",
            "figures",
            "inference",
            "measurement",
            "mechanics",
            "opencv",
            "stitching",
        ]),
    ),
    ("stitching", Some(&["measurement"])),
    ("synthetic", Some(&["durable", "measurement", "vectors"])),
    ("testkit", Some(&["vectors"])),
    ("vectors", Some(&[])),
    ("view", Some(&["camera", "correlation", "measurement"])),
    ("xtask", Some(&[])),
];

/// What tests share: any crate's tests may use it.
const TESTKIT: &str = "testkit";

/// What a crate's tests and benches may ask beyond that, for a truth to hold the product against.
const ALLOWED_IN_TESTS: [(&str, &[&str]); 4] = [
    ("analysis", &["mechanics"]),
    ("correlation", &["synthetic"]),
    ("opencv", &["synthetic"]),
    ("view", &["synthetic"]),
];

/// Libraries, by the start of their names, and the only packages that may know them. The tests read the command's tables as
/// its users do; polars is compiled for the command in any case.
const KEPT_TO: [(&str, &[&str]); 2] = [("polars", &["chainwave", "tests"]), ("opencv", &["opencv"])];

#[test]
fn every_crate_stands_in_the_table() {
    let table: Vec<&str> = ALLOWED.iter().map(|(role, _)| *role).collect();
    assert_eq!(names_in(Path::new("crates")), table);
}

#[test]
fn packages_are_named_after_their_folders() {
    for (role, _) in ALLOWED {
        let alone = ["chainwave", "xtask"].contains(&role);
        let expected = if alone { role.to_owned() } else { format!("chainwave-{role}") };
        assert_eq!(manifest_of(role)["package"]["name"].as_str(), Some(expected.as_str()), "crates/{role}");
    }
}

#[test]
fn crates_depend_on_each_other_as_designed() {
    let roles: Vec<&str> = ALLOWED.iter().map(|(role, _)| *role).collect();
    for (role, allowed) in ALLOWED {
        let Some(allowed) = allowed else { continue };
        let in_tests = ALLOWED_IN_TESTS.iter().find(|(of, _)| *of == role).map_or(&[][..], |(_, more)| more);
        let (product, all) = (product_dependencies(&manifest_of(role)), dependencies(&manifest_of(role)));
        for package in all {
            let Some(used) = role_of(&package) else { continue };
            let is_in_tests = in_tests.contains(&used) && !product.contains(&package);
            let is_allowed = allowed.contains(&used) || used == TESTKIT || is_in_tests;
            assert!(!roles.contains(&used) || is_allowed, "{role} must not know {used}");
        }
    }
}

#[test]
fn the_testkit_serves_tests_alone() {
    for (role, _) in ALLOWED {
        let manifest = manifest_of(role);
        let product = manifest.get("dependencies").and_then(Value::as_table).into_iter().flatten();
        let uses_it =
            product.map(|(key, value)| package(key, value)).any(|package| package.ends_with(TESTKIT));
        assert!(!uses_it, "{role}: the testkit belongs into dev-dependencies");
    }
}

#[test]
fn the_command_joins_all_crates() {
    let used = dependencies(&manifest_of("chainwave"));
    let no_step = ["chainwave", "opencv", "python", TESTKIT, "vectors", "xtask"];
    for (role, _) in ALLOWED.iter().filter(|(role, _)| !no_step.contains(role)) {
        assert!(used.contains(&format!("chainwave-{role}")), "chainwave does not use {role}");
    }
    assert!(!used.contains(&"xtask".to_owned()), "the set-up tool is no library");
}

#[test]
fn xtask_depends_on_nothing() {
    // It is built before anything that dependencies may need is installed.
    assert_eq!(dependencies(&manifest_of("xtask")), Vec::<String>::new());
}

#[test]
fn heavy_libraries_stay_where_they_belong() {
    let crates = ALLOWED.iter().map(|(role, _)| (*role, manifest_of(role)));
    let tests = std::iter::once(("tests", manifest(Path::new("tests/Cargo.toml"))));
    for (role, manifest) in crates.chain(tests) {
        for package in dependencies(&manifest) {
            for (library, homes) in KEPT_TO {
                assert!(
                    !package.starts_with(library) || homes.contains(&role),
                    "{role} must not know {package}"
                );
            }
        }
    }
}

#[test]
fn opencv_can_be_left_out() {
    let of_opencv = manifest_of("opencv");
    for library in ["opencv", "chainwave"] {
        assert_eq!(of_opencv["dependencies"][library]["optional"].as_bool(), Some(true), "{library}");
    }
    let features = &of_opencv["features"];
    assert_eq!(strings(&features["opencv"]), ["dep:opencv"]);
    assert_eq!(strings(&features["command"]), ["opencv", "dep:chainwave"]);
    assert_eq!(strings(&features["default"]), ["command"]);
    assert_eq!(strings(&of_opencv["bin"][0]["required-features"]), ["command"]);
    // Notebooks take the library without the command, and that only where they are asked to.
    let python = manifest_of("python");
    assert_eq!(python["dependencies"]["chainwave-opencv"]["optional"].as_bool(), Some(true));
    assert_eq!(strings(&python["features"]["opencv"]), ["dep:chainwave-opencv", "chainwave-opencv/opencv"]);
    assert!(python["features"].get("default").is_none(), "the wheel is without OpenCV");
    let shared = &manifest(Path::new("Cargo.toml"))["workspace"]["dependencies"]["chainwave-opencv"];
    assert_eq!(shared["default-features"].as_bool(), Some(false));
}

#[test]
fn every_package_keeps_to_the_lints_of_the_workspace() {
    let manifests: Vec<_> = files().into_iter().filter(|path| path.ends_with("Cargo.toml")).collect();
    // All crates, the tests, the workspace's own manifest, and the camera's fuzz target, which is a workspace of its own.
    assert_eq!(manifests.len(), ALLOWED.len() + 3, "{manifests:?}");
    for path in manifests.iter().filter(|path| path.as_path() != Path::new("Cargo.toml")) {
        let inherits = manifest(path).get("lints").and_then(|lints| lints.get("workspace")?.as_bool());
        assert_eq!(inherits, Some(true), "{} lacks `[lints] workspace = true`", path.display());
    }
}

/// The crate of this workspace that a package is; `None` for other people's, whose names may be those of folders here.
fn role_of(package: &str) -> Option<&str> {
    package
        .strip_prefix("chainwave-")
        .or_else(|| ["chainwave", "xtask"].contains(&package).then_some(package))
}

fn manifest_of(role: &str) -> Table {
    manifest(&Path::new("crates").join(role).join("Cargo.toml"))
}

fn manifest(path: &Path) -> Table {
    let text = std::fs::read_to_string(root().join(path)).expect("the manifest can be read");
    text.parse().expect("the manifest is TOML")
}

/// The packages that a manifest names as dependencies of any kind, on any platform, under their own names.
fn dependencies(manifest: &Table) -> Vec<String> {
    dependencies_of(manifest, &["dependencies", "dev-dependencies", "build-dependencies"])
}

/// Those that the product itself is built with.
fn product_dependencies(manifest: &Table) -> Vec<String> {
    dependencies_of(manifest, &["dependencies", "build-dependencies"])
}

fn dependencies_of(manifest: &Table, kinds: &[&str]) -> Vec<String> {
    let platforms = manifest.get("target").and_then(Value::as_table).into_iter().flat_map(Table::values);
    let tables = std::iter::once(manifest).chain(platforms.filter_map(Value::as_table));
    let sections = tables.flat_map(|table| kinds.iter().map(|kind| table.get(*kind)?.as_table()));
    sections.flatten().flatten().map(|(key, value)| package(key, value)).collect()
}

/// The package behind a dependency's key, which may be an alias, given here or in the workspace's manifest.
fn package(key: &str, value: &Value) -> String {
    let inherited = value.get("workspace").is_some().then(|| manifest(Path::new("Cargo.toml")));
    let origin = inherited.as_ref().map_or(value, |workspace| &workspace["workspace"]["dependencies"][key]);
    origin.get("package").and_then(Value::as_str).unwrap_or(key).to_owned()
}

fn strings(value: &Value) -> Vec<&str> {
    value.as_array().into_iter().flatten().filter_map(Value::as_str).collect()
}

#[test]
fn a_dependency_is_found_wherever_it_hides() {
    let manifest: Table = r#"
        [dependencies]
        plain = "1"
        alias = { package = "real", version = "1" }
        [target.'cfg(unix)'.dev-dependencies]
        hidden = "1"
        [build-dependencies]
        toml.workspace = true
    "#
    .parse()
    .expect("this is TOML");
    let mut found = dependencies(&manifest);
    found.sort();
    assert_eq!(found, ["hidden", "plain", "real", "toml"]);
}
