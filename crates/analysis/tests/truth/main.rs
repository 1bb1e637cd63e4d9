//! The analysis against motions whose answers are known: closed-form pulses, the chain model at a finer sampling, a longer
//! chain without its far end, and synthetic noise.

#[cfg(test)]
mod chain;
#[cfg(test)]
mod common;
#[cfg(test)]
mod coverage;
#[cfg(test)]
mod decisions;
#[cfg(test)]
mod followed;
#[cfg(test)]
mod pulses;
#[cfg(test)]
mod robustness;
#[cfg(test)]
mod waves;
#[cfg(test)]
mod wrong_peaks;
