//! The fits against motions and tracks whose answers are known: the chain model's own, with synthetic noise.

#[cfg(test)]
mod common;
#[cfg(test)]
mod decisions;
#[cfg(test)]
mod energies;
#[cfg(test)]
mod imposed;
#[cfg(test)]
mod models;
#[cfg(test)]
mod released;
#[cfg(test)]
mod tracks;
