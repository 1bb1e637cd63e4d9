//! Films a 26-HEC chain in the middle of a made-up wave and writes one frame as a PGM picture, for a look at it:
//! `cargo run --release -p chainwave-synthetic --example preview -- FRAME.pgm [RECORDING.cine]`.

use std::error::Error;
use std::io::Write;
use std::path::Path;

use chainwave_measurement::Trajectory;
use chainwave_synthetic::{Camera, Marker, Packing, Ring, Rods, Scene, Sensor, Shot, Specimen, Tones, film};
use ndarray::Array2;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args_os().skip(1);
    let picture = arguments.next().ok_or("expected the name of the picture to write")?;
    let (camera, specimen, shot, motion) = (camera(), specimen(), shot(), pulse());
    let scene = Scene::new(&camera, &specimen, &shot, &motion)?;
    let counts = scene.recorded_counts(200)?;
    let mut file = std::fs::File::create(picture)?;
    writeln!(file, "P5 {} {} 255", camera.width_px, camera.height_px)?;
    file.write_all(&counts.iter().map(|count| (count / 16.0) as u8).collect::<Vec<_>>())?;
    if let Some(recording) = arguments.next() {
        film(Path::new(&recording), &camera, &specimen, &shot, &motion)?;
    }
    Ok(())
}

fn camera() -> Camera {
    let sensor =
        Sensor { bit_depth: 12, black_level: 64.0, read_noise_counts: 8.0, counts_per_electron: 0.2 };
    Camera {
        width_px: 1008,
        height_px: 96,
        rate_hz: 25_000.0,
        exposure_s: 10.0e-6,
        packing: Packing::Bits16,
        scale_px_per_m: 5000.0,
        sensor,
    }
}

fn specimen() -> Specimen {
    Specimen {
        n_bodies: 26,
        pitch_m: 0.030,
        ring: Ring { semi_major_m: 15.0e-3, semi_minor_m: 9.0e-3, wall_m: 0.4e-3 },
        marker: Marker { half_width_m: 5.5e-3, half_height_m: 5.5e-3, speckle_diameter_px: 4.5, seed: 1 },
        rods: Rods { diameter_m: 2.38e-3, below_axis_m: vec![-7.0e-3, 7.0e-3] },
        tones: Tones::default(),
    }
}

fn shot() -> Shot {
    Shot {
        stage_m: 0.0,
        first_body_px: [80.0, 47.5],
        first_image: -25,
        n_frames: 450,
        trigger_delay_s: 3.0e-6,
        frame_phase_s: 1.1e-5,
        noise_seed: 42,
    }
}

/// A smooth step of 15 mm that runs down the chain at 54 m/s.
fn pulse() -> Trajectory {
    let (height_m, rise_s, delay_s) = (15.0e-3, 3.0e-3, 0.030 / 54.0);
    let times_s: Vec<f64> = (0..2001).map(|sample| f64::from(sample) * 1.0e-5).collect();
    let phase = |body: usize, sample: usize| (times_s[sample] - body as f64 * delay_s) / rise_s;
    let shape = (26, times_s.len());
    Trajectory {
        displacement_m: Array2::from_shape_fn(shape, |(body, sample)| {
            let at = phase(body, sample).clamp(0.0, 1.0);
            height_m * at * at * (3.0 - 2.0 * at)
        }),
        velocity_m_per_s: Array2::from_shape_fn(shape, |(body, sample)| {
            let at = phase(body, sample).clamp(0.0, 1.0);
            height_m / rise_s * 6.0 * at * (1.0 - at)
        }),
        times_s,
    }
}
