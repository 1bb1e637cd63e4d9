//! Why a curve gives no contact law.

/// Why no contact law could be fitted to a curve. Readings are numbered from 0, in the order given.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ContactFitError {
    /// Overlaps and forces come in pairs.
    #[error("compression curve: expected as many forces as overlaps ({expected}), found {found}")]
    Length {
        /// Number of overlaps.
        expected: usize,
        /// Number of forces.
        found: usize,
    },
    /// An overlap or force is infinite or not a number.
    #[error("compression curve: {quantity}: expected a finite number, found {found}")]
    NotFinite {
        /// Number of the reading.
        reading: usize,
        /// `overlap_m` or `force_n`.
        quantity: &'static str,
        /// The number found.
        found: f64,
    },
    /// More parameters are asked for than readings could determine.
    #[error(
        "compression curve: expected at least {expected} {what}, found {found}; a contact law has three parameters, and their \
         errors come from the readings' own scatter"
    )]
    TooFew {
        /// What is counted.
        what: &'static str,
        /// The least number.
        expected: usize,
        /// The number found.
        found: usize,
    },
    /// An overlap that no laboratory specimen survives.
    #[error(
        "compression curve: overlap_m: expected metres, below 1, found {found}; if these are millimetres, divide them by 1000"
    )]
    NotMetres {
        /// Number of the reading.
        reading: usize,
        /// The overlap found.
        found: f64,
    },
    /// The overlap does not change.
    #[error("compression curve: overlap_m: expected a growing overlap, found {found} m throughout")]
    ConstantOverlap {
        /// The overlap of every reading, in metres.
        found: f64,
    },
    /// The specimen was pulled, or overlaps count the other way.
    #[error(
        "compression curve: overlap_m: expected overlaps from 0 up (compression is positive), found {lowest_m} to {highest_m} m; \
         change the sign where compression was written as negative, and cut off what was measured in tension"
    )]
    Tension {
        /// Smallest overlap, in metres.
        lowest_m: f64,
        /// Largest overlap, in metres.
        highest_m: f64,
    },
    /// The force falls as the overlap grows.
    #[error(
        "compression curve: force_n: expected a force that grows with the overlap, found one that falls by {slope_n_per_m:.4} \
         N/m; change the sign where compressive forces were written as negative"
    )]
    FallingForce {
        /// Amount of the curve's mean slope, in newtons per metre.
        slope_n_per_m: f64,
    },
    /// No slope stands out of the noise.
    #[error(
        "compression curve: force_n: expected a force that grows with the overlap, found {mean_n:.4} N throughout, within the \
         noise of {noise_n:.4} N; was the load cell in contact?"
    )]
    ConstantForce {
        /// Mean force, in newtons.
        mean_n: f64,
        /// Scatter of the readings, in newtons.
        noise_n: f64,
    },
    /// The force drops on the way, as when a specimen snaps, slips or breaks.
    #[error(
        "compression curve: force_n: expected a force that grows along the whole loading branch, found a drop from {from_n:.4} N to \
         {to_n:.4} N near overlap {overlap_m:.4e} m; cut the curve before the specimen snapped, slipped or broke"
    )]
    DroppingForce {
        /// Where the force is low again, in metres.
        overlap_m: f64,
        /// Force before the drop, in newtons.
        from_n: f64,
        /// Force after it, in newtons.
        to_n: f64,
    },
    /// Without curvature delta_0 and p mean nothing.
    #[error(
        "compression curve: expected a curve, found a straight line within its noise, k_0 = {k_0_n_per_m:.5} +- \
         {k_0_sigma_n_per_m:.2} N/m; delta_0 and p show only in the curvature: compress further or average more readings, or use a \
         linear law with this stiffness"
    )]
    StraightLine {
        /// Slope of the line, in newtons per metre.
        k_0_n_per_m: f64,
        /// Its standard uncertainty.
        k_0_sigma_n_per_m: f64,
    },
    /// The start of contact is to be fitted, but no reading was taken before it.
    #[error(
        "compression curve: expected at least {expected} readings before contact, with a flat force, to find the start of contact \
         from; found none (a free start would be one with the load cell's offset and delta_0)"
    )]
    NoApproach {
        /// The least number of readings.
        expected: usize,
    },
    /// The force is a power of the overlap itself, so that delta_0 goes to zero and k_0 with it, or without end.
    #[error(
        "contact fit: expected an offset delta_0, found a power of the overlap alone, F = A Delta^p with p = {:.4} +- {:.4} and A = {a:.6e} \
         N/m^p: nothing presses the specimens together at zero overlap (hint: state `law = \"hertz\"` for spheres, or the power law with \
         a = {a:.6e}, this p, and a delta_0 far below the smallest overlap of interest)", .p.value, .p.sigma
    )]
    NoOffset {
        /// A, in newtons over metres to the power p.
        a: f64,
        /// The exponent.
        p: chainwave_measurement::Estimate,
    },
    /// The search found no minimum, or one without width.
    #[error("contact fit: expected one best law, found none: {0}")]
    NotDetermined(String),
}

impl ContactFitError {
    /// Number of the offending reading, from 0, where there is a single one.
    pub fn reading(&self) -> Option<usize> {
        match self {
            Self::NotFinite { reading, .. } | Self::NotMetres { reading, .. } => Some(*reading),
            _ => None,
        }
    }
}
