//! The fits against motions and tracks whose answers are known: the chain model's own, with synthetic noise.

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
mod struck;
#[cfg(test)]
mod struck_behind;
#[cfg(test)]
mod tracks;
#[cfg(test)]
mod turned;

// Motions that the tests of the analysis are about too.
#[cfg(test)]
#[expect(dead_code, reason = "fits are tested on a part of them")]
#[path = "../../../analysis/tests/truth/common.rs"]
mod common;
