//! From pictures to the chain: `CALIBRATION.toml`, and the calibration that an experiment names.

use std::path::Path;

use chainwave_analysis::Spacing;
use chainwave_camera::{Calibration, Lens, MapError, Mark, PlaneMap, Source};
use chainwave_measurement::{Estimate, Recording, RecordingInfo};
use serde::{Deserialize, Serialize};

use crate::configuration::{Camera, Chain, Experiment, Marks, middle_px};
use crate::error::Error;
use crate::input::numbers::{NotNegative, Positive};
use crate::input::text_file::read_toml;

/// What `chainwave calibrate` writes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CalibrationFile {
    /// Columns of the pictures.
    pub width_px: usize,
    /// Rows of the pictures.
    pub height_px: usize,
    /// Pictures that were used.
    pub n_pictures: usize,
    /// Corners in them.
    pub n_corners: usize,
    /// Standard deviation of a corner from where the map has it.
    pub residual_px: f64,
    /// Scale in the middle of the picture.
    pub m_per_px: f64,
    /// Its standard uncertainty.
    pub m_per_px_sigma: f64,
    /// Standard uncertainty of k1.
    pub k1_sigma: f64,
    /// Standard uncertainty of k2.
    pub k2_sigma: f64,
    /// Lens and perspective.
    pub map: MapTable,
    /// The map with each of its independent errors of one standard deviation.
    pub errors: Vec<ErrorTable>,
}

/// A map from the picture to the plane of the chain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapTable {
    centre_px: [f64; 2],
    focal_px: f64,
    k1: f64,
    k2: f64,
    plane_from_image: [[f64; 3]; 3],
}

/// A map with an error of one standard deviation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ErrorTable {
    source: SourceName,
    map: MapTable,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum SourceName {
    Length,
    Points,
}

impl CalibrationFile {
    /// The file of a calibration by `n_corners` corners in `n_pictures` pictures.
    pub fn new(
        calibration: &Calibration,
        (width_px, height_px): (usize, usize),
        (n_pictures, n_corners): (usize, usize),
    ) -> Self {
        let scale = calibration.m_per_px(middle_px(width_px, height_px));
        let sigma = |value: fn(&PlaneMap) -> f64| {
            let nominal = value(&calibration.map);
            let squares = calibration.errors.iter().map(|error| (value(&error.map) - nominal).powi(2));
            squares.sum::<f64>().sqrt()
        };
        let error = |error: &MapError| ErrorTable {
            source: match error.source {
                Source::Length => SourceName::Length,
                Source::Points => SourceName::Points,
            },
            map: MapTable::of(&error.map),
        };
        Self {
            width_px,
            height_px,
            n_pictures,
            n_corners,
            residual_px: calibration.residual_px,
            m_per_px: scale.value,
            m_per_px_sigma: scale.sigma,
            k1_sigma: sigma(|map| map.lens.k1),
            k2_sigma: sigma(|map| map.lens.k2),
            map: MapTable::of(&calibration.map),
            errors: calibration.errors.iter().map(error).collect(),
        }
    }

    fn read(path: &Path) -> Result<Self, Error> {
        let wrong = |message: String| Error::Configuration { path: path.to_owned(), message };
        let file: Self = read_toml(path)?;
        let maps = std::iter::once(&file.map).chain(file.errors.iter().map(|error| &error.map));
        for map in maps {
            map.plane_map().check(file.width_px, file.height_px).map_err(|error| wrong(error.to_string()))?;
        }
        Ok(file)
    }

    fn calibration(&self) -> Calibration {
        let error = |error: &ErrorTable| MapError {
            source: match error.source {
                SourceName::Length => Source::Length,
                SourceName::Points => Source::Points,
            },
            map: error.map.plane_map(),
        };
        Calibration {
            map: self.map.plane_map(),
            errors: self.errors.iter().map(error).collect(),
            residual_px: self.residual_px,
        }
    }
}

impl MapTable {
    fn of(map: &PlaneMap) -> Self {
        let Lens { centre_px, focal_px, k1, k2 } = map.lens;
        Self { centre_px, focal_px, k1, k2, plane_from_image: map.plane_from_image }
    }

    fn plane_map(&self) -> PlaneMap {
        let lens = Lens { centre_px: self.centre_px, focal_px: self.focal_px, k1: self.k1, k2: self.k2 };
        PlaneMap { lens, plane_from_image: self.plane_from_image }
    }
}

/// Where an experiment's bodies are, from pixels to metres and back.
#[derive(Clone)]
pub struct ChainMap {
    /// From the picture to the plane of the chain.
    pub of_chain: Calibration,
    /// Whether its length is the chain's pitch, so that an error of the pitch cancels in the strain.
    pub rests_on_pitch: bool,
    /// Size of the pictures that it holds for, where that matters.
    size_px: Option<(usize, usize)>,
    spacing: Spacing,
    first_body_px: [f64; 2],
}

impl ChainMap {
    /// The calibration that an experiment names; `experiment_path` is where the experiment lies.
    pub fn read(experiment: &Experiment, experiment_path: &Path) -> Result<Self, Error> {
        let camera = &experiment.camera;
        let ways = [
            camera.scale_px_per_m.is_some(),
            camera.ruler.is_some(),
            camera.marks.is_some(),
            camera.calibration.is_some(),
        ];
        let wrong = |message: String| Error::Configuration { path: experiment_path.to_owned(), message };
        let n_ways = ways.iter().filter(|way| **way).count();
        if n_ways != 1 {
            return Err(wrong(format!(
                "camera: expected exactly one of scale_px_per_m, ruler, marks and calibration, found {n_ways}"
            )));
        }
        if camera.marks.is_some() && experiment.is_released() {
            return Err(wrong(
                "camera.marks: expected another measure of the scale for a chain that is let go, whose bodies are no pitch apart before".into(),
            ));
        }
        if let Some(Marks { bodies, at_px, .. }) = &camera.marks
            && bodies.len() != at_px.len()
        {
            let (expected, found) = (bodies.len(), at_px.len());
            return Err(wrong(format!(
                "camera.marks.at_px: expected a point of each of the {expected} bodies, found {found}"
            )));
        }
        let spacing = experiment.spacing_at_rest()?;
        let file = camera.calibration.as_ref().map(|name| experiment_path.with_file_name(name));
        let file = file.as_deref().map(CalibrationFile::read).transpose()?;
        let of_chain = match &file {
            Some(file) => file.calibration(),
            None => stated(camera, &experiment.chain, &spacing)
                .map_err(|error| wrong(format!("camera: {error}")))?,
        };
        Ok(Self {
            of_chain,
            rests_on_pitch: camera.marks.is_some(),
            size_px: file.map(|file| (file.width_px, file.height_px)),
            spacing,
            first_body_px: camera.first_body_px,
        })
    }

    /// The map of a view whose pictures of `info` are larger by a factor about their middle.
    #[must_use]
    pub(crate) fn magnified(&self, factor: f64, info: &RecordingInfo) -> Self {
        let about_px = middle_px(info.width_px, info.height_px);
        let larger = |map: &PlaneMap| map.magnified(factor, about_px);
        let error = |error: &MapError| MapError { map: larger(&error.map), ..error.clone() };
        let [x, y] = self.first_body_px;
        let of_chain = Calibration {
            map: larger(&self.of_chain.map),
            errors: self.of_chain.errors.iter().map(error).collect(),
            ..self.of_chain.clone()
        };
        let first_body_px =
            [about_px[0] + factor * (x - about_px[0]), about_px[1] + factor * (y - about_px[1])];
        Self { of_chain, first_body_px, ..self.clone() }
    }

    /// How far from the middle of a picture of a size stands what is seen so far from it by the scale there, in metres.
    pub(crate) fn place_from_middle_m(&self, seen_m: f64, (width_px, height_px): (usize, usize)) -> f64 {
        let [x_px, y_px] = middle_px(width_px, height_px);
        let m_per_px = self.of_chain.m_per_px([x_px, y_px]).value;
        let at_m = |x_px: f64| self.of_chain.map.position_m([x_px, y_px])[0];
        at_m(x_px + self.side() * seen_m / m_per_px) - at_m(x_px)
    }

    /// Whether it has a lens or a perspective of its own, as a board tells them.
    pub(crate) fn has_geometry(&self) -> bool {
        let PlaneMap { lens, plane_from_image: [_, _, [h_x, h_y, _]] } = self.of_chain.map;
        [lens.k1, lens.k2, h_x, h_y].iter().any(|value| *value != 0.0)
    }

    /// The same bodies by another map.
    #[must_use]
    pub(crate) fn by(&self, of_chain: Calibration) -> Self {
        Self { of_chain, ..self.clone() }
    }

    /// Refuses a recording of another size than the pictures of the calibration, whose lens then lies elsewhere.
    pub fn check_size(&self, recording: &dyn Recording) -> Result<(), Error> {
        let info = recording.info();
        match self.size_px {
            Some((width, height)) if (width, height) != (info.width_px, info.height_px) => {
                Err(Error::Configuration {
                    path: recording.path().to_owned(),
                    message: format!(
                        "expected {width} x {height} px, as the calibration's pictures, found {} x {} (hint: film the \
                         board with the recordings' own window of the sensor)",
                        info.width_px, info.height_px
                    ),
                })
            }
            _ => Ok(()),
        }
    }

    /// Metres for a pixel along the chain, whichever way it goes: in the middle of the picture, or at the first body where the size does not
    /// matter.
    pub fn m_per_px(&self) -> Estimate {
        let middle = self.size_px.map(|(width_px, height_px)| middle_px(width_px, height_px));
        self.of_chain.m_per_px(middle.unwrap_or(self.first_body_px))
    }

    /// How long a picture is in the direction of the chain, in pixels.
    pub(crate) fn length_px(&self, width_px: usize, height_px: usize) -> f64 {
        let [[by_column, by_row], _] = self.of_chain.map.m_per_px(self.first_body_px);
        let m_per_px = self.of_chain.m_per_px(self.first_body_px).value;
        let until_edge = |size: usize, part: f64| size as f64 * m_per_px / part.abs();
        until_edge(width_px, by_column).min(until_edge(height_px, by_row))
    }

    /// Whether the chain goes to the left in the pictures: `camera.marks` can say so.
    pub(crate) fn goes_left(&self) -> bool {
        let next_px = self.rest_px(2, 0.0);
        next_px.is_some_and(|[x_px, _]| x_px < self.first_body_px[0])
    }

    /// 1 where the chain goes to the right in the pictures, -1 where it goes to the left.
    pub(crate) fn side(&self) -> f64 {
        if self.goes_left() { -1.0 } else { 1.0 }
    }

    /// Column and row of a body's marker at rest, in pixels; bodies are numbered from 1, and 0 lies a pitch before them. `None` far
    /// outside the picture.
    pub fn rest_px(&self, body: i64, stage_m: f64) -> Option<[f64; 2]> {
        let [x_m, y_m] = self.of_chain.map.position_m(self.first_body_px);
        let along_m = self.spacing.of_body_m(body) - stage_m;
        self.of_chain.map.image_px([x_m + along_m, y_m])
    }
}

/// The calibration that stands in the experiment itself.
fn stated(
    camera: &Camera,
    chain: &Chain,
    spacing: &Spacing,
) -> Result<Calibration, chainwave_camera::CameraError> {
    let sigma = |sigma: Option<NotNegative>| sigma.map_or(0.0, NotNegative::get);
    if let Some(ruler) = &camera.ruler {
        let length_m = Estimate::new(ruler.length_m.get(), ruler.length_sigma_m.get());
        return Calibration::from_ruler(ruler.ends_px, ruler.sigma_px.get(), length_m);
    }
    if let Some(marks) = &camera.marks {
        let pitch_m = Estimate::new(chain.mean_pitch_m(), sigma(chain.pitch_sigma_m));
        // Neighbours may be apart by more or less than the mean pitch.
        let place = |body: i32| spacing.of_body_m(body.into()) / pitch_m.value;
        let seen = marks.bodies.iter().zip(&marks.at_px);
        let points: Vec<Mark> =
            seen.map(|(body, [x_px, y_px])| Mark { place: place(*body), x_px: *x_px, y_px: *y_px }).collect();
        return Calibration::from_pitch(&points, marks.sigma_px.get(), pitch_m);
    }
    let px_per_m = camera.scale_px_per_m.map_or(f64::NAN, Positive::get);
    let relative = sigma(camera.scale_sigma_px_per_m) / px_per_m;
    Calibration::from_scale(Estimate::new(px_per_m.recip(), relative / px_per_m))
}
