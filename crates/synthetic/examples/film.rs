//! Films a small recording: three rings, the first struck at 2 m/s, before a camera whose sensor has a fixed pattern.
//!
//! `cargo run --release -p chainwave-synthetic --example film -- rings.cine`

use std::path::PathBuf;

use chainwave_measurement::Trajectory;
use chainwave_synthetic::{
    Camera, Effects, FileFaults, FixedPattern, Marker, Packing, Ring, Rods, Scene, Sensor, Shot, Specimen,
    Tones, film,
};
use ndarray::Array2;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args_os().nth(1).map_or_else(|| PathBuf::from("rings.cine"), PathBuf::from);
    let camera = Camera {
        width_px: 480,
        height_px: 100,
        rate_hz: 25_000.0,
        exposure_s: 10e-6,
        blur: true,
        packing: Packing::P12L,
        scale_px_per_m: 5000.0,
        sensor: Sensor { bit_depth: 12, black_level: 64.0, read_noise_counts: 6.0, counts_per_electron: 0.2 },
        optics: None,
        lighting: None,
        effects: Effects {
            fixed_pattern: Some(FixedPattern {
                offset_sigma: 1e-3,
                gain_sigma: 3e-3,
                ..FixedPattern::default()
            }),
            ..Effects::default()
        },
    };
    let specimen = Specimen {
        n_bodies: 3,
        pitch_m: 0.030,
        gaps_m: Vec::new(),
        ring: Ring { semi_major_m: 0.015, semi_minor_m: 0.009, wall_m: 0.4e-3 },
        marker: Marker { half_width_m: 5.5e-3, half_height_m: 5.5e-3, speckle_diameter_px: 4.5, seed: 1 },
        rods: Rods { diameter_m: 2.38e-3, below_axis_m: vec![-7.6e-3, 7.6e-3] },
        tones: Tones::default(),
    };
    let shot = Shot {
        stage_m: 0.0,
        first_body_px: [85.0, 49.5],
        first_image: -10,
        n_frames: 60,
        trigger_delay_s: 0.0,
        frame_phase_s: 0.0,
        noise_seed: 1,
        view: 1,
        covers: Vec::new(),
    };
    let scene_motion = struck();
    let scene = Scene::new(&camera, &specimen, &shot, &scene_motion)?;
    film(&path, &scene, &FileFaults::default())?;
    Ok(())
}

/// Each body takes up half a sine of velocity, 0.3 ms later than the one before it; the first reaches 2 m/s.
fn struck() -> Trajectory {
    let times_s: Vec<f64> = (0..=300).map(|sample| 1e-5 * f64::from(sample)).collect();
    let pulse_s = 0.8e-3;
    let phase = |body: usize, time_s: f64| {
        ((time_s - 3e-4 * body as f64) / pulse_s).clamp(0.0, 1.0) * std::f64::consts::PI
    };
    let of = |value: &dyn Fn(f64) -> f64| {
        Array2::from_shape_fn((3, times_s.len()), |(body, i)| value(phase(body, times_s[i])))
    };
    let reach_m = 2.0 * pulse_s / std::f64::consts::PI;
    Trajectory {
        displacement_m: of(&|phase| reach_m * (1.0 - phase.cos())),
        velocity_m_per_s: of(&|phase| 2.0 * phase.sin()),
        times_s: times_s.clone(),
    }
}
