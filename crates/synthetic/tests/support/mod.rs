//! What is filmed, and with what camera.

use chainwave_synthetic::{Camera, Effects, Marker, Packing, Ring, Rods, Sensor, Specimen, Tones};

/// Pictures of 400 px, 5 px a millimetre, with nothing but the sensor's own errors.
pub(crate) fn camera(height_px: usize, exposure_s: f64, sensor: Sensor) -> Camera {
    Camera {
        width_px: 400,
        height_px,
        rate_hz: 25_000.0,
        exposure_s,
        blur: false,
        packing: Packing::Bits16,
        scale_px_per_m: 5000.0,
        sensor,
        optics: None,
        lighting: None,
        effects: Effects::default(),
    }
}

/// Three rings on two rods.
pub(crate) fn specimen() -> Specimen {
    Specimen {
        n_bodies: 3,
        pitch_m: 0.030,
        gaps_m: Vec::new(),
        ring: Ring { semi_major_m: 15.0e-3, semi_minor_m: 9.0e-3, wall_m: 0.4e-3 },
        marker: Marker { half_width_m: 5.5e-3, half_height_m: 5.5e-3, speckle_diameter_px: 4.5, seed: 9 },
        rods: Rods { diameter_m: 2.38e-3, below_axis_m: vec![-7.0e-3, 7.0e-3] },
        tones: Tones::default(),
    }
}
