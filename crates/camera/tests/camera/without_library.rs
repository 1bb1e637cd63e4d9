//! What takes a library, in a process that has brought none.

use chainwave_camera::{CameraError, OpenOptions, find_corners, needs_opencv, open};
use chainwave_measurement::MemoryRecording;

use crate::board_truth::board;
use crate::writer::{CineFile, written};

#[test]
fn videos_and_boards_name_what_they_take() {
    let (_folder, path) = written(b"RIFF\x40\0\0\0AVI LIST and what follows");
    assert!(matches!(open(&path), Err(CameraError::NeedsOpenCv { path: named, .. }) if named == path));
    let told = open(&path).err().unwrap().to_string();
    assert!(told.contains("-p chainwave-opencv") && told.contains("ffmpeg -i FILM"), "{told}");
    let picture = MemoryRecording::new(64, 8, vec![vec![0.0; 64 * 64]]);
    assert!(matches!(find_corners(&picture, 0, &board()), Err(CameraError::NeedsOpenCv { .. })));
}

#[test]
fn only_videos_are_said_to_take_it() {
    let (_folder, video) = written(b"\0\0\0\x18ftypisom and what follows");
    let plain = OpenOptions::default();
    assert!(needs_opencv(&video, &plain));
    // Read as bare pixels, its first bytes say nothing.
    assert!(!needs_opencv(&video, &OpenOptions { raw: "4x4x8le".parse().ok(), ..OpenOptions::default() }));
    let (folder, recording) = CineFile::default().write();
    for other in [recording, folder.path().to_owned(), folder.path().join("nowhere.avi")] {
        assert!(!needs_opencv(&other, &plain), "{}", other.display());
    }
}
