//! Effects of a real camera, one of each kind as a laboratory might have it, and the words by which a report names their cause.

use chainwave_synthetic::{
    Camera, DefectivePixels, Defocus, Effects, FixedPattern, LineNoise, Optics, OutOfPlane, Reflections,
    ScaleError, Shadow, Shake, ShakeOnset,
};

use crate::configuration::Synthetic;

/// A kind of what a real camera adds to the ideal picture.
#[derive(Debug, Clone, Copy)]
pub struct CameraEffect {
    /// Its name.
    pub name: &'static str,
    /// Words of which a warning has to say one for the cause to count as named.
    pub causes: &'static [&'static str],
    add: fn(&mut Camera, &Picture),
}

/// What effects are measured by: the width of the picture and the length of a recording.
struct Picture {
    width_px: f64,
    duration_s: f64,
}

impl CameraEffect {
    /// One of each kind.
    pub const ALL: &'static [Self] = &[
        Self {
            name: "fixed_pattern",
            causes: &["fixed pattern"],
            add: |to, _| fixed_pattern(&mut to.effects, 1.0),
        },
        Self {
            name: "strong_pattern",
            causes: &["fixed pattern"],
            add: |to, _| fixed_pattern(&mut to.effects, 3.0),
        },
        Self { name: "columns", causes: &["fixed pattern"], add: |to, _| columns(&mut to.effects) },
        Self { name: "spots", causes: &["fixed pattern"], add: |to, _| spots(&mut to.effects) },
        Self { name: "line_noise", causes: &["rows and columns"], add: |to, _| line_noise(&mut to.effects) },
        Self { name: "hot_pixels", causes: &["hot pixels"], add: |to, _| hot_pixels(&mut to.effects) },
        Self { name: "reflections", causes: &["reflections"], add: |to, _| reflections(&mut to.effects) },
        Self { name: "shadow", causes: &["shadow"], add: shadow },
        Self {
            name: "vignetting",
            causes: &["uneven light"],
            add: |to, _| to.effects.vignetting = Some(0.3),
        },
        Self { name: "defocus", causes: &["focus"], add: |to, _| defocus(&mut to.effects) },
        Self {
            name: "shake",
            causes: &["camera moves"],
            add: |to, _| shake(&mut to.effects, 0.2, ShakeOnset::Always),
        },
        Self {
            name: "shake_by_strike",
            causes: &["camera moves"],
            add: |to, _| shake(&mut to.effects, 0.2, ShakeOnset::Impact),
        },
        Self {
            name: "small_shake",
            causes: &["camera moves"],
            add: |to, _| shake(&mut to.effects, 0.02, ShakeOnset::Always),
        },
        Self {
            name: "small_by_strike",
            causes: &["camera moves"],
            add: |to, _| shake(&mut to.effects, 0.02, ShakeOnset::Impact),
        },
        Self {
            name: "out_of_plane",
            causes: &["towards the camera"],
            add: |to, _| out_of_plane(&mut to.effects),
        },
        Self { name: "scale", causes: &["scale"], add: |to, _| scale(&mut to.effects, 0.01, Vec::new()) },
        Self {
            name: "small_scale",
            causes: &["scale"],
            add: |to, _| scale(&mut to.effects, 0.005, Vec::new()),
        },
        Self {
            name: "view_magnified",
            causes: &["magnified"],
            add: |to, _| scale(&mut to.effects, 0.0, vec![0.0, 0.02]),
        },
        Self {
            name: "view_by_little",
            causes: &["magnified"],
            add: |to, _| scale(&mut to.effects, 0.0, vec![0.0, 0.004]),
        },
        Self { name: "turned", causes: &["turned about the vertical"], add: |to, _| turned(to) },
        Self { name: "lens", causes: &["lens that distorts"], add: lens },
        Self {
            name: "lens_and_vignetting",
            causes: &["lens that distorts"],
            add: |to, picture| {
                lens(to, picture);
                to.effects.vignetting = Some(0.3);
            },
        },
        // All light that a frame may have: taken off where the file states it, so that there is no cause to name.
        Self {
            name: "long_exposure",
            causes: &[],
            add: |to, _| {
                (to.exposure_s, to.blur) = (0.95 / to.rate_hz, true);
            },
        },
        Self {
            name: "rolling_shutter",
            causes: &["rolling shutter"],
            // A sensor that reads its lines all the time: a frame of 48 lines takes its whole period at 25 kHz.
            add: |to, _| to.effects.line_time_s = Some(8e-7),
        },
        Self { name: "eight_bits", causes: &["grey levels"], add: |to, _| to.effects.stored_bits = Some(8) },
        Self {
            name: "compression",
            causes: &["compression"],
            add: |to, _| to.effects.jpeg_quality = Some(80),
        },
        Self {
            name: "repeated_lines",
            causes: &["repeated lines"],
            add: |to, _| to.effects.repeated_lines = Some(0.02),
        },
    ];

    /// Gives it to the camera that films.
    pub fn add_to(&self, synthetic: &mut Synthetic) {
        let camera = &mut synthetic.camera;
        let picture = Picture {
            width_px: camera.width_px as f64,
            duration_s: synthetic.n_frames as f64 / camera.rate_hz,
        };
        camera.effects.seed = synthetic.seed;
        (self.add)(camera, &picture);
    }
}

/// A camera that is a degree off the square, some 0.9 m from the chain.
fn turned(to: &mut Camera) {
    to.optics = Some(Optics { focal_length_px: 3000.0, yaw_rad: 1.0_f64.to_radians(), ..Optics::STRAIGHT });
}

/// A lens that moves the edges of the picture by 0.1 % of their distance from its middle.
fn lens(to: &mut Camera, picture: &Picture) {
    let focal_length_px = 0.5 * picture.width_px;
    to.optics = Some(Optics { focal_length_px, k1: -1e-3, ..Optics::STRAIGHT });
}

/// An ordinary sensor: 0.1 % of the range and 0.3 % of the gain, or a multiple of both.
fn fixed_pattern(to: &mut Effects, factor: f64) {
    to.fixed_pattern = Some(FixedPattern {
        offset_sigma: 1e-3 * factor,
        gain_sigma: 3e-3 * factor,
        ..FixedPattern::default()
    });
}

/// Columns with amplifiers of their own, 0.2 % of the range apart.
fn columns(to: &mut Effects) {
    to.fixed_pattern = Some(FixedPattern { column_offset_sigma: 2e-3, ..FixedPattern::default() });
}

/// Stains and uneven light of 0.5 %, as fine as the speckles.
fn spots(to: &mut Effects) {
    to.fixed_pattern =
        Some(FixedPattern { offset_sigma: 5e-3, offset_grain_px: 1.5, ..FixedPattern::default() });
}

/// Half of the noise of a pixel for each row and each column.
fn line_noise(to: &mut Effects) {
    to.line_noise = Some(LineNoise { row_sigma: 2.5e-3, column_sigma: 2.5e-3 });
}

fn hot_pixels(to: &mut Effects) {
    to.defective_pixels =
        Some(DefectivePixels { hot_fraction: 1e-3, hot_offset_mean: 0.2, ..DefectivePixels::default() });
}

fn reflections(to: &mut Effects) {
    to.reflections = Some(Reflections { glare: 0.06, dirt: 0.0, size_px: 20.0, per_view: false });
}

/// An edge of a twentieth of the width that crosses the picture within the recording.
fn shadow(to: &mut Camera, picture: &Picture) {
    to.effects.shadow = Some(Shadow {
        depth: 0.4,
        start_px: 0.0,
        speed_px_per_s: picture.width_px / picture.duration_s,
        edge_sigma_px: 0.05 * picture.width_px,
    });
}

fn defocus(to: &mut Effects) {
    to.defocus = Some(Defocus { first_px: 0.0, last_px: 1.2 });
}

fn shake(to: &mut Effects, amplitude_px: f64, onset: ShakeOnset) {
    to.shake = Some(Shake {
        amplitude_px: [amplitude_px, amplitude_px],
        turn_amplitude_rad: 0.0,
        frequency_hz: 200.0,
        onset,
        decay_per_s: 0.0,
    });
}

/// Bodies that wobble by 0.03 mm, half a metre from the camera.
fn out_of_plane(to: &mut Effects) {
    to.out_of_plane = Some(OutOfPlane { amplitude_m: 3e-5, distance_m: 0.5, frequency_hz: 150.0 });
}

fn scale(to: &mut Effects, error: f64, views: Vec<f64>) {
    to.scale = Some(ScaleError { error, view_sigma: 0.0, views });
}
