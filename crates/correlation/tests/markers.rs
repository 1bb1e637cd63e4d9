//! Markers proposed in pictures of the synthetic camera, against where its bodies are.

#![cfg(test)]

use chainwave_correlation::{CorrelationError, MarkerRow, NoMarkers, ReferenceFrames, propose_markers};
use chainwave_measurement::{MemoryRecording, Trajectory};
use chainwave_synthetic::pictures::{Deformation, Surface, Texture, counts, picture};
use chainwave_synthetic::{
    Camera, Cover, Effects, Marker, Optics, Packing, Ring, Rods, Scene, Sensor, Shot, Specimen, Tones,
};
use ndarray::Array2;

const SCALE_PX_PER_M: f64 = 5000.0;
const N_BODIES: usize = 12;

/// A row of bodies at rest, as it is filmed.
struct Stage {
    size_px: [usize; 2],
    first_px: [f64; 2],
    pitch_px: f64,
    marker_half_px: f64,
    roll_rad: f64,
    noise_counts: f64,
    tones: Tones,
    rods: bool,
    /// Light on the left over light on the right.
    light: [f64; 2],
    covered: Option<usize>,
    n_frames: usize,
    seed: u64,
}

impl Default for Stage {
    /// The demo's first view.
    fn default() -> Self {
        Self {
            size_px: [928, 96],
            first_px: [60.0, 47.5],
            pitch_px: 150.0,
            marker_half_px: 27.5,
            roll_rad: 0.0,
            noise_counts: 12.0,
            tones: Tones::default(),
            rods: true,
            light: [1.0, 1.0],
            covered: None,
            n_frames: 2,
            seed: 26,
        }
    }
}

impl Stage {
    fn camera(&self) -> Camera {
        Camera {
            width_px: self.size_px[0],
            height_px: self.size_px[1],
            rate_hz: 25_000.0,
            exposure_s: 5e-6,
            blur: false,
            packing: Packing::Bits16,
            scale_px_per_m: SCALE_PX_PER_M,
            sensor: Sensor {
                bit_depth: 12,
                black_level: 64.0,
                read_noise_counts: self.noise_counts,
                counts_per_electron: 0.2,
            },
            optics: (self.roll_rad != 0.0).then_some(Optics {
                focal_length_px: 1.0e4,
                principal_point_px: None,
                k1: 0.0,
                k2: 0.0,
                p1: 0.0,
                p2: 0.0,
                roll_rad: self.roll_rad,
                yaw_rad: 0.0,
                pitch_rad: 0.0,
            }),
            lighting: None,
            effects: Effects::default(),
        }
    }

    /// The recording, and where its bodies are.
    fn film(&self) -> (MemoryRecording, Vec<[f64; 2]>) {
        let metres = |px: f64| px / SCALE_PX_PER_M;
        let camera = self.camera();
        let below_axis_m = if self.rods { vec![-7e-3, 7e-3] } else { Vec::new() };
        let specimen = Specimen {
            n_bodies: N_BODIES,
            pitch_m: metres(self.pitch_px),
            gaps_m: Vec::new(),
            ring: Ring { semi_major_m: metres(0.5 * self.pitch_px), semi_minor_m: 9e-3, wall_m: 0.4e-3 },
            marker: Marker {
                half_width_m: metres(self.marker_half_px),
                half_height_m: metres(self.marker_half_px),
                speckle_diameter_px: 4.5,
                seed: self.seed,
            },
            rods: Rods { diameter_m: 2.38e-3, below_axis_m },
            tones: self.tones.clone(),
        };
        let covers = self.covered.map(|body| Cover { body, from_s: -1.0, until_s: 1.0 });
        let shot = Shot {
            stage_m: 0.0,
            first_body_px: self.first_px,
            first_image: -100,
            n_frames: self.n_frames,
            trigger_delay_s: 0.0,
            frame_phase_s: 0.0,
            noise_seed: self.seed,
            view: 1,
            covers: covers.into_iter().collect(),
        };
        let still = || Array2::zeros((N_BODIES, 2));
        let motion =
            Trajectory { times_s: vec![-1.0, 1.0], displacement_m: still(), velocity_m_per_s: still() };
        let scene = Scene::new(&camera, &specimen, &shot, &motion).unwrap();
        let places = scene.body_centres_px(0).unwrap();
        let width = self.size_px[0] as f64;
        let lit = |(i, count): (usize, f64)| {
            let along = (i % self.size_px[0]) as f64 / width;
            (count * (self.light[0] * (1.0 - along) + self.light[1] * along)).round() as f32
        };
        let frames = (0..self.n_frames)
            .map(|frame| {
                scene
                    .recorded_counts(frame)
                    .unwrap()
                    .iter()
                    .map(|&count| f64::from(count))
                    .enumerate()
                    .map(lit)
                    .collect()
            })
            .collect();
        (MemoryRecording::new(self.size_px[0], 12, frames), places)
    }

    /// The bodies whose markers are wholly in view, and not hidden.
    fn seen(&self, places: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let reach = self.marker_half_px * (self.roll_rad.sin().abs() + self.roll_rad.cos().abs());
        let is_seen = |(i, place): &(usize, &[f64; 2])| {
            let inside = |axis: usize| {
                place[axis] - reach > 0.0 && place[axis] + reach < self.size_px[axis] as f64 - 1.0
            };
            inside(0) && inside(1) && self.covered != Some(i + 1)
        };
        places.iter().enumerate().filter(is_seen).map(|(_, place)| *place).collect()
    }

    /// Holds the proposal of this stage against its bodies.
    fn check(&self, name: &str) -> MarkerRow {
        let (recording, places) = self.film();
        let rest = match self.n_frames {
            1 => ReferenceFrames::Single(0),
            n => ReferenceFrames::Mean(0..n),
        };
        let row = propose_markers(&recording, &rest).unwrap_or_else(|error| panic!("{name}: {error}"));
        let seen = self.seen(&places);
        let found: Vec<[f64; 2]> =
            row.markers.iter().map(|marker| [marker.subset.x_px, marker.subset.y_px]).collect();
        assert_eq!(found.len(), seen.len(), "{name}: {found:?}, expected {seen:?}");
        for (marker, place) in row.markers.iter().zip(&seen) {
            let off = (marker.subset.x_px - place[0]).hypot(marker.subset.y_px - place[1]);
            // An outline is where averages over 11 px halve: known to a third of them.
            assert!(off < 3.7, "{name}: {marker:?} is {off} px from {place:?}");
            let half = marker.subset.half_width_px.max(marker.subset.half_height_px) as f64;
            let on_marker = off + half
                <= self.marker_half_px / (self.roll_rad.sin().abs() + self.roll_rad.cos().abs()) + 1.0;
            assert!(self.roll_rad.sin() * self.roll_rad.cos() != 0.0 || on_marker, "{name}: {marker:?}");
            assert!(half >= 0.5 * self.marker_half_px, "{name}: most of the marker is used: {marker:?}");
            let sigma = marker.sigma_px.unwrap();
            assert!(sigma.iter().all(|sigma| (1e-4..0.1).contains(sigma)), "{name}: {sigma:?}");
        }
        if let Some(pitch) = row.pitch_px.filter(|_| seen.len() > 2) {
            assert!((pitch.value - self.pitch_px).abs() < 4.0 * pitch.sigma.max(0.1), "{name}: {pitch:?}");
        }
        row
    }
}

#[test]
fn the_demo_s_view_is_found() {
    let row = Stage::default().check("demo");
    assert_eq!(row.markers.len(), 6);
    let names: Vec<&str> = row.markers.iter().map(|marker| marker.subset.name.as_str()).collect();
    assert_eq!(names, ["1", "2", "3", "4", "5", "6"], "numbered from the left");
    let [x, y] = row.direction.unwrap();
    // 3.7 px at one end of 750.
    assert!(x > 0.99 && y.abs() < 0.006);
    assert!(row.missing_px.is_empty());
    // Read noise of 12 counts, and shot noise of 0.2 counts a count of light, some 1000 on average: 12 to 25.
    assert!((12.0..25.0).contains(&row.noise_counts), "{}", row.noise_counts);
}

#[test]
fn other_pitches_sizes_and_seeds_are_found() {
    for (seed, pitch_px, marker_half_px) in
        [(1, 90.0, 20.0), (2, 140.0, 40.0), (3, 210.0, 15.0), (4, 90.0, 24.0), (5, 210.0, 70.0)]
    {
        let size_px = [928, (2.0 * marker_half_px) as usize + 40];
        // The rods, 35 px from the axis, would hide parts of larger markers.
        let first_px = [60.0, 0.5 * size_px[1] as f64];
        Stage {
            pitch_px,
            marker_half_px,
            size_px,
            first_px,
            seed,
            rods: marker_half_px < 28.0,
            ..Stage::default()
        }
        .check(&format!("pitch {pitch_px}"));
    }
}

#[test]
fn noise_hides_none() {
    // 3 and 6 % of full scale, of speckles of 13 % rms.
    for (noise_counts, n_frames) in [(120.0, 1), (120.0, 8), (240.0, 8)] {
        let row = Stage { noise_counts, n_frames, ..Stage::default() }
            .check(&format!("noise {noise_counts}, {n_frames} frames"));
        if n_frames > 1 {
            let off = (row.noise_counts / noise_counts - 1.0).abs();
            assert!(off < 0.1, "{}: shot noise adds up to a hundredth", row.noise_counts);
        }
    }
}

#[test]
fn rows_on_black_and_on_grey_under_uneven_light_are_found() {
    let black = Tones { backdrop: 0.0, blot: 0.0, ring: 0.0, ..Tones::default() };
    Stage { tones: black, rods: false, ..Stage::default() }.check("black");
    let grey = Tones { backdrop: 0.45, ..Tones::default() };
    for light in [[1.0, 0.35], [0.5, 1.0]] {
        Stage { tones: grey.clone(), light, ..Stage::default() }.check("grey");
        Stage { light, ..Stage::default() }.check("uneven light");
    }
}

#[test]
fn turned_rows_are_found() {
    for roll_rad in [0.05, -0.12, 0.3] {
        let row = Stage { roll_rad, size_px: [900, 420], first_px: [80.0, 209.5], ..Stage::default() }
            .check("turned");
        let [x, y] = row.direction.unwrap();
        assert!((y.atan2(x) - roll_rad).abs() < 0.01, "{x} {y}");
    }
    let (lying, places) = Stage::default().film();
    let [width, height] = [lying.info.width_px, lying.info.height_px];
    let turned =
        |frame: &Vec<f32>| (0..width * height).map(|i| frame[i % height * width + i / height]).collect();
    let upright = MemoryRecording::new(height, 12, lying.frames.iter().map(turned).collect());
    let row = propose_markers(&upright, &ReferenceFrames::Mean(0..2)).unwrap();
    assert!(row.direction.unwrap()[1] > 0.99);
    for (marker, place) in row.markers.iter().zip(&places) {
        assert!((marker.subset.y_px - place[0]).abs() < 3.7, "numbered from the top: {marker:?}");
    }
}

#[test]
fn a_missing_body_leaves_its_place() {
    let stage = Stage { covered: Some(3), ..Stage::default() };
    let row = stage.check("covered");
    assert_eq!(row.missing_px.len(), 1, "{:?}", row.missing_px);
    let [x, y] = row.missing_px[0];
    assert!((x - 360.0).abs() < 3.7 && (y - 47.5).abs() < 3.7, "{x}, {y}");
}

#[test]
fn one_body_is_a_row_without_a_pitch() {
    let row = Stage { size_px: [160, 96], first_px: [80.0, 47.5], ..Stage::default() }.check("one body");
    assert_eq!((row.markers.len(), row.pitch_px, row.direction), (1, None, None));
    let two = Stage { size_px: [310, 96], first_px: [80.0, 47.5], ..Stage::default() }.check("two bodies");
    let pitch = two.pitch_px.unwrap();
    assert!((pitch.value - 150.0).abs() < 3.0 * pitch.sigma, "{pitch:?}");
}

#[test]
fn a_marker_whose_outline_is_unlike_the_others_is_found_where_the_row_goes_on() {
    // Paint on the left third of the last marker that is wholly in view, of the first one, and of one between.
    for painted in [0, 2, 5] {
        let stage = Stage { noise_counts: 6.0, ..Stage::default() };
        let (mut recording, places) = stage.film();
        let [x_px, _] = places[painted];
        let columns = (x_px - 30.0).max(0.0) as usize..(x_px - 7.0) as usize;
        for frame in &mut recording.frames {
            for row in frame.chunks_exact_mut(stage.size_px[0]) {
                row[columns.clone()].fill(1500.0);
            }
        }
        let row = propose_markers(&recording, &ReferenceFrames::Mean(0..2)).unwrap();
        let found: Vec<f64> = row.markers.iter().map(|marker| marker.subset.x_px).collect();
        let seen = stage.seen(&places);
        assert_eq!(found.len(), seen.len(), "{painted}: {found:?}");
        // Its own outline would lie 11 px to the right.
        assert!(found.iter().zip(&seen).all(|(x_px, place)| (x_px - place[0]).abs() < 4.0), "{found:?}");
        assert!(row.missing_px.is_empty());
    }
}

#[test]
fn a_row_of_which_every_second_marker_has_an_outline_of_its_own_keeps_its_pitch() {
    let stage = Stage { noise_counts: 6.0, ..Stage::default() };
    let (mut recording, places) = stage.film();
    for painted in [1, 3, 5] {
        let [x_px, _] = places[painted];
        for row in recording.frames.iter_mut().flat_map(|frame| frame.chunks_exact_mut(stage.size_px[0])) {
            row[(x_px - 30.0) as usize..(x_px - 7.0) as usize].fill(1500.0);
        }
    }
    let row = propose_markers(&recording, &ReferenceFrames::Mean(0..2)).unwrap();
    let pitch_px = row.pitch_px.unwrap();
    // The whole ones alone are a row, too, of twice the pitch.
    assert!((pitch_px.value - stage.pitch_px).abs() < 4.0 * pitch_px.sigma, "{pitch_px:?}");
    assert_eq!(row.markers.len(), stage.seen(&places).len());
}

#[test]
fn what_has_no_markers_says_why() {
    let why = |recording: &MemoryRecording| match propose_markers(recording, &ReferenceFrames::Mean(0..2)) {
        Err(CorrelationError::NoMarkers { reason, .. }) => reason,
        other => panic!("{other:?}"),
    };
    let grey = Array2::from_elem((200, 300), 0.4);
    let shade = Array2::from_shape_fn((200, 300), |(row, column)| 0.2 + 1e-3 * (row + column) as f64);
    let line = Array2::from_shape_fn((200, 300), |(row, _)| if row < 90 { 0.2 } else { 0.7 });
    let texture = Texture::speckles(1, 4.5, [150.0, 100.0], [170.0, 120.0]);
    let speckled = picture([300, 200], &[Surface::everywhere(texture, Deformation::NONE)]).unwrap();
    let cases = [
        ("grey", &grey, 0.02, NoMarkers::NoTexture),
        ("without noise", &grey, 0.0, NoMarkers::NoTexture),
        ("a shade", &shade, 0.01, NoMarkers::NoTexture),
        ("an edge", &line, 0.01, NoMarkers::NoTexture),
        ("speckles all over", &speckled, 0.01, NoMarkers::Everywhere),
    ];
    for (name, tones, noise, expected) in cases {
        let frames =
            [0, 1].map(|number| counts(tones, 12, noise, 7, number).unwrap().into_iter().collect()).into();
        assert_eq!(why(&MemoryRecording::new(300, 12, frames)), expected, "{name}");
    }
}

#[test]
fn bodies_without_speckles_are_no_markers() {
    let stage = Stage { tones: Tones { speckle_depth: 0.0, ..Tones::default() }, ..Stage::default() };
    let found = propose_markers(&stage.film().0, &ReferenceFrames::Mean(0..2));
    assert!(matches!(found, Err(CorrelationError::NoMarkers { .. })), "{found:?}");
}

#[test]
fn tiny_and_absent_frames_are_errors() {
    for [width, height] in [[1, 1], [3, 2], [12, 9], [40, 1]] {
        let frames = vec![(0..width * height).map(|i| (i * 37 % 91) as f32).collect()];
        assert!(
            propose_markers(&MemoryRecording::new(width, 12, frames), &ReferenceFrames::Single(0)).is_err()
        );
    }
    let (recording, _) = Stage::default().film();
    for rest in [ReferenceFrames::Single(2), ReferenceFrames::Mean(1..1), ReferenceFrames::Mean(0..9)] {
        let found = propose_markers(&recording, &rest);
        assert!(matches!(found, Err(CorrelationError::NoSuchReference { .. })), "{found:?}");
    }
}

/// Dark stickers on rings that one looks through, at ground whose texture is stronger than theirs.
#[test]
fn stickers_are_found_by_their_shade_on_ground_of_more_texture() {
    let size = [608, 96];
    for seed in 0..8 {
        let offset_px = 0.37 * seed as f64;
        let places: Vec<[f64; 2]> = (0..5).map(|k| [64.0 + offset_px + 120.0 * f64::from(k), 47.0]).collect();
        let ground = Surface {
            tone: 0.8,
            contrast: 0.4,
            ..Surface::everywhere(
                Texture::speckles(100 + seed, 9.0, [304.0, 48.0], [320.0, 64.0]),
                Deformation::NONE,
            )
        };
        let sticker = |(k, place): (u64, &[f64; 2])| {
            let texture = Texture::speckles(10 * seed + k, 5.0, *place, [20.0, 20.0]);
            let disc = Some((*place, 15.0));
            Surface { disc, tone: 0.25, contrast: 0.22, ..Surface::everywhere(texture, Deformation::NONE) }
        };
        let stickers = (0..).zip(&places).map(sticker);
        let surfaces: Vec<Surface> = std::iter::once(ground).chain(stickers).collect();
        let tones = picture(size, &surfaces).unwrap();
        let frames =
            [0, 1].map(|number| counts(&tones, 12, 0.01, seed, number).unwrap().into_iter().collect());
        let recording = MemoryRecording::new(size[0], 12, frames.into());
        let row = propose_markers(&recording, &ReferenceFrames::Mean(0..2)).unwrap();
        let found: Vec<[f64; 2]> =
            row.markers.iter().map(|marker| [marker.subset.x_px, marker.subset.y_px]).collect();
        assert_eq!(found.len(), places.len(), "seed {seed}: {found:?}");
        for (found, place) in found.iter().zip(&places) {
            // Outlines are known to 2 px or so.
            assert!(
                (found[0] - place[0]).hypot(found[1] - place[1]) < 3.0,
                "seed {seed}: {found:?} {place:?}"
            );
        }
        let half_px = row.markers[0].outline_half_px;
        assert!(half_px.iter().all(|half| (half - 15.0).abs() < 3.0), "seed {seed}: {half_px:?}");
    }
}
