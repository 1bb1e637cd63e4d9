//! The instruction sets by name, and the choice among them.

use std::fmt;
use std::sync::OnceLock;

use pulp::Arch;

/// Vector instructions that the inner loops are compiled for. All give the same bits; they differ in speed alone.
///
/// The best that the machine has are used. The environment variable [`InstructionSet::VARIABLE`] asks for others by name
/// (`portable`, `avx2`, `avx512`, and `neon` on aarch64), for tests and for measurements. It is read once, before the first loop. A
/// name that is not known, or that this machine lacks, changes nothing: the best that the machine has are used then too, and
/// [`InstructionSet::in_use`] says which these are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum InstructionSet {
    /// One number at a time; products that are added are fused by the machine's library.
    Portable,
    /// Two numbers at a time, on aarch64.
    Neon,
    /// Four numbers at a time, with fused products: AVX2 and FMA.
    Avx2,
    /// Eight numbers at a time: AVX-512 (F, BW, CD, DQ and VL).
    Avx512,
}

impl InstructionSet {
    /// The environment variable that asks for an instruction set by its name.
    pub const VARIABLE: &str = "CHAINWAVE_INSTRUCTION_SET";

    /// All of them, from the slowest to the fastest.
    const ALL: [Self; 4] = [Self::Portable, Self::Neon, Self::Avx2, Self::Avx512];

    /// Its name in the environment variable.
    pub fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            Self::Neon => "neon",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }

    /// Those that this machine has, from the slowest to the fastest.
    pub fn available() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(|set| set.arch().is_some())
    }

    /// The one that all loops of this process run with.
    pub fn in_use() -> Self {
        selected().0
    }

    /// The one of this name where the machine has it, else the best.
    fn asked_for(name: Option<&str>) -> Self {
        let best = Self::available().last().unwrap_or(Self::Portable);
        Self::available().find(|set| Some(set.name()) == name).unwrap_or(best)
    }

    /// What runs a loop with it; none where the machine lacks it.
    fn arch(self) -> Option<Arch> {
        match self {
            Self::Portable => Some(Arch::Scalar),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => pulp::x86::V3::try_new().map(Arch::V3),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => pulp::x86::V4::try_new().map(Arch::V4),
            #[cfg(target_arch = "aarch64")]
            Self::Neon => pulp::aarch64::Neon::try_new().map(Arch::Neon),
            _ => None,
        }
    }
}

impl fmt::Display for InstructionSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What runs the loops of this process.
#[inline]
pub(crate) fn arch() -> Arch {
    selected().1
}

#[inline]
fn selected() -> (InstructionSet, Arch) {
    static SELECTED: OnceLock<(InstructionSet, Arch)> = OnceLock::new();
    *SELECTED.get_or_init(|| {
        let name = std::env::var(InstructionSet::VARIABLE).ok();
        let set = InstructionSet::asked_for(name.as_deref());
        (set, set.arch().unwrap_or(Arch::Scalar))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_that_the_machine_has_is_obeyed_and_any_other_gives_the_best() {
        let best = InstructionSet::available().last().unwrap();
        for set in InstructionSet::ALL {
            let expected = if set.arch().is_some() { set } else { best };
            assert_eq!(InstructionSet::asked_for(Some(set.name())), expected);
        }
        for name in [None, Some(""), Some("AVX2"), Some("sse9")] {
            assert_eq!(InstructionSet::asked_for(name), best, "{name:?}");
        }
        assert_eq!(InstructionSet::available().next(), Some(InstructionSet::Portable));
    }
}
