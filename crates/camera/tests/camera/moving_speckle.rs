//! A recording in memory: speckle that moves, seen by a camera of known noise.

use chainwave_measurement::MemoryRecording;

/// The camera.
#[derive(Clone, Copy)]
pub(crate) struct Camera {
    pub(crate) n_frames: usize,
    /// Variance of the counts: `variance_at_zero + variance_per_count * count`.
    pub(crate) variance_at_zero: f64,
    pub(crate) variance_per_count: f64,
    /// Motion of the right half of the picture, in pixels a frame.
    pub(crate) motion_px: (f64, f64),
    /// Largest count of the lamp's flicker, from frame to frame.
    pub(crate) flicker: f64,
}

pub(crate) const WIDTH: usize = 160;
pub(crate) const HEIGHT: usize = 120;

/// What the camera sees and adds.
pub(crate) fn moving_speckle(camera: Camera) -> MemoryRecording {
    let mut random = Random(1);
    let frame = |index: usize| {
        let flicker = camera.flicker * (index as f64).sin();
        (0..WIDTH * HEIGHT)
            .map(|at| {
                let light = brightness(at % WIDTH, at / WIDTH, index as f64, camera.motion_px) + flicker;
                let sigma = (camera.variance_at_zero + camera.variance_per_count * light).sqrt();
                (light + sigma * random.normal()).round().clamp(0.0, 4095.0) as f32
            })
            .collect()
    };
    let frames: Vec<Vec<f32>> = (0..camera.n_frames).map(frame).collect();
    MemoryRecording::new(WIDTH, 12, frames)
}

/// Waves of 9 to 17 px in several directions on a slope, from about 500 to 3000 counts; the right half moves.
fn brightness(x: usize, y: usize, time: f64, motion_px: (f64, f64)) -> f64 {
    let moved = if x >= WIDTH / 2 { time } else { 0.0 };
    let (x, y) = (x as f64 - motion_px.0 * moved, y as f64 - motion_px.1 * moved);
    let waves = [(0.6, 0.2, 0.0), (-0.3, 0.5, 1.0), (0.1, -0.4, 2.0), (0.4, 0.4, 3.0)];
    let speckle: f64 = waves.iter().map(|(kx, ky, phase)| (kx * x + ky * y + phase).sin()).sum();
    1750.0 + 200.0 * speckle + 700.0 * (x / 40.0).sin().min(0.7)
}

/// SplitMix64 (Steele, Lea and Flood, 2014) and the polar form of a normal variate.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}
