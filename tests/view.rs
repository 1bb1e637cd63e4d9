//! A page of recordings on this machine: `chainwave view`.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::Duration;

use serde_json::Value;
use tempfile::TempDir;

use crate::command::{chainwave, fail, succeed};
use crate::repository::root;

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
