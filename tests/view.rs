//! A page of recordings on this machine: `chainwave view`.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::Duration;

use serde_json::Value;
use tempfile::TempDir;

use crate::support::command::{chainwave, fail, succeed};
use crate::support::repository::root;

/// A server that ends with the test.
struct Served {
    child: Child,
    port: String,
    token: String,
}

impl Drop for Served {
    fn drop(&mut self) {
        // It may have ended by itself, which the test has seen.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Served {
    /// Starts the command with these arguments and reads the address that it prints first.
    fn start(arguments: &[&Path]) -> Self {
        let mut command = chainwave();
        command.arg("view").args(arguments).arg("--no-browser").stdout(Stdio::piped());
        let mut child = command.spawn().expect("chainwave starts");
        let mut line = String::new();
        let printed = child.stdout.take().expect("it is a pipe");
        BufReader::new(printed).read_line(&mut line).expect("it prints its address");
        let rest = line.trim().strip_prefix("http://127.0.0.1:").expect("an address of this machine");
        let (port, token) = rest.split_once("/?token=").expect("an address with a token");
        Self { child, port: port.to_owned(), token: token.to_owned() }
    }

    /// The status and the body of an answer.
    fn get(&self, path: &str, token: &str) -> (u16, Vec<u8>) {
        self.send("GET", path, token, "")
    }

    fn send(&self, method: &str, path: &str, token: &str, body: &str) -> (u16, Vec<u8>) {
        let mut stream = TcpStream::connect(format!("127.0.0.1:{}", self.port)).expect("it listens");
        stream.set_read_timeout(Some(Duration::from_secs(20))).expect("a time can be set");
        let request = format!(
            "{method} {path} HTTP/1.1\r\nHost: localhost\r\nX-Token: {token}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{body}",
            body.len()
        );
        stream.write_all(request.as_bytes()).expect("it reads");
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).expect("it answers");
        let end = answer.windows(4).position(|window| window == b"\r\n\r\n").expect("an answer has a head");
        let status = String::from_utf8_lossy(&answer[9..12]).parse().expect("an answer has a status");
        (status, answer.split_off(end + 4))
    }

    fn json(&self, path: &str) -> Value {
        let (status, body) = self.get(path, &self.token);
        assert_eq!(status, 200, "{path}: {}", String::from_utf8_lossy(&body));
        serde_json::from_slice(&body).expect("it is JSON")
    }
}

#[test]
fn a_recording_is_shown_to_whoever_has_the_address() {
    let served = Served::start(&[&root().join("data-samples/hec-view1-trial1.cine")]);
    assert_eq!(served.get("/", "0").0, 403);
    assert_eq!(served.get("/", &served.token).0, 200);
    assert_eq!(served.json("/api/recording")["n_frames"], 120);
    let (status, png) = served.get("/api/frame/119", &served.token);
    assert!(status == 200 && png.starts_with(b"\x89PNG"));

    // Its sidecar says where the three markers lie at rest.
    let found = served.json("/api/markers");
    let markers = found["markers"].as_array().expect("a list");
    assert_eq!(markers.len(), 3, "{found}");
    for (marker, x_px) in markers.iter().zip([25.0, 100.0, 175.0]) {
        let off = marker["subset"]["x_px"].as_f64().expect("a number") - x_px;
        // A third of the 11 px that an outline is averaged over.
        assert!(off.abs() < 3.7, "{marker}");
    }
}

#[test]
fn an_experiment_and_its_results_are_shown_with_their_subsets() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let (film, results) = (folder.path().join("film"), folder.path().join("results"));
    let experiment = root().join("tests/small-experiment/experiment.toml");
    succeed(chainwave().arg("synthesize").arg(&experiment).arg("--out").arg(&film));
    let experiment = film.join("experiment.toml");

    let served = Served::start(&[&experiment]);
    let list = served.json("/api/recordings");
    let n = list["recordings"].as_array().map_or(0, Vec::len);
    assert!(n > 1 && list["notes"] == Value::Array(Vec::new()), "{list}");
    assert_eq!(list["set_up"], Value::Null, "there is an experiment already");
    // What a check warns of stands beside the pictures: subsets beside their markers.
    let beside = film.join("beside.toml");
    let text = std::fs::read_to_string(&experiment).expect("it was filmed");
    let moved = text.replace("first_body_px = [30.0, 23.5]", "first_body_px = [67.5, 23.5]");
    assert!(moved != text, "{text}");
    std::fs::write(&beside, moved).expect("the folder takes a file");
    let notes = Served::start(&[&beside]).json("/api/recordings")["notes"].to_string();
    assert!(notes.contains("marker") || notes.contains("texture"), "{notes}");
    let subsets = served.json("/api/recording?recording=0")["subsets"].clone();
    assert!(subsets[0]["name"] == "1" && subsets[0]["half_width_px"].is_u64(), "{subsets}");

    succeed(chainwave().arg("run").arg(&experiment).arg("--out").arg(&results));
    let served = Served::start(&[&results, Path::new("--recordings"), &film]);
    let tracks = served.json("/api/tracks/0?recording=0")["tracks"].clone();
    let at_rest = |value: &Value| value.as_f64().expect("a number");
    // The reference is the mean of the frames at rest: places there differ by the noise of matches, some thousandths of a pixel.
    let off = at_rest(&tracks[0]["place_px"][0]) - at_rest(&subsets[0]["x_px"]);
    assert!(off.abs() < 0.1, "{tracks} {subsets}");

    // Its wave, its doubtful readings, and a correction that the next run reads.
    let wave = served.json("/api/wave");
    assert_eq!(wave["strain"].as_array().map(Vec::len), Some(11), "12 bodies have 11 gaps");
    let review = served.json("/api/review");
    assert!(review["queue"][0]["doubt"].is_f64() && review["version"] == 0, "{}", review["queue"][0]);
    let correction = r#"{"version": 0, "corrections": [{"recording": 1, "name": "3", "first_frame": 7, "last_frame": 9,
        "remedy": "exclude", "place_px": null, "note": "a, \"hand\""}]}"#;
    let put = |token: &str| served.send("PUT", "/api/corrections", token, correction);
    assert_eq!(put("0").0, 403);
    let (status, body) = put(&served.token);
    assert_eq!(status, 200, "{}", String::from_utf8_lossy(&body));
    assert_eq!(put(&served.token).0, 409, "the list was changed meanwhile");
    let written = std::fs::read_to_string(film.join("corrections.csv")).expect("the page wrote it");
    let row = "view1_trial2.cine,3,7,9,exclude,,,\"a, \"\"hand\"\"\"";
    assert_eq!(written.lines().nth(1), Some(row));
    drop(served);

    let message = fail(chainwave().arg("view").arg(&results).arg("--no-browser"), 2);
    assert!(message.contains("--recordings"), "{message}");
}

/// A folder of recordings alone becomes an experiment that runs: by the markers that the page proposes in a view that is not the first, and the
/// numbers that no picture tells.
#[test]
fn a_folder_of_recordings_is_set_up_in_the_page_and_runs() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let (film, shots) = (folder.path().join("film"), folder.path().join("shots"));
    let experiment = root().join("tests/small-experiment/experiment.toml");
    succeed(chainwave().arg("synthesize").arg(&experiment).arg("--out").arg(&film));
    std::fs::create_dir(&shots).expect("a folder can be made");
    for entry in std::fs::read_dir(&film).expect("it was filmed") {
        let path = entry.expect("it can be listed").path();
        if path.extension().is_some_and(|ending| ending == "cine") {
            std::fs::copy(&path, shots.join(path.file_name().expect("a name"))).expect("it can be copied");
        }
    }

    let served = Served::start(&[&shots]);
    let list = served.json("/api/recordings");
    let index = (0..).find(|i| list["recordings"][i] == "view2_trial1.cine").expect("it is listed");
    let rest_until_s = list["set_up"]["rest_until_s"].clone();
    assert!(rest_until_s.is_f64(), "{list}");
    let markers = served.json(&format!("/api/markers?recording={index}"))["markers"].clone();
    let mut points: Vec<Value> =
        markers.as_array().expect("a list").iter().map(|marker| marker["subset"].clone()).collect();
    assert_eq!(points.len(), 5, "{markers}");
    for (point, body) in points.iter_mut().zip(5..) {
        point["name"] = Value::String(format!("{body}"));
    }
    let answers = serde_json::json!({
        "n_bodies": "12", "pitch_m": "0,030", "mass_kg": "0.455e-3", "striker_mass_kg": "4.3e-3", "velocity_m_per_s": " 2.73",
        "velocity_sigma_m_per_s": "0.05", "a": "60.1", "delta_0_m": "2.27e-3", "p": "0.114", "stage_step_m": "0.12", "ruler_length_m": "",
    });
    let picked = serde_json::json!({ "points": points, "ruler_px": null, "rest_until_s": rest_until_s, "answers": answers });
    let put = |sent: &Value, overwrite: bool| {
        let path = format!("/api/experiment?recording={index}&overwrite={overwrite}");
        let (status, body) = served.send("PUT", &path, &served.token, &sent.to_string());
        (status, String::from_utf8_lossy(&body).into_owned())
    };
    let (status, said) = put(&picked, false);
    assert!(status == 200 && said.contains("wrote ") && !said.contains("FILL_IN"), "{said}");
    assert_eq!(put(&picked, false).0, 409, "nothing is overwritten");

    let text = std::fs::read_to_string(shots.join("experiment.toml")).expect("it was written");
    let written: toml::Table = text.parse().expect("it is TOML");
    // The film's own experiment has body 1 at (30, 23.5) with the stage at 0; outlines are averaged over 11 px.
    for (axis, truth_px) in [30.0, 23.5].into_iter().enumerate() {
        let place_px = written["camera"]["first_body_px"][axis].as_float().expect("a number");
        assert!((place_px - truth_px).abs() < 3.7, "{text}");
    }
    let own = std::fs::read_to_string(film.join("trials.csv")).expect("it was filmed");
    let stated = std::fs::read_to_string(shots.join("trials.csv")).expect("it was written");
    let places = |table: &str| -> Vec<f64> {
        let last = |line: &str| line.rsplit(',').next().and_then(|cell| cell.parse().ok());
        table.lines().skip(1).map(|line| last(line).expect("a number")).collect()
    };
    assert_eq!(places(&own), places(&stated));
    drop(served);
    let results = folder.path().join("results");
    succeed(chainwave().arg("run").arg(shots.join("experiment.toml")).arg("--out").arg(&results));
    let results = std::fs::read_to_string(results.join("results.json")).expect("it was written");
    let results: Value = serde_json::from_str(&results).expect("it is JSON");
    let truth = std::fs::read_to_string(film.join("truth.json")).expect("it was filmed");
    let truth: Value = serde_json::from_str(&truth).expect("it is JSON");
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{results} {truth}"));
    // Its scale is that of the markers' places, which is uncertain, and c_d's sigma knows it: beyond 4 is once in 16 000 such films.
    let off = number(&results["c_d_kg_per_s"]) - number(&truth["c_d_kg_per_s"]);
    assert!(off.abs() < 4.0 * number(&results["c_d_sigma"]), "c_d is off by {off} kg/s");
}

#[test]
fn an_experiment_that_cannot_be_meant_is_not_written() {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let sample = root().join("data-samples/hec-view1-trial1.cine");
    std::fs::copy(sample, folder.path().join("view1_trial1.cine")).expect("the sample can be copied");
    let served = Served::start(&[folder.path()]);
    let put = |points: Value, answers: Value| {
        let sent = serde_json::json!({ "points": points, "ruler_px": null, "rest_until_s": null, "answers": answers });
        let (status, body) = served.send("PUT", "/api/experiment", &served.token, &sent.to_string());
        (status, String::from_utf8_lossy(&body).into_owned())
    };
    let point = |name: &str| serde_json::json!([{ "name": name, "x_px": 25.0, "y_px": 19.5, "half_width_px": 8, "half_height_px": 8 }]);
    let none = || serde_json::json!({});
    let (status, said) = put(point("left one"), none());
    assert!(status == 409 && said.contains("number of a body"), "{said}");
    let (status, said) = put(point("4"), none());
    assert!(status == 409 && said.contains("where body 1 lies"), "{said}");
    for (answers, expected) in [
        (serde_json::json!({ "pitch_m": "three" }), "pitch at rest (m): a number"),
        (serde_json::json!({ "colour": "1" }), "answers to what was asked"),
    ] {
        let (status, said) = put(point("1"), answers);
        assert!(status == 400 && said.contains(expected), "{said}");
    }
    assert_eq!(put(serde_json::json!([]), none()).0, 400);
    assert!(!folder.path().join("experiment.toml").exists() && !folder.path().join("trials.csv").exists());
    // Body 1 alone is enough: what is not known stands as FILL_IN.
    let (status, said) = put(point("1"), none());
    assert!(status == 200 && said.contains("FILL_IN"), "{said}");
}

#[test]
fn what_cannot_be_shown_is_named() {
    let empty = TempDir::new().expect("a temporary folder can be made");
    for path in [empty.path(), &empty.path().join("gone.cine"), &empty.path().join("gone.toml")] {
        fail(chainwave().arg("view").arg(path).arg("--no-browser"), 2);
    }
    let sample = root().join("data-samples/hec-view1-trial1.cine");
    let served = Served::start(&[&sample]);
    let message =
        fail(chainwave().arg("view").arg(&sample).args(["--no-browser", "--port", &served.port]), 2);
    assert!(message.contains("expected a free port"), "{message}");
}
