//! Random streams, each a function of purpose, seed and counter alone.

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

/// What a random stream is for, so that streams of equal seed and counter differ between purposes.
#[derive(Clone, Copy)]
pub(crate) enum Purpose {
    Speckle = 1,
    Backdrop = 2,
    Noise = 3,
    Trial = 4,
    LoadCell = 5,
    Flicker = 6,
    Stage = 7,
    Body = 8,
    Walk = 9,
    FixedPattern = 10,
    Defects = 11,
    Reflections = 12,
    Shake = 13,
    Magnification = 14,
    RepeatedLines = 15,
    PictureNoise = 16,
    ViewTrigger = 17,
    LineNoise = 18,
    OutOfPlane = 19,
}

/// The random stream of (purpose, seed, counter): the same whatever was drawn before, in any order and thread.
pub(crate) fn stream(purpose: Purpose, seed: u64, counter: u64) -> Pcg64Mcg {
    Pcg64Mcg::seed_from_u64(mix(mix(mix(purpose as u64) ^ seed) ^ counter))
}

/// A bijection of 64 bits in which each bit of the input flips about half of the output: the finaliser of SplitMix64
/// (Steele, Lea, Flood 2014).
fn mix(value: u64) -> u64 {
    let value = value.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let value = (value ^ (value >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    value ^ (value >> 31)
}
