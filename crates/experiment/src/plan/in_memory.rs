//! How much of a recording the system's memory holds, so that no disk need be waited for.

#[cfg(target_os = "linux")]
use std::collections::VecDeque;
use std::ops::Range;
use std::path::Path;
#[cfg(target_os = "linux")]
use std::path::PathBuf;

/// Places that are asked about: a share is known to some hundredths.
const N_PLACES: usize = 64;

/// The share of a part of a recording that memory holds, whose pixels lie between these shares of its bytes. All of it where the system does not say.
pub(super) fn share_in_memory(path: &Path, part: &Range<f64>) -> f64 {
    let place = |n: usize| part.start + (part.end - part.start) * (n as f64 + 0.5) / N_PLACES as f64;
    let answers = known(path, (0..N_PLACES).map(place)).unwrap_or_default();
    match answers.len() {
        0 => 1.0,
        n => answers.iter().filter(|is_there| **is_there).count() as f64 / n as f64,
    }
}

/// Whether memory holds the page at each place, which ascend.
#[cfg(target_os = "linux")]
fn known(path: &Path, places: impl Iterator<Item = f64>) -> Option<Vec<bool>> {
    let size = |file: PathBuf| Some((file.metadata().ok()?.len(), file));
    let mut files: VecDeque<(u64, PathBuf)> =
        chainwave_camera::files_of(path).ok()?.into_iter().map(size).collect::<Option<_>>()?;
    let n_bytes: u64 = files.iter().map(|(size, _)| size).sum();
    let mut before = 0;
    let is_in_memory = |place: f64| {
        let at = (place * n_bytes as f64) as u64;
        while at - before >= files.front()?.0 {
            before += files.pop_front()?.0;
        }
        page_is_in_memory(&files.front()?.1, at - before)
    };
    places.map(is_in_memory).collect()
}

#[cfg(not(target_os = "linux"))]
fn known(_: &Path, _: impl Iterator<Item = f64>) -> Option<Vec<bool>> {
    None
}

/// By a read that does not wait; `None` of a file system that knows no such read.
#[cfg(target_os = "linux")]
fn page_is_in_memory(path: &Path, at: u64) -> Option<bool> {
    use rustix::fs::{Advice, fadvise};
    use rustix::io::{Errno, ReadWriteFlags, preadv2};
    let file = std::fs::File::open(path).ok()?;
    // Else the system reads on behind the page that is asked for.
    fadvise(&file, 0, None, Advice::Random).ok()?;
    let mut byte = [0];
    match preadv2(&file, &mut [std::io::IoSliceMut::new(&mut byte)], at, ReadWriteFlags::NOWAIT) {
        Ok(_) => Some(true),
        Err(Errno::AGAIN) => Some(false),
        Err(_) => None,
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
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
