//! What following bodies reads from a disk that nothing of the recording was read from before, by the system's own count.

#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::Write;
use std::num::NonZero;
use std::ops::Range;
use std::path::Path;
use std::sync::Mutex;

use chainwave_camera::{OpenOptions, open_with};
use chainwave_correlation::{Method, ReferenceFrames};
use chainwave_experiment::{Monitor, follow};
use chainwave_measurement::{ReadError, Recording, RecordingInfo, Region, Subset};
use chainwave_testkit::skip;
use rustix::fs::{Advice, fadvise};

const SIDE_PX: usize = 1024;
const N_FRAMES: usize = 48;
const PAGE_BYTES: usize = 4096;

/// A recording without a header, of 8 bits, that notes the pages that are looked at.
struct Noting {
    recording: Box<dyn Recording>,
    pages: Mutex<BTreeSet<usize>>,
}

impl Recording for Noting {
    fn path(&self) -> &Path {
        self.recording.path()
    }

    fn info(&self) -> &RecordingInfo {
        self.recording.info()
    }

    fn will_read(&self, frames: Range<usize>, regions: &[Region]) {
        self.recording.will_read(frames, regions);
    }

    fn read_region(&self, frame: usize, region: Region, pixels: &mut [f32]) -> Result<(), ReadError> {
        let mut pages = self.pages.lock().unwrap();
        for row in region.y..region.y + region.height {
            let first = (frame * SIDE_PX + row) * SIDE_PX + region.x;
            pages.extend(first / PAGE_BYTES..=(first + region.width - 1) / PAGE_BYTES);
        }
        drop(pages);
        self.recording.read_region(frame, region, pixels)
    }
}

/// A texture in closed form that moves by 0.3 px a frame to the right and by 0.1 px down.
fn film(path: &Path) -> File {
    let mut file = File::create(path).unwrap();
    for frame in 0..N_FRAMES {
        let (dx, dy) = (0.3 * frame as f64, 0.1 * frame as f64);
        let waves =
            |at: f64, lengths: [f64; 3]| lengths.map(|length| (at / length).sin()).iter().sum::<f64>();
        let columns: Vec<f64> = (0..SIDE_PX).map(|x| waves(x as f64 - dx, [1.9, 3.1, 7.3])).collect();
        let rows: Vec<f64> = (0..SIDE_PX).map(|y| waves(y as f64 - dy, [2.3, 3.7, 6.1])).collect();
        let counts =
            rows.iter().flat_map(|row| columns.iter().map(move |column| (125.0 + 13.0 * row * column) as u8));
        file.write_all(&counts.collect::<Vec<u8>>()).unwrap();
    }
    file.sync_all().unwrap();
    file
}

/// Bytes that this process has had read from disks.
fn read_bytes() -> Option<u64> {
    let told = fs::read_to_string("/proc/self/io").ok()?;
    told.lines().find_map(|line| line.strip_prefix("read_bytes: "))?.trim().parse().ok()
}

#[test]
fn little_more_is_read_than_the_pages_that_are_looked_at() {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let path = folder.path().join("film.raw");
    let file = film(&path);
    let raw = Some(format!("{SIDE_PX}x{SIDE_PX}x8").parse().unwrap());
    let options = OpenOptions { raw, rate_hz: Some(1e4), ..OpenOptions::default() };
    let recording = Noting { recording: open_with(&path, &options).unwrap(), pages: Mutex::default() };
    let body = |name: &str, x_px: f64, y_px: f64| {
        let half = 16;
        Subset::new(name, x_px, y_px, half, half)
    };
    let bodies = [body("1", 300.0, 200.0), body("2", 700.0, 204.0), body("3", 500.0, 800.0)];
    fadvise(&file, 0, None, Advice::DontNeed).unwrap();
    let Some(before) = read_bytes() else { return skip("the system does not count what is read from disks") };
    let (reference, one) = (ReferenceFrames::Mean(0..8), NonZero::<usize>::MIN);
    let followed = follow(&recording, &bodies, &reference, Method::default(), one, &Monitor::SILENT).unwrap();
    let n_read = read_bytes().unwrap() - before;
    let is_followed = |track: &chainwave_measurement::Track| track.positions.iter().all(Result::is_ok);
    assert!(followed.tracks.iter().all(|one| is_followed(&one.track)));
    let n_looked_at = (recording.pages.lock().unwrap().len() * PAGE_BYTES) as u64;
    // Whether a file's pages can be dropped hangs on where the folder lies.
    if 2 * n_read < n_looked_at {
        return skip("the folder of temporary files does not lie on a disk whose reads are counted");
    }
    // The goal of targets.md; what is more are rows that bodies might have moved to.
    assert!(n_read as f64 <= 1.3 * n_looked_at as f64, "{n_read} of {n_looked_at} bytes");
    assert!((n_looked_at as usize) < SIDE_PX * SIDE_PX * N_FRAMES / 4, "the film shows little else");
}
