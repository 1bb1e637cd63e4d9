//! `chainwave samples`: the small recordings and curves of the folder `data-samples`.

use std::path::Path;

use chainwave_measurement::Trajectory;
use chainwave_mechanics::{Chain, PowerLaw, Schedule, simulate};
use chainwave_synthetic::{
    Camera, CompressionTest, Effects, FileFaults, Marker, Packing, Ring, Rods, Scene, Sensor, Shot, Specimen,
    Tones, compression_curve, film,
};
use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::cli::Samples;
use crate::error::Error;
use crate::outcome::Outcome;
use crate::output::{make_folder, write_text};
use crate::table::{self, column};
use crate::terminal::say;

/// What lies beside a sample, in the file named after it with `.toml` behind.
#[derive(Serialize)]
struct Sidecar {
    what: String,
    made_by: &'static str,
    size_bytes: u64,
    sha256: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    recording: Option<RecordingFacts>,
}

#[derive(Serialize)]
struct RecordingFacts {
    width_px: usize,
    height_px: usize,
    n_frames: usize,
    rate_hz: f64,
    bit_depth: u32,
    scale_px_per_m: f64,
    /// Column and row of each body's marker at rest.
    bodies_px: Vec<[f64; 2]>,
}

/// Makes every sample anew; equal versions make equal bytes.
pub(crate) fn samples(arguments: &Samples) -> Result<Outcome, Error> {
    make_folder(&arguments.out)?;
    view_of_one_trial(&arguments.out)?;
    compression(&arguments.out)?;
    Ok(Outcome::default())
}

/// The first three HECs of a struck chain, one trial, small enough to keep: every fourth frame of the laboratory's rate.
fn view_of_one_trial(folder: &Path) -> Result<(), Error> {
    let camera = Camera {
        width_px: 240,
        height_px: 40,
        rate_hz: 12_500.0,
        exposure_s: 10e-6,
        blur: false,
        packing: Packing::P12L,
        scale_px_per_m: 2500.0,
        sensor: Sensor {
            bit_depth: 12,
            black_level: 64.0,
            read_noise_counts: 10.0,
            counts_per_electron: 0.2,
        },
        optics: None,
        lighting: None,
        effects: Effects::default(),
    };
    let specimen = Specimen {
        n_bodies: 3,
        pitch_m: 0.030,
        gaps_m: Vec::new(),
        ring: Ring { semi_major_m: 0.015, semi_minor_m: 0.009, wall_m: 0.4e-3 },
        marker: Marker { half_width_m: 6e-3, half_height_m: 6e-3, speckle_diameter_px: 4.5, seed: 1 },
        rods: Rods { diameter_m: 2.38e-3, below_axis_m: vec![-7.6e-3, 7.6e-3] },
        tones: Tones::default(),
    };
    let shot = Shot {
        stage_m: 0.0,
        first_body_px: [25.0, 19.5],
        first_image: -12,
        n_frames: 120,
        trigger_delay_s: 0.0,
        frame_phase_s: 20e-6,
        noise_seed: 1,
        covers: Vec::new(),
        view: 1,
    };
    let path = folder.join("hec-view1-trial1.cine");
    let motion = struck_chain()?;
    film(&path, &Scene::new(&camera, &specimen, &shot, &motion)?, &FileFaults::default())?;
    let facts = RecordingFacts {
        width_px: camera.width_px,
        height_px: camera.height_px,
        n_frames: shot.n_frames,
        rate_hz: camera.rate_hz,
        bit_depth: camera.sensor.bit_depth,
        scale_px_per_m: camera.scale_px_per_m,
        bodies_px: (0..3).map(|row| [25.0 + 75.0 * f64::from(row), 19.5]).collect(),
    };
    let what = "the first three of 26 HECs struck at 2.73 m/s (c_d = 0.003, c_s = 0.2 kg/s), filmed by the synthetic camera \
                as a packed 12-bit Phantom .cine file";
    write_sidecar(&path, what, Some(facts))
}

/// The chain of the paper, damped, over the time of the sample.
fn struck_chain() -> Result<Trajectory, Error> {
    let schedule = Schedule::automatic(0.01, 1e-5);
    let trajectory = simulate(&Chain::of_rings(26), &schedule)?.trajectory;
    let first_three = ndarray::s![..3, ..];
    Ok(Trajectory {
        times_s: trajectory.times_s,
        displacement_m: trajectory.displacement_m.slice(first_three).to_owned(),
        velocity_m_per_s: trajectory.velocity_m_per_s.slice(first_three).to_owned(),
    })
}

fn compression(folder: &Path) -> Result<(), Error> {
    let law = PowerLaw::ELLIPTICAL_RING;
    let PowerLaw { a, delta_0_m, p } = law;
    let test = CompressionTest { max_overlap_m: 10e-3, n_points: 401, force_noise_n: 5e-3, seed: 1 };
    let readings = compression_curve(|overlap_m| law.force_n(overlap_m), &test)?;
    let path = folder.join("hec-compression.csv");
    let (overlap_m, force_n): (Vec<f64>, Vec<f64>) = readings.into_iter().unzip();
    table::write(&path, vec![column("overlap_m", overlap_m), column("force_n", force_n)])?;
    let what = format!(
        "quasi-static compression of one HEC, pole to pole: a = {a} N/m^p, delta_0 = {delta_0_m} m, p = {p}, with a load cell's \
         noise of 5 mN"
    );
    write_sidecar(&path, &what, None)
}

fn write_sidecar(path: &Path, what: &str, recording: Option<RecordingFacts>) -> Result<(), Error> {
    let bytes = std::fs::read(path).map_err(Error::file(path, "read"))?;
    let digest = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    let sidecar = Sidecar {
        what: what.into(),
        made_by: "chainwave samples",
        size_bytes: bytes.len() as u64,
        sha256: digest,
        recording,
    };
    let text = toml::to_string(&sidecar).map_err(|wrong| Error::Argument(wrong.to_string()))?;
    // What speaks of `NAME.EXT` stands in `NAME.EXT.toml`, so that two samples may share a stem.
    let mut name = path.as_os_str().to_owned();
    name.push(".toml");
    write_text(Path::new(&name), &text)?;
    say!("wrote {} ({} bytes): {}", path.display(), sidecar.size_bytes, sidecar.what);
    Ok(())
}
