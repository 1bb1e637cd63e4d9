//! Dark frames and a flat field, from the files that hold them to recordings without what the sensor adds.

use std::path::Path;
use std::sync::Arc;

use chainwave_camera::{Corrected, OpenOptions, SensorCorrection, open_with};
use chainwave_measurement::Recording;

use crate::error::Error;
use crate::input::content::content;

/// A sensor's dark level, gains and defects, with what the files that tell them hold.
#[derive(Debug, Clone)]
pub struct SensorFiles {
    correction: Arc<SensorCorrection>,
    content: String,
}

impl SensorFiles {
    /// Reads dark frames and a flat field, each a recording, a folder of images or one of them; `None` where neither is named.
    ///
    /// # Errors
    /// A file that cannot be read, frames of different sizes or depths, and a flat field that is saturated or no brighter than the dark
    /// frames.
    pub fn read(
        dark: Option<&Path>,
        flat: Option<&Path>,
        options: &OpenOptions,
    ) -> Result<Option<Self>, Error> {
        let open = |path: Option<&Path>| path.map(|path| open_with(path, options)).transpose();
        let (dark_frames, flat_frames) = (open(dark)?, open(flat)?);
        let correction = match (&dark_frames, &flat_frames) {
            (_, Some(flat)) => SensorCorrection::from_flat(flat.as_ref(), dark_frames.as_deref())?,
            (Some(dark), None) => SensorCorrection::from_dark(dark.as_ref())?,
            (None, None) => return Ok(None),
        };
        let of_file = |path: Option<&Path>| path.map_or_else(|| Ok("none".to_owned()), content);
        let content = format!("dark frames {}; flat field {}", of_file(dark)?, of_file(flat)?);
        Ok(Some(Self { correction: Arc::new(correction), content }))
    }

    /// The recording without what the sensor adds, read region by region.
    ///
    /// # Errors
    /// A recording of another size or depth.
    pub fn correct(&self, recording: Box<dyn Recording>) -> Result<Box<dyn Recording>, Error> {
        Ok(Box::new(Corrected::new(recording, Arc::clone(&self.correction))?))
    }

    /// What the files hold, as a text.
    pub(crate) fn content(&self) -> &str {
        &self.content
    }
}

#[cfg(test)]
mod tests {
    use chainwave_measurement::Region;

    use super::*;

    /// A picture of 8 x 8 pixels, each a count of its own.
    fn picture(path: &Path, count: impl Fn(u8) -> u8) {
        let mut bytes = b"P5 8 8 255 ".to_vec();
        bytes.extend((0..64).map(count));
        std::fs::write(path, bytes).unwrap();
    }

    #[test]
    fn light_is_what_a_picture_has_above_the_dark_and_the_files_bytes_count() {
        let folder = tempfile::tempdir().unwrap();
        let [dark, other, scene] =
            ["dunkel-ä.pgm", "dark.pgm", "scene.pgm"].map(|name| folder.path().join(name));
        picture(&dark, |pixel| 10 + pixel % 3);
        picture(&other, |pixel| 11 + pixel % 3);
        picture(&scene, |pixel| 50 + pixel % 3);
        let options = OpenOptions::default();
        let read = |path: &Path| SensorFiles::read(Some(path), None, &options).unwrap().unwrap();
        let corrected = read(&dark).correct(open_with(&scene, &options).unwrap()).unwrap();
        let mut light = [0.0; 64];
        corrected.read_region(0, Region::whole(8, 8), &mut light).unwrap();
        assert!(light.iter().all(|count: &f32| (count - 40.0).abs() < 1e-6), "{light:?}");
        assert_ne!(read(&dark).content(), read(&other).content());
        assert!(SensorFiles::read(None, None, &options).unwrap().is_none());
        let missing = SensorFiles::read(Some(&folder.path().join("nowhere")), None, &options);
        assert!(missing.unwrap_err().to_string().contains("nowhere"));
    }
}
