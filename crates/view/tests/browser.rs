//! The page in a headless browser, where there is one: it picks, tracks, reviews and shows, without an error and without a word to others.

#![cfg(test)]

mod support;

use std::sync::{Arc, Mutex};

use chainwave_view::{Collection, KeepCorrections, QueuedReading, Review, ShownCorrection, ShownWave};
use support::Site;
use support::chromium::Chromium;

/// Corrections as they were kept last.
type Kept = Arc<Mutex<Vec<ShownCorrection>>>;

/// A recording with a wave and a queue of readings.
fn results() -> (Site, Kept) {
    let kept = Kept::default();
    let (folder, mut collection) = Site::shot();
    let reading = |frame: usize, doubt: f64| QueuedReading {
        recording: 0,
        name: "body 1".into(),
        frame,
        stretch: [1, 2],
        doubt,
        reason: "off the other trials by 9.0".into(),
    };
    let to = Arc::clone(&kept);
    collection.review = Some(Review {
        queue: vec![reading(2, 9.0), reading(0, 1.5)],
        corrections: Vec::new(),
        path: "corrections.csv".into(),
        keep: KeepCorrections::by(move |corrections| {
            *to.lock().unwrap() = corrections.to_vec();
            Ok(())
        }),
    });
    collection.wave = Some(shown_wave());
    (Site::of(folder, collection), kept)
}

/// Six gaps that a pulse runs through, not measured here and there.
fn shown_wave() -> ShownWave {
    let times_s: Vec<f64> = (0..300).map(|i| 1e-5 * f64::from(i)).collect();
    let strain = |gap: i32| {
        let pulse =
            |i: i32| (i % 50 != 49).then(|| -0.02 * (-f64::from(i - 40 - 30 * gap).powi(2) / 200.0).exp());
        (0..300).map(pulse).collect()
    };
    let moved = |body: i32| (0..300).map(|i| Some(1e-5 * f64::from(i * body))).collect();
    ShownWave { times_s, strain: (0..6).map(strain).collect(), displacement_m: (0..7).map(moved).collect() }
}

fn assert_silent(browser: &Chromium) {
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
    let outside = |address: &&String| {
        !["http://127.0.0.1:", "blob:http://127.0.0.1:", "data:", "about:"]
            .iter()
            .any(|own| address.starts_with(own))
    };
    assert_eq!(browser.requests.iter().find(outside), None, "no request leaves the machine");
    assert!(!browser.requests.is_empty());
}

const NO_BROWSER: &str = "no headless browser is installed (chromium)";

#[test]
fn the_page_shows_a_recording_and_picks_subsets() {
    let Some(mut browser) = Chromium::start(1200, 800) else {
        chainwave_testkit::skip(NO_BROWSER);
        return;
    };
    let site = Site::start();
    browser.open(&site.address());
    browser.wait_for("document.getElementById('status').textContent === 'shot: 3 frames'");
    browser.wait_for("document.getElementById('time').textContent.includes('t = 0.0000 ms')");

    // The keys and the slider go through the frames.
    browser.press("ArrowRight");
    browser.wait_for("document.getElementById('time').textContent.includes('t = 1.0000 ms')");
    let slide = "(() => { const s = document.getElementById('frame-slider'); s.value = 2; s.dispatchEvent(new Event('input')); return true })()";
    browser.evaluate(slide);
    browser
        .wait_for("state.frame === 2 && document.getElementById('time').textContent.includes('2.0000 ms')");
    browser.wait_for("state.tracks.length === 1 && state.tracks[0].place_px[0] === 41.5");

    // A click with the second tool makes a subset where it is, which gets its sigma, and is written.
    browser.press("2");
    browser.evaluate(
        "(window.windowPlace = (at) => { const c = document.getElementById('canvas'); const b = c.getBoundingClientRect(); \
         const r = c.width / b.width; const [x, y] = toScreen(at); return [b.left + x / r, b.top + y / r] }, true)",
    );
    let place = browser.evaluate("windowPlace([100, 40])");
    let place = [0, 1].map(|axis: usize| place[axis].as_f64().unwrap());
    browser.click(place);
    browser.wait_for("state.subsets.length === 2 && Math.abs(state.subsets[1].x_px - 100) < 1");
    browser.wait_for("state.subsets[1].sigma !== undefined");
    browser.evaluate("(document.getElementById('write').click(), true)");
    browser.wait_for("document.getElementById('written').textContent.startsWith('wrote ')");
    let written = std::fs::read_to_string(site.folder.path().join("points.csv")).unwrap();
    assert_eq!(written.lines().count(), 3, "{written}");
    browser.picture("pick");
    assert_silent(&browser);

    // Three corners and enter make a subset of what lies within them; the table then has their places.
    browser.press("5");
    for corner in ["[60, 60]", "[90, 62]", "[75, 84]"] {
        let place = browser.evaluate(&format!("windowPlace({corner})"));
        browser.click([0, 1].map(|axis: usize| place[axis].as_f64().unwrap()));
    }
    browser.press("Enter");
    browser.wait_for("state.subsets.length === 3 && state.subsets[2].outline_px.length === 3");
    // 30 and 24 px, and what a click rounds.
    browser.wait_for("[15, 16].includes(state.subsets[2].half_width_px) && [12, 13].includes(state.subsets[2].half_height_px)");
    browser.wait_for("state.subsets[2].sigma !== undefined");
    browser.evaluate("(document.getElementById('overwrite').checked = true, document.getElementById('write').click(), true)");
    browser.wait_for("document.getElementById('written').textContent.includes('3 subsets')");
    let written = std::fs::read_to_string(site.folder.path().join("points.csv")).unwrap();
    assert!(written.starts_with("name,x_px,y_px,half_width_px,half_height_px,outline_px\n"), "{written}");
    let corners = written.lines().last().and_then(|row| row.rsplit(',').next()).unwrap();
    assert_eq!(corners.split_whitespace().count(), 6, "{written}");
    browser.picture("polygon");

    // Whoever has another token sees nothing.
    assert_eq!(site.raw("GET", "/?token=0", "Host: localhost\r\n", b"").status, 403);
}

#[test]
fn readings_are_reviewed_by_single_keys_and_the_cursor_links_the_wave_to_frames() {
    let Some(mut browser) = Chromium::start(1300, 900) else {
        chainwave_testkit::skip(NO_BROWSER);
        return;
    };
    let (site, kept) = results();
    browser.open(&site.address());
    browser.wait_for("document.querySelectorAll('#queue tr').length === 2");

    // r shows the reading, its subset, the reference and the residual.
    browser.press("r");
    browser.wait_for("state.frame === 2 && document.getElementById('part-residual').width === 21");
    browser.wait_for("document.getElementById('doubt').textContent.startsWith('1 of 2')");
    browser.picture("review");
    // x excludes the doubtful frames around it.
    browser.press("x");
    browser
        .wait_for("document.getElementById('review-said').textContent.startsWith('wrote corrections.csv')");
    {
        let kept = kept.lock().unwrap();
        let [one] = kept.as_slice() else { panic!("{kept:?}") };
        assert_eq!((one.first_frame, one.last_frame, one.place_px), (1, Some(2), None));
    }
    // s and a click seed it there.
    browser.press("s");
    let place = browser.evaluate(
        "(() => { const b = document.getElementById('canvas').getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2] })()",
    );
    browser.click([0, 1].map(|axis: usize| place[axis].as_f64().unwrap()));
    browser.wait_for("document.getElementById('review-said').textContent.includes('2 correction(s)')");
    {
        let kept = kept.lock().unwrap();
        let [x, y] = kept[1].place_px.unwrap();
        // The canvas shows the reading in its middle: the track is at (41.5, 45) there.
        assert!((x - 41.5).abs() < 1.0 && (y - 45.0).abs() < 1.0, "{x}, {y}");
        assert_eq!(kept[1].first_frame, 2);
    }
    browser.press("r");
    browser.wait_for("state.frame === 0");

    // A click into the map moves the frame, and a frame the cursor: three frames at 0, 1 and 2 ms.
    let place = browser.evaluate(
        "(() => { const b = document.getElementById('map').getBoundingClientRect(); return [b.left + b.width * 0.67, b.top + b.height * 0.55] })()",
    );
    browser.click([0, 1].map(|axis: usize| place[axis].as_f64().unwrap()));
    browser.wait_for("Math.abs(wave.data.times_s[wave.instant] - 0.002) < 5e-5 && state.frame === 2");
    browser.wait_for("document.getElementById('cursor').textContent.includes('gap 4')");
    browser.evaluate("toFrame(1)");
    browser.wait_for("Math.abs(wave.data.times_s[wave.instant] - 0.001) < 2e-5");
    browser.prefer_dark();
    browser.picture("wave-dark");
    assert_silent(&browser);
}

#[test]
fn the_map_stands_by_itself_in_a_file() {
    let Some(mut browser) = Chromium::start(900, 600) else {
        chainwave_testkit::skip(NO_BROWSER);
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("report.html");
    let page = format!("<!doctype html><meta charset=\"utf-8\"><body>{}</body>", shown_wave().as_section());
    std::fs::write(&path, page).unwrap();
    browser.open(&format!("file://{}", path.display()));
    // The cursor begins at the crest of a pulse, and goes where a key or a click sends it.
    browser.wait_for("document.getElementById('cursor').textContent.endsWith('strain -0.02')");
    browser.evaluate("(document.getElementById('map').focus(), true)");
    browser.evaluate("(toInstant(100, 2), true)");
    browser.press("ArrowRight");
    browser.press("ArrowDown");
    browser.wait_for("document.getElementById('cursor').textContent.startsWith('t = 1.010 ms, gap 4')");
    let place = browser.evaluate(
        "(() => { const b = document.getElementById('map').getBoundingClientRect(); return [b.left + b.width * 0.67, b.top + b.height * 0.08] })()",
    );
    browser.click([0, 1].map(|axis: usize| place[axis].as_f64().unwrap()));
    browser.wait_for("Math.abs(wave.data.times_s[wave.instant] - 0.002) < 5e-5 && wave.row === 0");
    browser.picture("map-in-a-file");
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
    let outside = |address: &&String| !address.starts_with("file://");
    assert_eq!(browser.requests.iter().find(outside), None, "the file needs nothing else");
}

#[test]
fn the_page_fits_a_narrow_screen() {
    let Some(mut browser) = Chromium::start(500, 900) else {
        chainwave_testkit::skip(NO_BROWSER);
        return;
    };
    let (site, _) = results();
    browser.open(&site.address());
    browser.wait_for("document.querySelectorAll('#queue tr').length === 2");
    browser.picture("narrow");
    assert_eq!(browser.evaluate("document.documentElement.scrollWidth <= window.innerWidth"), true);
    assert_silent(&browser);
}

#[test]
fn a_collection_without_results_has_no_review() {
    let site = Site::start();
    for path in ["/api/wave", "/api/review"] {
        assert_eq!(site.get(path).status, 404, "{path}");
    }
    assert_eq!(site.send("PUT", "/api/corrections", b"{\"version\": 0, \"corrections\": []}").status, 404);
    assert!(Collection::default().review.is_none());
}

#[test]
fn a_correction_that_cannot_be_meant_is_refused() {
    let (site, kept) = results();
    let put = |corrections: &str, version: u64| {
        let body = format!("{{\"version\": {version}, \"corrections\": [{corrections}]}}");
        site.send("PUT", "/api/corrections", body.as_bytes()).status
    };
    let exclude = |recording: i64, first: i64, last: i64| {
        format!(
            "{{\"recording\": {recording}, \"name\": \"body 1\", \"first_frame\": {first}, \"last_frame\": {last}, \"remedy\": \"exclude\", \"place_px\": null}}"
        )
    };
    for wrong in
        [exclude(0, 2, 1), exclude(0, 0, 3), exclude(7, 0, 1), exclude(-1, 0, 1), "{}".into(), "x".into()]
    {
        assert_eq!(put(&wrong, 0), 400, "{wrong}");
    }
    let seed = |place: &str| exclude(0, 0, 1).replace("exclude", "seed").replace("null", place);
    for wrong in ["null", "[-1, 5]", "[1e9, 5]", "[1]"] {
        assert_eq!(put(&seed(wrong), 0), 400, "{wrong}");
    }
    assert_eq!(put(&exclude(0, 0, 1), 3), 409);
    assert!(kept.lock().unwrap().is_empty());
    assert_eq!(put(&seed("[10.5, 20]"), 0), 200);
    assert_eq!(kept.lock().unwrap().len(), 1);
    for path in
        ["/api/subset/0?name=nobody", "/api/subset/0?name=body%201&part=soul", "/api/subset/9?name=body%201"]
    {
        assert!([400, 404].contains(&site.get(path).status), "{path}");
    }
    // Found where the reference is, nothing differs.
    let (size, greys) = site.get("/api/subset/0?name=body%201&part=residual").png();
    assert_eq!(size, [21, 21]);
    assert!(greys.iter().all(|grey| (127..=128).contains(grey)), "{greys:?}");
}
