//! The crate's errors.

/// Why a model could not be built or a simulation not be carried out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MechanicsError {
    /// A parameter is not finite, or outside what the model can mean.
    #[error("{quantity}: expected {expected}, found {found}")]
    NotPhysical {
        /// The parameter, with the body's number where there is one.
        quantity: String,
        /// The range that makes sense.
        expected: &'static str,
        /// The value given.
        found: f64,
    },
    /// A list does not have one entry for each body.
    #[error("{quantity}: expected {expected} entries, found {found}")]
    Length {
        /// The list.
        quantity: &'static str,
        /// Entries needed.
        expected: usize,
        /// Entries given.
        found: usize,
    },
    /// The sample times of an imposed motion do not increase.
    #[error("imposed motion, sample {index}: expected a time after {previous_s} s, found {found_s} s")]
    TimesNotIncreasing {
        /// Number of the sample, from 0.
        index: usize,
        /// Time of the sample before it, in seconds.
        previous_s: f64,
        /// Its own time, in seconds.
        found_s: f64,
    },
    /// The imposed motion does not cover the simulated time.
    #[error(
        "imposed motion: expected samples from 0 to {needed_s} s, found {first_s} to {last_s} s \
         (shorten the simulation, or move the samples' origin of time)"
    )]
    ImposedTooShort {
        /// Time of the first sample, in seconds.
        first_s: f64,
        /// Time of the last sample, in seconds.
        last_s: f64,
        /// Duration of the simulation, in seconds.
        needed_s: f64,
    },
    /// The time step lies beyond the integrator's stability bound.
    #[error(
        "time step: expected at most {limit_s:.3e} s, the stability bound of {method} at the chain's fastest oscillation, \
         {omega_rad_per_s:.4e} rad/s, and its damping, found {dt_s:.3e} s (leave the step out to have it chosen)"
    )]
    StepTooLarge {
        /// The method.
        method: &'static str,
        /// The step asked for, in seconds.
        dt_s: f64,
        /// The largest stable step, in seconds.
        limit_s: f64,
        /// The fastest oscillation that the bound is drawn from, in radians per second.
        omega_rad_per_s: f64,
    },
    /// No integrator has this name.
    #[error("integrator: expected one of {known}, found {found:?}")]
    UnknownMethod {
        /// The name given.
        found: String,
        /// The names known.
        known: String,
    },
    /// The method cannot integrate this chain.
    #[error("integrator {method}: it cannot integrate {what} (rk4, dop853 and esdirk4 can)")]
    NotFor {
        /// The method.
        method: &'static str,
        /// What it cannot integrate.
        what: &'static str,
    },
    /// The accuracy asked for cannot be met.
    #[error(
        "accuracy {accuracy:e}: {method} at t = {time_s} s would need steps below {h_s:.1e} s (a coarser accuracy, or a \
         contact law without so sharp a corner)"
    )]
    OutOfReach {
        /// The method.
        method: &'static str,
        /// The accuracy asked for.
        accuracy: f64,
        /// Where it was given up, in seconds.
        time_s: f64,
        /// The step that was still too long, in seconds.
        h_s: f64,
    },
    /// A motion takes far more steps than its chain's oscillation asks for.
    #[error(
        "steps of {method}: expected at most {limit} to try for {duration_s:.3e} s of a chain whose fastest oscillation is {omega_rad_per_s:.3e} \
         rad/s, found that they do not get beyond t = {time_s:.3e} s (hint: masses, stiffnesses and dampings in SI units, none of them many \
         orders of magnitude from the others? else a coarser accuracy)"
    )]
    TooManySteps {
        /// The method.
        method: &'static str,
        /// Trials of a step that it may take.
        limit: u64,
        /// Where it was given up, in seconds.
        time_s: f64,
        /// Duration of the motion, in seconds.
        duration_s: f64,
        /// The fastest oscillation that the limit is drawn from, in radians per second.
        omega_rad_per_s: f64,
    },
    /// A change of a chain is more than changed numbers.
    #[error(
        "change {index}: expected chains that differ from the given one in numbers alone, found another {what}"
    )]
    NotAlike {
        /// Number of the change, from 0.
        index: usize,
        /// What differs.
        what: &'static str,
    },
    /// The simulation would need more steps or more stored samples than is sensible.
    #[error("{quantity}: expected at most {limit:.1e}, found {found:.1e} (hint: {hint})")]
    TooLarge {
        /// What there is too much of.
        quantity: &'static str,
        /// The limit.
        limit: f64,
        /// The number that the input asks for.
        found: f64,
        /// What to change.
        hint: &'static str,
    },
    /// A gap left its table of forces where the force falls, which along the tangent it does for ever.
    #[error(
        "gap {gap}: expected overlaps within its table of forces, found some beyond {end_m} m, where the table ends with a force that falls \
         as the overlap grows past it: nothing would bring the bodies back (hint: points beyond, where the force rises again)"
    )]
    BeyondTable {
        /// Number of the gap: 1 lies between bodies 1 and 2, and 0 between a striker and body 1.
        gap: usize,
        /// The end of the table, in metres.
        end_m: f64,
    },
    /// The motion left the range of numbers.
    #[error("the motion is no longer finite at t = {time_s} s: the step or a parameter is far out of range")]
    NotFinite {
        /// Time of the first output that is not finite, in seconds.
        time_s: f64,
    },
    /// The finest mesh does not reach the accuracy asked for.
    #[error(
        "accuracy: expected meshes to agree within {asked:.1e}, found {reached:.1e} between the two finest (ask for less, \
         shorten the simulation, or soften the striker's contact)"
    )]
    AccuracyNotReached {
        /// Relative accuracy asked for.
        asked: f64,
        /// Relative difference of the two finest meshes.
        reached: f64,
    },
    /// The time step lies beyond the stability bound of velocity Verlet for rings.
    #[error(
        "time step: expected at most {limit_s:.3e} s, the stability bound of velocity Verlet for these rings, found \
         {dt_s:.3e} s (leave the step out to have it chosen)"
    )]
    UnstableStep {
        /// The step asked for, in seconds.
        dt_s: f64,
        /// The largest stable step, in seconds.
        limit_s: f64,
    },
    /// A ring was bent beyond what its elements can tell.
    #[error(
        "before t = {time_s:.3e} s: expected each ring to turn by less than 120 degrees against its unstressed shape from one \
         element to the next, found more (take more elements, a slower striker, or a softer contact)"
    )]
    RingBroken {
        /// A time after which it had happened, in seconds.
        time_s: f64,
    },
    /// Newton's method found no equilibrium of a ring.
    #[error(
        "equilibrium of the ring: expected Newton's method to converge, found none after {steps} steps \
         (take smaller steps of load or displacement, or more elements)"
    )]
    NoEquilibrium {
        /// Steps taken.
        steps: usize,
    },
    /// The striker's contact opened and closed without end.
    #[error(
        "the striker's contact switched {switches} times in a row without a whole step at t = {time_s} s"
    )]
    Chatter {
        /// Time of the last switch, in seconds.
        time_s: f64,
        /// Switches found.
        switches: u32,
    },
}
