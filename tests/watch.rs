//! Shots looked at as they are saved: `chainwave watch`.

mod slow {
    use std::fs::{self, File};
    use std::io::{BufRead, BufReader, Write};
    use std::path::Path;
    use std::process::{Child, Command, Stdio};
    use std::sync::mpsc::{Receiver, channel};
    use std::time::Duration;

    use serde_json::Value;

    use crate::support::command::chainwave;
    use crate::support::laboratory::Laboratory;

    const FAULTS: &str = r#"
[[synthetic.faults]]
kind = "covered_body"
recording = "view1_trial3.cine"
body = 2
from_s = 0.002
until_s = 0.004

[[synthetic.faults]]
kind = "struck_too_fast"
recording = "view1_trial4.cine"
factor = 1.2
"#;

    /// A watch that ends with the test.
    struct Watch {
        child: Child,
        lines: Receiver<String>,
    }

    impl Drop for Watch {
        fn drop(&mut self) {
            // It may have ended by itself, which the test has seen.
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }

    impl Watch {
        fn start(folder: &Path, arguments: &[&str]) -> Self {
            let mut command = chainwave();
            command.arg("watch").arg(folder).args(["--every", "0.1"]).args(arguments).stdout(Stdio::piped());
            let mut child = command.spawn().expect("chainwave starts");
            let printed = BufReader::new(child.stdout.take().expect("it is a pipe"));
            let (to, lines) = channel();
            std::thread::spawn(move || {
                printed.lines().map_while(Result::ok).take_while(|line| to.send(line.clone()).is_ok()).count()
            });
            Self { child, lines }
        }

        /// The next line; a shot takes a second or so.
        fn line(&self) -> String {
            self.lines.recv_timeout(Duration::from_secs(60)).expect("it says a line for each shot")
        }

        fn json(&self) -> Value {
            serde_json::from_str(&self.line()).expect("each line is an object")
        }

        /// Ends it as Ctrl-C does; its exit code.
        fn interrupt(&mut self) -> Option<i32> {
            let status = Command::new("kill").args(["-INT", &self.child.id().to_string()]).status();
            assert!(status.expect("kill starts").success());
            self.child.wait().expect("it ends").code()
        }
    }

    fn codes(line: &Value) -> Vec<&str> {
        line["findings"].as_array().into_iter().flatten().filter_map(|one| one["code"].as_str()).collect()
    }

    #[test]
    fn each_shot_has_its_line_while_files_come_grow_and_break() {
        let laboratory = Laboratory::with_appended(FAULTS);
        let recordings = laboratory.film();
        let folder = laboratory.path("camera");
        fs::create_dir(&folder).expect("a folder can be made");
        let experiment = laboratory.path("experiment.toml");
        let experiment = experiment.to_str().expect("a path of letters");
        let mut watch = Watch::start(&folder, &["--json", "--experiment", experiment]);
        let save = |trial: u32| {
            let name = format!("view1_trial{trial}.cine");
            fs::copy(recordings.join(&name), folder.join(&name)).expect("the recording can be copied");
            name
        };
        fs::write(folder.join("notes.txt"), "no recording").expect("the folder takes a file");
        for trial in [1, 2] {
            let name = save(trial);
            let line = watch.json();
            assert_eq!((&line["recording"], &line["ok"]), (&Value::from(name), &Value::from(true)), "{line}");
            assert_eq!(line["n_frames"], 330);
        }
        save(3);
        let line = watch.json();
        assert!(codes(&line).contains(&"body_lost") && line.to_string().contains("body 2 is lost"), "{line}");
        save(4);
        let line = watch.json();
        assert!(codes(&line).contains(&"unlike_others"), "{line}");

        // One that grows with pauses longer than the time between two looks is not taken for broken, nor for whole.
        let bytes = fs::read(recordings.join("view1_trial5.cine")).expect("it was filmed");
        let mut file = File::create(folder.join("view1_trial5.cine")).expect("the folder takes a file");
        let parts: Vec<&[u8]> = bytes.chunks(bytes.len() / 4 + 1).collect();
        for (k, part) in parts.iter().enumerate() {
            file.write_all(part).and_then(|()| file.sync_all()).expect("the file takes bytes");
            if k + 1 < parts.len() {
                assert!(watch.lines.recv_timeout(Duration::from_millis(600)).is_err(), "it is not whole yet");
            }
        }
        drop(file);
        let line = watch.json();
        assert_eq!((&line["recording"], &line["ok"]), (&"view1_trial5.cine".into(), &true.into()), "{line}");

        // One that stays cut is named, once, and the next one is looked at all the same.
        fs::write(folder.join("view1_trial6.cine"), &bytes[..bytes.len() / 2])
            .expect("the folder takes a file");
        let line = watch.json();
        assert_eq!(
            (&line["recording"], codes(&line).as_slice()),
            (&"view1_trial6.cine".into(), &["broken"][..])
        );
        let name = "view2_trial1.cine";
        fs::copy(recordings.join(name), folder.join(name)).expect("the recording can be copied");
        assert_eq!(watch.json()["recording"], name);
        assert_eq!(watch.interrupt(), Some(0));
    }

    #[test]
    fn without_an_experiment_markers_are_looked_for() {
        let laboratory = Laboratory::with_experiment("rest_until_s = -8e-5", "rest_until_s = -9e-5");
        let recordings = laboratory.film();
        let mut watch = Watch::start(&recordings, &[]);
        let lines: Vec<String> = (0..3).map(|_| watch.line()).collect();
        for line in &lines {
            assert!(line.starts_with("view1_trial") && line.contains(".cine: "), "{line}");
        }
        assert_eq!(watch.interrupt(), Some(0));
    }
}
