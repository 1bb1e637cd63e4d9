//! How much of a recording the system's memory holds, so that no disk need be waited for.

use std::ops::Range;
use std::path::Path;

/// Places that are asked about: a share is known to some hundredths.
const N_PLACES: usize = 64;

/// The share of a part of a recording that memory holds, whose pixels lie between these shares of its bytes, or of its files where it is a
/// folder. All of it where the system does not say.
pub(super) fn share_in_memory(path: &Path, part: &Range<f64>) -> f64 {
    let place = |n: usize| part.start + (part.end - part.start) * (n as f64 + 0.5) / N_PLACES as f64;
    let answers = known(path, (0..N_PLACES).map(place)).unwrap_or_default();
    match answers.len() {
        0 => 1.0,
        n => answers.iter().filter(|is_there| **is_there).count() as f64 / n as f64,
    }
}

/// Whether memory holds the page at each place.
#[cfg(target_os = "linux")]
fn known(path: &Path, places: impl Iterator<Item = f64>) -> Option<Vec<bool>> {
    if !path.is_dir() {
        let file = Pages::of(path)?;
        return places.map(|place| file.is_in_memory(place)).collect();
    }
    let mut files: Vec<_> = path.read_dir().ok()?.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.sort_unstable();
    let file_at = |place: f64| files.get((place * files.len() as f64) as usize);
    places.map(|place| Pages::of(file_at(place)?)?.is_in_memory(0.5)).collect()
}

#[cfg(not(target_os = "linux"))]
fn known(_: &Path, _: impl Iterator<Item = f64>) -> Option<Vec<bool>> {
    None
}

/// A file whose pages are asked for.
#[cfg(target_os = "linux")]
struct Pages {
    file: std::fs::File,
    n_bytes: u64,
}

#[cfg(target_os = "linux")]
impl Pages {
    fn of(path: &Path) -> Option<Self> {
        let file = std::fs::File::open(path).ok()?;
        let n_bytes = file.metadata().ok().filter(|about| about.is_file() && about.len() > 0)?.len();
        // Else the system reads on behind each page that is asked for.
        rustix::fs::fadvise(&file, 0, None, rustix::fs::Advice::Random).ok()?;
        Some(Self { file, n_bytes })
    }

    /// By a read that does not wait; `None` of a file system that knows no such read.
    fn is_in_memory(&self, place: f64) -> Option<bool> {
        use rustix::io::{Errno, ReadWriteFlags, preadv2};
        let at = ((place * self.n_bytes as f64) as u64).min(self.n_bytes - 1);
        let mut byte = [0];
        let mut into = [std::io::IoSliceMut::new(&mut byte)];
        match preadv2(&self.file, &mut into, at, ReadWriteFlags::NOWAIT) {
            Ok(_) => Some(true),
            Err(Errno::AGAIN) => Some(false),
            Err(_) => None,
        }
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

    use super::*;
    use rustix::fs::{Advice, fadvise};

    #[test]
    fn what_the_system_has_dropped_is_not_in_memory() {
        // Beside the test program: a file system in memory drops nothing.
        let program = std::env::current_exe().unwrap();
        let folder = tempfile::tempdir_in(program.parent().unwrap()).unwrap();
        let path = folder.path().join("film");
        std::fs::write(&path, vec![1; 1 << 22]).unwrap();
        let file = std::fs::File::open(&path).unwrap();
        file.sync_all().unwrap();
        let share = |part: Range<f64>| share_in_memory(&path, &part);
        assert!(share(0.0..1.0) > 0.99);
        fadvise(&file, 1 << 21, None, Advice::DontNeed).unwrap();
        let (first, second, whole) = (share(0.0..0.5), share(0.5..1.0), share(0.0..1.0));
        if second > 0.99 {
            chainwave_testkit::skip("the file system drops no pages of a file when it is asked to");
            return;
        }
        assert!(first > 0.99, "{first}");
        // Each half of the whole has half as many places as it has by itself.
        assert!((whole - 0.5 * (first + second)).abs() <= 1.0 / N_PLACES as f64, "{whole} {second}");
    }

    #[test]
    fn a_recording_that_is_not_there_waits_for_no_disk() {
        assert!(share_in_memory(Path::new("/no/such/film"), &(0.0..1.0)) > 0.99);
    }
}
