//! Frames that could not be read while subsets were followed through them: tracks say where, and reading such a frame once more says why.

use chainwave_measurement::{Lost, Position, ReadError, Recording, Region};

/// What is to be said of the frames in which a reading was lost as they could not be read; none where there are none.
pub fn unreadable_frames<'a>(
    recording: &dyn Recording,
    tracks: impl Iterator<Item = &'a [Result<Position, Lost>]>,
) -> Option<String> {
    let unread = |positions: &'a [Result<Position, Lost>]| {
        let lost = positions.iter().enumerate().filter(|(_, found)| matches!(found, Err(Lost::Unreadable)));
        lost.map(|(frame, _)| frame)
    };
    let mut frames: Vec<usize> = tracks.flat_map(unread).collect();
    frames.sort_unstable();
    frames.dedup();
    let first = *frames.first()?;
    let n_frames = recording.info().n_frames;
    let why = read(recording, first).err().map_or("it can be read now".into(), |why| why.to_string());
    Some(match frames.len() {
        1 => format!("frame {first} of {n_frames} cannot be read: {why}"),
        n => format!("{n} of {n_frames} frames cannot be read, the first is frame {first}: {why}"),
    })
}

/// Reads the whole of a frame.
///
/// # Errors
/// Why it cannot be read.
fn read(recording: &dyn Recording, frame: usize) -> Result<(), ReadError> {
    let info = recording.info();
    let (width, height) = (info.width_px, info.height_px);
    let mut pixels = vec![0.0; width * height];
    recording.read_region(frame, Region { x: 0, y: 0, width, height }, &mut pixels)
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::{Estimate, RecordingInfo};

    use super::*;

    /// Eight frames that end where a file was torn.
    struct Torn(RecordingInfo);

    impl Recording for Torn {
        fn path(&self) -> &std::path::Path {
            "torn.tif".as_ref()
        }

        fn info(&self) -> &RecordingInfo {
            &self.0
        }

        fn read_region(&self, frame: usize, _: Region, _: &mut [f32]) -> Result<(), ReadError> {
            match frame {
                0..5 => Ok(()),
                _ => Err(ReadError::FrameOutside { path: "torn.tif".into(), frame, n_frames: 5 }),
            }
        }
    }

    #[test]
    fn frames_that_cannot_be_read_are_counted_with_the_reason_of_the_first() {
        let found = || Position {
            x_px: Estimate::new(10.0, 0.01),
            y_px: Estimate::new(10.0, 0.01),
            theta_rad: None,
            zncc: 0.99,
            iterations: 3,
        };
        let torn = Torn(RecordingInfo {
            format: "torn".into(),
            width_px: 4,
            height_px: 4,
            n_frames: 8,
            bit_depth: 8,
            rate_hz: None,
            times_s: Vec::new(),
            first_image: 0,
            camera: None,
            exposure_s: None,
            triggered_unix_s: None,
            warnings: Vec::new(),
        });
        let track = |until: usize| -> Vec<Result<Position, Lost>> {
            (0..8).map(|frame| if frame < until { Ok(found()) } else { Err(Lost::Unreadable) }).collect()
        };
        let said = |tracks: &[Vec<Result<Position, Lost>>]| {
            unreadable_frames(&torn, tracks.iter().map(Vec::as_slice))
        };
        assert_eq!(said(&[track(8)]), None);
        let three = said(&[track(5), track(6)]).unwrap();
        assert!(three.starts_with("3 of 8 frames cannot be read, the first is frame 5: torn.tif"), "{three}");
        assert!(said(&[track(7)]).unwrap().starts_with("frame 7 of 8 cannot be read: torn.tif"));
    }
}
