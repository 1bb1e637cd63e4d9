//! The server as a browser, and as somebody hostile, meets it: raw requests over TCP.

#![cfg(test)]

mod support;

use chainwave_synthetic::pictures::{Surface, counts, picture};
use chainwave_view::{Collection, ShownRecording};
use serde_json::Value;
use support::{Answer, Site, WIDTH, count, write_frames};

#[test]
fn nobody_gets_in_without_the_token() {
    let site = Site::start();
    let half = &site.token[..31];
    for path in [
        "/",
        "/?token=",
        "/?token=0",
        &format!("/?token={half}"),
        &format!("/?token={half}g"),
        "/api/recordings",
        "/favicon.ico",
    ] {
        assert_eq!(site.raw("GET", path, "Host: 127.0.0.1:1\r\n", b"").status, 403, "{path}");
    }
    let wrong = format!("Host: localhost\r\nX-Token: {}\r\n", "0".repeat(32));
    assert_eq!(site.raw("GET", "/api/recordings", &wrong, b"").status, 403);
    let right = format!("Host: localhost\r\nX-Token: {}\r\n", site.token);
    assert_eq!(site.raw("GET", "/api/recordings", &right, b"").status, 200);
}

#[test]
fn a_page_of_another_host_gets_nothing() {
    let site = Site::start();
    let path = format!("/api/recordings?token={}", site.token);
    for host in ["", "Host: evil.example\r\n", "Host: 127.0.0.1.evil.example:80\r\n", "Host: 10.0.0.1\r\n"] {
        assert_eq!(site.raw("GET", &path, host, b"").status, 403, "{host:?}");
    }
    assert_eq!(site.raw("GET", &path, "Host: 127.0.0.1:9000\r\n", b"").status, 200, "a forwarded port");
}

#[test]
fn the_page_lets_nothing_else_run() {
    let page = Site::start().get("/");
    assert_eq!(page.status, 200);
    let policy = page.header("content-security-policy").unwrap();
    assert!(policy.starts_with("default-src 'none'; script-src 'nonce-"), "{policy}");
    let nonce = policy.split('\'').nth(3).unwrap().strip_prefix("nonce-").unwrap();
    let text = String::from_utf8(page.body.clone()).unwrap();
    assert!(text.contains(&format!("<script nonce=\"{nonce}\">")) && !text.contains("<script>"));
    let again = Site::start().get("/");
    assert_ne!(again.header("content-security-policy").unwrap(), policy, "a nonce is used once");
}

#[test]
fn a_recording_says_what_it_is() {
    let site = Site::start();
    let list = site.json("/api/recordings");
    assert_eq!(list["recordings"], serde_json::json!(["shot", "gone"]));
    let info = site.json("/api/recording");
    let [width, height, n_frames, bit_depth] =
        ["width_px", "height_px", "n_frames", "bit_depth"].map(|key| info[key].as_u64().unwrap());
    assert_eq!([width, height, n_frames, bit_depth], [160, 90, 3, 12]);
    assert_eq!(info["rate_hz"], 1000.0);
    assert_eq!(info["subsets"][0]["name"], "body 1");
    assert_eq!(site.get("/api/recording?recording=1").status, 500, "a file that is gone, named");
    assert_eq!(site.get("/api/recording?recording=2").status, 404);
}

#[test]
fn a_frame_comes_as_it_was_recorded() {
    let site = Site::start();
    let frame = site.get("/api/frame/2?x=3&y=5&w=40&h=30&low=100&high=1120");
    assert_eq!((frame.status, frame.header("content-type")), (200, Some("image/png")));
    assert_eq!(frame.header("x-time-s"), Some("0.002"));
    let (size, greys) = frame.png();
    assert_eq!(size, [40, 30]);
    for (i, grey) in greys.into_iter().enumerate() {
        let (x, y) = (3 + i % 40, 5 + i / 40);
        // 1020 counts from black to white, four of them a grey value.
        let expected = ((f64::from(count(2, x, y)) - 100.0) / 4.0).round().clamp(0.0, 255.0);
        assert_eq!(u32::from(grey), expected as u32, "({x}, {y})");
    }
}

#[test]
fn a_smaller_frame_has_the_means() {
    let (size, greys) = Site::start().get("/api/frame/1?scale=4&low=0&high=4095").png();
    assert_eq!(size, [40, 23], "160 and 90 over 4, rounded up");
    for (i, grey) in greys.into_iter().enumerate() {
        let (columns, rows) = (4 * (i % 40)..4 * (i % 40) + 4, 4 * (i / 40)..(4 * (i / 40) + 4).min(90));
        let n = 4.0 * rows.len() as f64;
        let sum: f64 = rows.flat_map(|y| columns.clone().map(move |x| f64::from(count(1, x, y)))).sum();
        assert_eq!(u32::from(grey), (255.0 * (sum / n) / 4095.0).round() as u32, "{i}");
    }
}

#[test]
fn hostile_requests_get_an_error_that_says_why() {
    let site = Site::start();
    let cases = [
        (404, "/api/frame/3"),
        (404, "/api/frame/18446744073709551615"),
        (400, "/api/frame/18446744073709551616"),
        (400, "/api/frame/-1"),
        (400, "/api/frame/0x1"),
        (400, "/api/frame/1.5"),
        (400, "/api/frame/0?w=1000000000&h=1000000000"),
        (400, "/api/frame/0?w=18446744073709551615&x=1"),
        (400, "/api/frame/0?x=160"),
        (400, "/api/frame/0?w=0"),
        (400, "/api/frame/0?scale=0"),
        (400, "/api/frame/0?scale=3"),
        (400, "/api/frame/0?scale=128"),
        (400, "/api/frame/0?low=5&high=5"),
        (400, "/api/frame/0?low=NaN"),
        (400, "/api/frame/0?high=inf"),
        (404, "/../../etc/passwd"),
        (404, "/..%2f..%2fetc%2fpasswd"),
        (404, "/api/frame/../../../etc/passwd"),
        (404, "/api/frame"),
        (404, "/page.js"),
        (400, "/%00%ff"),
        (404, "/%00"),
        (404, "/api/levels/9"),
        (404, "/api/markers?frame=9"),
        (404, "/api/tracks/9"),
        (400, "/api/sigma/0?x=50&y=50&half_width=100000&half_height=9"),
        (400, "/api/sigma/0?x=nan&y=50"),
        (400, "/api/recording?recording=x"),
    ];
    for (status, path) in cases {
        let answer = site.get(path);
        assert_eq!(answer.status, status, "{path}: {}", String::from_utf8_lossy(&answer.body));
        let said: Value = serde_json::from_slice(&answer.body).unwrap();
        for key in ["path", "expected", "found", "hint"] {
            assert!(said[key].is_string(), "{path}: {said}");
        }
        assert!(!said["expected"].as_str().unwrap().is_empty(), "{path}: {said}");
    }
    let long = |n: usize| format!("/api/frame/0?x={}", "9".repeat(n));
    assert_eq!(site.get(&long(10_000)).status, 400);
    assert_eq!(site.get(&long(100_000)).status, 431);
    assert_eq!(site.raw("GE T", "/", "", b"").status, 400);
    assert_eq!(site.raw("GET", "/", &"X: y\r\n".repeat(100), b"").status, 400);
    assert_eq!(site.send("DELETE", "/api/points", b"").status, 405);
    assert_eq!(site.send("PUT", "/api/frame/0", b"").status, 404);
    assert_eq!(site.get("/api/frame/0").status, 200, "and the server is still there");
}

#[test]
fn a_body_that_is_too_long_is_not_read() {
    let site = Site::start();
    let path = format!("/api/points?token={}", site.token);
    let announced = "Host: localhost\r\nContent-Length: 99999999999\r\n";
    assert_eq!(site.raw("PUT", &path, announced, b"").status, 413);
    let twice = "Host: localhost\r\nContent-Length: 1\r\nContent-Length: 2\r\n";
    assert_eq!(site.raw("PUT", &path, twice, b"").status, 400);
    assert_eq!(
        site.raw("PUT", &path, "Host: localhost\r\nTransfer-Encoding: chunked\r\n", b"0\r\n\r\n").status,
        411
    );
    // Those who announce a body and never send it hold up nobody, with the token or without it.
    let waiting: Vec<_> = (0..16)
        .map(|i| {
            let path = if i % 2 == 0 { path.as_str() } else { "/api/points" };
            site.open("PUT", path, "Host: localhost\r\nContent-Length: 5000\r\n")
        })
        .collect();
    assert_eq!(site.get("/api/frame/0").status, 200);
    drop(waiting);
}

#[test]
fn a_connection_serves_request_after_request() {
    let site = Site::start();
    let headers = format!("Host: localhost\r\nX-Token: {}\r\n", site.token);
    let mut stream = site.open("GET", "/api/recordings", &headers);
    let first = Answer::read(&mut stream);
    site.go_on(&mut stream, "GET", "/api/levels/0", &headers);
    let second = Answer::read(&mut stream);
    assert_eq!((first.status, second.status), (200, 200));
    assert_eq!(second.header("connection"), Some("keep-alive"));
    // What comes after a body that was not read is no request.
    site.go_on(&mut stream, "GET", "/api/levels/0", &format!("{headers}Content-Length: 4\r\n"));
    assert_eq!(Answer::read(&mut stream).header("connection"), Some("close"));
}

#[test]
fn points_are_written_and_never_replaced_in_silence() {
    let site = Site::start();
    let body =
        br#"{"points": [{"name": "1", "x_px": 40.5, "y_px": 30, "half_width_px": 10, "half_height_px": 9},
        {"name": "a, \"b\"", "x_px": 80, "y_px": 45, "half_width_px": 16, "half_height_px": 16}]}"#;
    let answer = site.send("PUT", "/api/points", body);
    assert_eq!(answer.status, 200, "{}", String::from_utf8_lossy(&answer.body));
    let path = site.folder.path().join("points.csv");
    let expected =
        "name,x_px,y_px,half_width_px,half_height_px\n1,40.5,30,10,9\n\"a, \"\"b\"\"\",80,45,16,16\n";
    assert_eq!(std::fs::read_to_string(&path).unwrap(), expected);

    std::fs::write(&path, "mine").unwrap();
    let refused = site.send("PUT", "/api/points", body);
    assert_eq!(refused.status, 409);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "mine");
    assert_eq!(site.send("PUT", "/api/points?overwrite=true", body).status, 200);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), expected);
    let mut names: Vec<_> =
        std::fs::read_dir(site.folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["points.csv", "shot"], "nothing temporary stays");
}

#[test]
fn points_that_cannot_be_are_refused() {
    let site = Site::start();
    let point = |name: &str, x: &str, half: &str| {
        format!(
            r#"{{"name": "{name}", "x_px": {x}, "y_px": 45, "half_width_px": {half}, "half_height_px": 9}}"#
        )
    };
    let cases = [
        "[]".to_owned(),
        "{".to_owned(),
        r#"{"points": []}"#.to_owned(),
        format!(r#"{{"points": [{}, {}]}}"#, point("a", "40", "9"), point("a", "60", "9")),
        format!(r#"{{"points": [{}]}}"#, point("", "40", "9")),
        format!(r#"{{"points": [{}]}}"#, point("a\\nb", "40", "9")),
        format!(r#"{{"points": [{}]}}"#, point("a", "5", "9")),
        format!(r#"{{"points": [{}]}}"#, point("a", "1e400", "9")),
        format!(r#"{{"points": [{}]}}"#, point("a", "-1e300", "9")),
        format!(r#"{{"points": [{}]}}"#, point("a", "40", "-1")),
        format!(r#"{{"points": [{}]}}"#, point("a", "40", "18446744073709551615")),
    ];
    for body in cases {
        assert_eq!(site.send("PUT", "/api/points", body.as_bytes()).status, 400, "{body}");
    }
    assert!(!site.folder.path().join("points.csv").exists());
}

#[test]
fn levels_count_the_pixels() {
    let levels = Site::start().json("/api/levels/0");
    let bars: u64 = levels["bars"].as_array().unwrap().iter().map(|bar| bar.as_u64().unwrap()).sum();
    assert_eq!(bars, 160 * 90);
    assert_eq!(levels["full_scale"], 4095);
    let mut counts: Vec<u16> = (0..160 * 90).map(|i| count(0, i % WIDTH, i / WIDTH)).collect();
    counts.sort_unstable();
    // The smallest counts that 0.5 and 99.5 % of 14400 pixels do not exceed.
    assert_eq!(levels["low"], counts[71]);
    assert_eq!(levels["high"], counts[14_327]);
}

#[test]
fn tracks_are_given_frame_by_frame() {
    let site = Site::start();
    let place = |frame: usize| site.json(&format!("/api/tracks/{frame}"))["tracks"][0]["place_px"].clone();
    assert_eq!(
        [place(0), place(1), place(2)],
        [serde_json::json!([40.0, 45.0]), Value::Null, serde_json::json!([41.5, 45.0])]
    );
}

#[test]
fn markers_are_proposed_with_their_sigma() {
    let folder = tempfile::tempdir().unwrap();
    let shot = folder.path().join("shot");
    let discs: Vec<Surface> = (0..4)
        .map(|i| Surface::turned_disc(i, 4.5, ([50.0 + 90.0 * i as f64, 48.0], 26.0), 0.0, [0.0; 2]))
        .collect();
    let tones = picture([380, 96], &discs).unwrap();
    let frames: Vec<Vec<u16>> = (0..2)
        .map(|number| {
            counts(&tones, 12, 0.01, 5, number).unwrap().iter().map(|&count| count as u16).collect()
        })
        .collect();
    write_frames(&shot, 380, &frames);
    let collection = Collection { recordings: vec![ShownRecording::new(shot)], ..Collection::default() };
    let site = Site::of(folder, collection);

    let found = site.json("/api/markers?frame=0");
    assert_eq!(found["reason"], Value::Null, "{found}");
    let markers = found["markers"].as_array().unwrap();
    assert_eq!(markers.len(), 4, "{found}");
    let number = |value: &Value| value.as_f64().unwrap();
    for (i, marker) in markers.iter().enumerate() {
        let subset = &marker["subset"];
        // A third of the 11 px that an outline is averaged over.
        assert!((number(&subset["x_px"]) - 50.0 - 90.0 * i as f64).abs() < 3.7, "{marker}");
        assert!((number(&subset["y_px"]) - 48.0).abs() < 3.7, "{marker}");
        assert_eq!(marker["number"], i + 1);
        let path = format!(
            "/api/sigma/0?x={}&y={}&half_width={}&half_height={}",
            subset["x_px"], subset["y_px"], subset["half_width_px"], subset["half_height_px"]
        );
        assert_eq!(site.json(&path), marker["sigma"], "the same subset, asked for by itself");
    }
    // Four centres, each off by 2 px at most, over three pitches.
    assert!((number(&found["pitch_px"][0]) - 90.0).abs() < 2.0, "{found}");
    let bare = site.json("/api/sigma/0?x=95&y=48&half_width=8&half_height=8");
    assert_eq!((&bare["sigma_px"], bare["reason"].as_str()), (&Value::Null, Some("no_texture")));
    let outside = site.json("/api/sigma/0?x=3&y=48&half_width=8&half_height=8");
    assert!(outside["reason"].as_str().unwrap().contains("outside"), "{outside}");
}
