//! A headless browser, driven by its own debugging protocol over two pipes: what the page says, asks for and shows.

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tempfile::TempDir;

/// Names under which systems install a browser that shows a page without a screen.
const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];
/// How long anything may take: a busy machine starts a browser in some seconds.
const PATIENCE: Duration = Duration::from_secs(60);

/// A browser with one page.
pub struct Chromium {
    child: Child,
    to: File,
    from: Receiver<Value>,
    session: String,
    n_sent: u64,
    /// What the console said, and what went wrong in scripts.
    pub complaints: Vec<String>,
    /// Addresses that were asked for.
    pub requests: Vec<String>,
    _profile: TempDir,
}

impl Drop for Chromium {
    fn drop(&mut self) {
        // It may have ended by itself, which the test has seen.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Chromium {
    /// Starts one with a window of some size; `None` where none is installed.
    pub fn start(width: u32, height: u32) -> Option<Self> {
        let runs = |name: &&&str| {
            let version =
                Command::new(name).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
            version.is_ok_and(|status| status.success())
        };
        let browser = BROWSERS.iter().find(runs)?;
        let profile = tempfile::tempdir().unwrap();
        let pipe = |name: &str| {
            let path = profile.path().join(name);
            let made = Command::new("mkfifo").arg(&path).status();
            made.is_ok_and(|status| status.success()).then_some(path)
        };
        let (orders, answers) = (pipe("orders")?, pipe("answers")?);
        // The protocol's pipes are the descriptors 3 and 4. A pipe opens when both of its ends do.
        let child = Command::new("sh")
            .args(["-c", "orders=$1; answers=$2; shift 2; exec \"$@\" 3<\"$orders\" 4>\"$answers\"", "sh"])
            .args([&orders, &answers])
            .arg(browser)
            .args(["--headless=new", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe"])
            .args(["--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1", "about:blank"])
            .arg(format!("--window-size={width},{height}"))
            .arg(format!("--user-data-dir={}", profile.path().join("profile").display()))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .ok()?;
        let to = OpenOptions::new().write(true).open(&orders).unwrap();
        let from = messages(File::open(&answers).unwrap());
        let (complaints, requests) = (Vec::new(), Vec::new());
        let session = String::new();
        let mut browser =
            Self { child, to, from, session, n_sent: 0, complaints, requests, _profile: profile };
        let targets = browser.order("Target.getTargets", &json!({}));
        let page = targets["targetInfos"].as_array().unwrap().iter().find(|one| one["type"] == "page");
        let page = page.expect("a page is open")["targetId"].clone();
        let attached = browser.order("Target.attachToTarget", &json!({ "targetId": page, "flatten": true }));
        browser.session = attached["sessionId"].as_str().unwrap().to_owned();
        for part in ["Page", "Runtime", "Log", "Network"] {
            browser.order(&format!("{part}.enable"), &json!({}));
        }
        Some(browser)
    }

    pub fn open(&mut self, address: &str) {
        self.order("Page.navigate", &json!({ "url": address }));
    }

    /// What a script gives in the page.
    pub fn evaluate(&mut self, script: &str) -> Value {
        let asked = json!({ "expression": script, "returnByValue": true, "awaitPromise": true });
        let found = self.order("Runtime.evaluate", &asked);
        assert!(found.get("exceptionDetails").is_none(), "{script}: {found}");
        found["result"]["value"].clone()
    }

    /// Waits until an expression is true; one that fails, as all do before the page is there, is not.
    pub fn wait_for(&mut self, script: &str) {
        let begin = Instant::now();
        let guarded = format!("(() => {{ try {{ return {script} }} catch {{ return false }} }})()");
        while self.evaluate(&guarded) != Value::Bool(true) {
            assert!(begin.elapsed() < PATIENCE, "{script}: {:?}", self.complaints);
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Presses a key, by its name in events of the page.
    pub fn press(&mut self, key: &str) {
        for kind in ["keyDown", "keyUp"] {
            self.order("Input.dispatchKeyEvent", &json!({ "type": kind, "key": key }));
        }
    }

    /// Clicks a place of the window, in its pixels.
    pub fn click(&mut self, [x, y]: [f64; 2]) {
        for kind in ["mousePressed", "mouseReleased"] {
            let event =
                json!({ "type": kind, "x": x, "y": y, "button": "left", "buttons": 1, "clickCount": 1 });
            self.order("Input.dispatchMouseEvent", &event);
        }
    }

    /// Writes what is shown to `NAME.png` in the folder that the variable `CHAINWAVE_SCREENSHOTS` names, to be looked at.
    pub fn picture(&mut self, name: &str) {
        let shot = self.order("Page.captureScreenshot", &json!({}));
        let bytes = from_base64(shot["data"].as_str().unwrap());
        assert!(bytes.starts_with(b"\x89PNG"));
        if let Some(folder) = std::env::var_os("CHAINWAVE_SCREENSHOTS") {
            std::fs::write(Path::new(&folder).join(format!("{name}.png")), bytes).unwrap();
        }
    }

    pub fn prefer_dark(&mut self) {
        let dark = json!({ "features": [{ "name": "prefers-color-scheme", "value": "dark" }] });
        self.order("Emulation.setEmulatedMedia", &dark);
    }

    /// Sends an order and waits for its answer; events that come meanwhile are noted.
    fn order(&mut self, method: &str, parameters: &Value) -> Value {
        self.n_sent += 1;
        let mut order = json!({ "id": self.n_sent, "method": method, "params": parameters });
        if !self.session.is_empty() {
            order["sessionId"] = json!(self.session);
        }
        self.to.write_all(format!("{order}\0").as_bytes()).unwrap();
        loop {
            let message = self.from.recv_timeout(PATIENCE).expect("the browser answers");
            if message["id"] == self.n_sent {
                assert!(message.get("error").is_none(), "{method}: {message}");
                return message["result"].clone();
            }
            self.note(&message);
        }
    }

    fn note(&mut self, event: &Value) {
        let parameters = &event["params"];
        match event["method"].as_str().unwrap_or_default() {
            "Runtime.exceptionThrown" | "Runtime.consoleAPICalled" | "Log.entryAdded" => {
                self.complaints.push(parameters.to_string());
            }
            "Network.requestWillBeSent" => {
                let address = parameters["request"]["url"].as_str().unwrap_or_default();
                self.requests.push(address.to_owned());
            }
            _ => {}
        }
    }
}

/// The messages of a pipe, each of which ends with a zero.
fn messages(mut pipe: File) -> Receiver<Value> {
    let (to, from) = channel();
    std::thread::spawn(move || {
        let (mut bytes, mut part) = (Vec::new(), [0; 65_536]);
        while let Ok(n @ 1..) = pipe.read(&mut part) {
            bytes.extend_from_slice(&part[..n]);
            while let Some(end) = bytes.iter().position(|byte| *byte == 0) {
                let message: Vec<u8> = bytes.drain(..=end).collect();
                let value = serde_json::from_slice(&message[..end]).unwrap();
                if to.send(value).is_err() {
                    return;
                }
            }
        }
    });
    from
}

fn from_base64(text: &str) -> Vec<u8> {
    let digit = |letter: u8| match letter {
        b'A'..=b'Z' => Some(letter - b'A'),
        b'a'..=b'z' => Some(letter - b'a' + 26),
        b'0'..=b'9' => Some(letter - b'0' + 52),
        b'+' => Some(62),
        b'/' => Some(63),
        _ => None,
    };
    let digits: Vec<u8> = text.bytes().filter_map(digit).collect();
    let of_four = |four: &[u8]| -> Vec<u8> {
        let bits =
            four.iter().fold(0_u32, |bits, digit| (bits << 6) | u32::from(*digit)) << (6 * (4 - four.len()));
        bits.to_be_bytes()[1..four.len()].to_vec()
    };
    digits.chunks(4).flat_map(of_four).collect()
}
