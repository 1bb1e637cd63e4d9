//! Small vibrations: natural modes of a ring and Bloch bands of the chain.

use nalgebra::{Complex, DMatrix, DVector};

use super::rod::Rod;
use super::section::Ring;
use crate::{check, error::MechanicsError};

/// Frequencies below this share of the highest are those of a body that moves as a whole.
const RIGID: f64 = 1e-6;

/// How a ring moves against the chain's axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Symmetry {
    /// The lower half is the mirror image of the upper: what a strike along the axis excites.
    Symmetric,
    /// The lower half moves opposite to the mirror image: the joints move across the chain and turn.
    Antisymmetric,
}

/// What holds a single ring.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Boundary {
    /// Nothing.
    Free,
    /// Both poles keep their places and directions.
    Held,
}

/// A natural vibration of one ring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// What holds the ring.
    pub boundary: Boundary,
    /// Its symmetry; a held ring has each symmetric mode again as an antisymmetric one.
    pub symmetry: Symmetry,
    /// Natural frequency in hertz.
    pub frequency_hz: f64,
}

/// A ring's small vibrations about its unstressed shape: stiffness and masses by unknown of the upper half.
#[derive(Debug, Clone)]
pub(crate) struct Vibration {
    stiffness: DMatrix<f64>,
    masses_kg: DVector<f64>,
}

/// The lowest natural modes of one ring, bodily motion left out: of each boundary and symmetry `n_modes`, in rising order.
///
/// # Errors
/// [`MechanicsError::NotPhysical`] for a ring or mesh without meaning.
pub fn ring_modes(
    ring: &Ring,
    elements_per_ring: usize,
    n_modes: usize,
) -> Result<Vec<Mode>, MechanicsError> {
    let vibration = Vibration::of(ring, elements_per_ring)?;
    let mut modes = Vec::new();
    for boundary in [Boundary::Free, Boundary::Held] {
        for symmetry in [Symmetry::Symmetric, Symmetry::Antisymmetric] {
            let frequencies = vibration.modes_rad_per_s(boundary, symmetry);
            modes.extend(frequencies.into_iter().take(n_modes).map(|omega| Mode {
                boundary,
                symmetry,
                frequency_hz: omega / (2.0 * std::f64::consts::PI),
            }));
        }
    }
    Ok(modes)
}

/// Frequencies in hertz, in rising order, of the infinite chain's waves of one symmetry that turn by `kappa_a` from ring to
/// ring (Bloch waves), in radians.
///
/// # Errors
/// [`MechanicsError::NotPhysical`] for a ring or mesh without meaning.
pub fn ring_bands(
    ring: &Ring,
    elements_per_ring: usize,
    symmetry: Symmetry,
    kappa_a: &[f64],
) -> Result<Vec<Vec<f64>>, MechanicsError> {
    let vibration = Vibration::of(ring, elements_per_ring)?;
    kappa_a
        .iter()
        .map(|&kappa_a| {
            check::finite("kappa_a", kappa_a)?;
            let frequencies = vibration.bloch_rad_per_s(symmetry, kappa_a);
            Ok(frequencies.into_iter().map(|omega| omega / (2.0 * std::f64::consts::PI)).collect())
        })
        .collect()
}

/// Turn from ring to ring, in radians, of the wave whose phase velocity stands for that of the longest: it lies below by
/// kappa^2 / 24 = 4e-6 and what the ring's own inertia adds.
const LONG_WAVE_RAD: f64 = 0.01;

/// Speed of sound in metres per second of an infinite chain of rings, that of waves long against a ring and along the chain, for a
/// pitch in metres.
///
/// # Errors
/// [`MechanicsError::NotPhysical`] for a ring or mesh without meaning.
pub fn ring_sound_speed_m_per_s(
    ring: &Ring,
    elements_per_ring: usize,
    pitch_m: f64,
) -> Result<f64, MechanicsError> {
    let bands = ring_bands(ring, elements_per_ring, Symmetry::Symmetric, &[LONG_WAVE_RAD])?;
    let frequency_hz = bands.first().and_then(|bands| bands.first()).copied().unwrap_or(0.0);
    Ok(2.0 * std::f64::consts::PI * frequency_hz / LONG_WAVE_RAD * pitch_m)
}

impl Vibration {
    fn of(ring: &Ring, elements_per_ring: usize) -> Result<Self, MechanicsError> {
        let (rod, half) = Rod::and_half_ring(ring, ring.section(), elements_per_ring)?;
        let bonded_kg = rod.section().mass_kg_per_m * half.bonded_m;
        Ok(Self::new(&rod, bonded_kg))
    }

    /// The half ring whose ends carry `bonded_kg` each.
    pub(crate) fn new(rod: &Rod, bonded_kg: f64) -> Self {
        let mut masses_kg = rod.masses_kg();
        for unknown in [0, 1, 2 * rod.n_elements(), 2 * rod.n_elements() + 1] {
            masses_kg[unknown] += bonded_kg;
        }
        Self { stiffness: rod.stiffness(&DVector::zeros(rod.n_unknowns())), masses_kg }
    }

    /// The largest angular frequency, in rad/s, of symmetric motion. No chain of such rings has a larger one.
    pub(crate) fn largest_rad_per_s(&self) -> f64 {
        let ties = self.ties(Some(Symmetry::Symmetric), None);
        self.frequencies(&ties).pop().unwrap_or(0.0)
    }

    fn modes_rad_per_s(&self, boundary: Boundary, symmetry: Symmetry) -> Vec<f64> {
        let ties = match boundary {
            Boundary::Free => self.ties(Some(symmetry), None),
            Boundary::Held => self.ties(None, None),
        };
        let frequencies = self.frequencies(&ties);
        let highest = frequencies.last().copied().unwrap_or(0.0);
        frequencies.into_iter().filter(|omega| *omega > RIGID * highest).collect()
    }

    fn bloch_rad_per_s(&self, symmetry: Symmetry, kappa_a: f64) -> Vec<f64> {
        self.frequencies(&self.ties(Some(symmetry), Some(Complex::cis(kappa_a))))
    }

    /// The independent motions: inner nodes move freely; the poles as the symmetry lets them (not at all for `None`), and the last one as
    /// the first one times `phase` where that is given. The last motions are rotations.
    fn ties(&self, symmetry: Option<Symmetry>, phase: Option<Complex<f64>>) -> Ties {
        let n = self.masses_kg.len();
        let last = n - 4;
        let mut moved: Vec<Vec<(usize, Complex<f64>)>> =
            (2..last).map(|unknown| vec![(unknown, Complex::ONE)]).collect();
        let mut tie = |first: usize, second: usize| match phase {
            Some(phase) => moved.push(vec![(first, Complex::ONE), (second, phase)]),
            None => moved.extend([vec![(first, Complex::ONE)], vec![(second, Complex::ONE)]]),
        };
        match symmetry {
            Some(Symmetry::Symmetric) => tie(0, last),
            Some(Symmetry::Antisymmetric) => {
                tie(1, last + 1);
                tie(n - 2, n - 1);
            }
            None => {}
        }
        let rotates = symmetry == Some(Symmetry::Antisymmetric);
        let n_rotations = usize::from(rotates) * (if phase.is_some() { 1 } else { 2 });
        Ties { moved, n_rotations }
    }

    /// Angular frequencies in rad/s, rising, of the motions allowed.
    fn frequencies(&self, ties: &Ties) -> Vec<f64> {
        let n_rotations = ties.n_rotations;
        let mut stiffness = ties.stiffness(&self.stiffness);
        let masses_kg = ties.masses_kg(&self.masses_kg);
        let n = stiffness.nrows() - n_rotations;
        // Rotations have no inertia, so each follows the displacements at once.
        for rotation in (n..n + n_rotations).rev() {
            let column = stiffness.view((0, rotation), (rotation, 1)).into_owned();
            let pivot = stiffness[(rotation, rotation)].re;
            let mut rest = stiffness.view_mut((0, 0), (rotation, rotation));
            rest -= &column * column.adjoint() / Complex::new(pivot, 0.0);
        }
        let scaled = DMatrix::from_fn(n, n, |i, j| stiffness[(i, j)] / (masses_kg[i] * masses_kg[j]).sqrt());
        let mut squares: Vec<f64> = scaled.symmetric_eigenvalues().iter().copied().collect();
        squares.sort_by(f64::total_cmp);
        squares.into_iter().map(|square| square.max(0.0).sqrt()).collect()
    }
}

/// Independent motions: the unknowns that each moves, one or two of them, and how far. The last ones are the rotations, without inertia.
struct Ties {
    moved: Vec<Vec<(usize, Complex<f64>)>>,
    n_rotations: usize,
}

impl Ties {
    /// Stiffness by independent motion.
    fn stiffness(&self, by_unknown: &DMatrix<f64>) -> DMatrix<Complex<f64>> {
        let force = |i: usize, column: usize| -> Complex<f64> {
            self.moved[i].iter().map(|(row, by)| by.conj() * by_unknown[(*row, column)]).sum()
        };
        let n = self.moved.len();
        DMatrix::from_fn(n, n, |i, j| self.moved[j].iter().map(|(column, by)| force(i, *column) * by).sum())
    }

    /// Masses by independent motion.
    fn masses_kg(&self, by_unknown: &DVector<f64>) -> Vec<f64> {
        let mass_kg = |(unknown, by): &(usize, Complex<f64>)| (by.conj() * by_unknown[*unknown] * by).re;
        self.moved.iter().map(|motion| motion.iter().map(mass_kg).sum()).collect()
    }
}
