//! One least-squares solver for all fits: Gauss-Newton steps with Marquardt's damping, between bounds, from several starts, and at the
//! minimum the covariance or the unknowns that have none.
//!
//! Problems differ in what they compare; what they hand over is alike: their normal equations ([`NormalEquations`]), in which the unknowns
//! of single recordings border those that all share. A dense problem has no recordings. The crate `levenberg-marquardt` wants the whole
//! Jacobian, residuals apart from derivatives, and knows no bounds: a fit to tracks has up to a million residuals, gets its derivatives along
//! with them from the same simulations, and has unknowns that end at zero.

mod bordered;
mod problem;
mod step;

pub(crate) use bordered::{
    Block, JointCovariance, N_OWN, NormalEquations, Own, OwnCovariance, Profiled, Reduced, RestSums, Row,
    SharedProducts, SharedSystem, Weights,
};
pub(crate) use problem::{Bounds, Failure, LeastSquares, Unknowns};
pub(crate) use step::within;

use nalgebra::DMatrix;
use step::{Step, constrained_step};

/// Marquardt's damping at least after a step that went wrong.
const FIRST_DAMPING: f64 = 1e-3;
/// Below this it counts as none.
const LEAST_DAMPING: f64 = 1e-9;
/// Beyond this a step is no step.
const MOST_DAMPING: f64 = 1e12;
/// Factor on the damping after a step that went wrong, and its inverse after one that did not.
const DAMPING_FACTOR: f64 = 10.0;
/// How far rounding may raise a sum of squares, relative to it.
const ROUNDING: f64 = 1e-12;
/// Rounds in a row of which none made the sum of squares fall by what a short step is worth: along a kink of the model steps stay long.
const STALLED_ROUNDS: usize = 8;
/// A search that may be given up ([`Stop::worth`]) is, where so many times what the next step promises is too little: a model may bend, and
/// a step along it then promises less than the way brings.
const GIVE_UP_FACTOR: f64 = 4.0;
/// Rounds in a row that promise too little: the first one stands where the step before it was right.
const POOR_ROUNDS: usize = 2;
/// Minima whose sums of squares differ by less, in units of the noise's variance, are one.
const SAME_MINIMUM: f64 = 0.1;

/// When a search ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stop {
    /// A step shorter than this, in standard errors, changes nothing.
    pub(crate) step: f64,
    /// Rounds after which it has failed.
    pub(crate) max_rounds: usize,
    /// Marquardt's damping at the start.
    pub(crate) first_damping: f64,
    /// The sum of squares below which a minimum is worth anything: a search that does not promise to come there is given up.
    pub(crate) worth: f64,
}

impl Stop {
    /// The rule where errors are stated: a hundredth of a standard error.
    pub(crate) const STATED: Self =
        Self { step: 1e-2, max_rounds: 60, first_damping: FIRST_DAMPING, worth: f64::INFINITY };

    /// Whether a step changes nothing, by the square of its length in standard errors.
    fn is_short(&self, length2: f64) -> bool {
        length2 < self.step * self.step
    }
}

/// Where a search ended.
#[derive(Debug, Clone)]
pub(crate) struct Minimum {
    pub(crate) at: Unknowns,
    pub(crate) equations: NormalEquations,
    /// Shared unknowns that were held at their values.
    held: Vec<usize>,
}

impl Minimum {
    pub(crate) fn chi_squared(&self) -> f64 {
        self.equations.chi_squared()
    }

    /// Whether a step from a place with such a sum of squares, which is not below the minimum's, leads so near to it that the sums there are one.
    fn is_met_by(&self, chi_squared: f64, trial: &Unknowns) -> bool {
        let away = trial.less(&self.at);
        chi_squared >= self.chi_squared() && self.equations.length2(&away.shared, &away.own) < SAME_MINIMUM
    }

    /// The equations without the recordings' own unknowns, and the covariance of the shared ones in units of the residuals' variance.
    pub(crate) fn solved<E>(&self) -> Result<(Reduced, DMatrix<f64>), Failure<E>> {
        let reduced = self.equations.reduced(0.0).ok_or(Failure::Undetermined(Vec::new()))?;
        let mut system = reduced.system();
        self.held.iter().for_each(|unknown| system.hold(*unknown));
        let mut covariance = system.covariance().map_err(Failure::Undetermined)?;
        self.held.iter().for_each(|unknown| covariance[(*unknown, *unknown)] = 0.0);
        Ok((reduced, covariance))
    }
}

/// The least minimum of several starts.
#[derive(Debug, Clone)]
pub(crate) struct Best {
    pub(crate) minimum: Minimum,
    /// Starts whose search ended there.
    pub(crate) n_same: usize,
}

/// Follows every start to its minimum, the shared unknowns `held` at their values; a start that fails counts only when all do.
pub(crate) fn least_of<P: LeastSquares>(
    problem: &P,
    starts: impl IntoIterator<Item = Unknowns>,
    held: &[usize],
    stop: &Stop,
) -> Result<Best, Failure<P::Error>> {
    least_beside(problem, starts, held, stop, Vec::new())
}

/// The same where `minima` are known beforehand: they count among those that are found.
pub(crate) fn least_beside<P: LeastSquares>(
    problem: &P,
    starts: impl IntoIterator<Item = Unknowns>,
    held: &[usize],
    stop: &Stop,
    mut minima: Vec<Minimum>,
) -> Result<Best, Failure<P::Error>> {
    let mut failed = Failure::Unsettled { rounds: 0 };
    for start in starts {
        match followed(problem, start, held, stop, &minima) {
            Ok(minimum) => minima.push(minimum),
            Err(failure) => failed = failure,
        }
    }
    let sums: Vec<f64> = minima.iter().map(Minimum::chi_squared).collect();
    let Some(minimum) = minima.into_iter().min_by(|a, b| a.chi_squared().total_cmp(&b.chi_squared())) else {
        return Err(failed);
    };
    let least = minimum.chi_squared();
    let same = least + SAME_MINIMUM;
    Ok(Best { minimum, n_same: sums.iter().filter(|sum| **sum < same).count() })
}

/// Follows a start to its minimum; the shared unknowns `held` stay at their values.
pub(crate) fn minimise<P: LeastSquares>(
    problem: &P,
    start: Unknowns,
    held: &[usize],
    stop: &Stop,
) -> Result<Minimum, Failure<P::Error>> {
    followed(problem, start, held, stop, &[])
}

/// The same, unless the search leads to one of the minima that are known, which is then its end.
fn followed<P: LeastSquares>(
    problem: &P,
    start: Unknowns,
    held: &[usize],
    stop: &Stop,
    known: &[Minimum],
) -> Result<Minimum, Failure<P::Error>> {
    let Descent { at, here, last } = descend(problem, start, held, stop, known)?;
    let minimum = Minimum { at, equations: here, held: held.to_vec() };
    let Some(LastStep { to: at, .. }) = last else { return Ok(minimum) };
    // Where the problem refuses the last step, which is short, the minimum is as good without it.
    match problem.equations(&at) {
        Ok(there) if !rises(minimum.chi_squared(), there.chi_squared()) => {
            Ok(Minimum { at, equations: there, ..minimum })
        }
        _ => Ok(minimum),
    }
}

/// The sum of squares at the minimum that [`minimise`] finds, as the equations foretell it one short step before it: there they are linear to the
/// square of the step's length in standard errors.
pub(crate) fn least_chi_squared<P: LeastSquares>(
    problem: &P,
    start: Unknowns,
    held: &[usize],
    stop: &Stop,
) -> Result<f64, Failure<P::Error>> {
    let Descent { here, last, .. } = descend(problem, start, held, stop, &[])?;
    Ok(here.chi_squared() - last.map_or(0.0, |last| last.fall))
}

/// A search up to its last step.
struct Descent {
    at: Unknowns,
    here: NormalEquations,
    last: Option<LastStep>,
}

/// A step that is too short for another one after it.
struct LastStep {
    to: Unknowns,
    /// By how much the sum of squares falls to the minimum, were the problem linear.
    fall: f64,
}

fn descend<P: LeastSquares>(
    problem: &P,
    start: Unknowns,
    held: &[usize],
    stop: &Stop,
    known: &[Minimum],
) -> Result<Descent, Failure<P::Error>> {
    let bounds = problem.bounds();
    let mut at = bounds.nearest(start);
    let mut here = problem.equations(&at).map_err(Failure::Problem)?;
    let mut damping = stop.first_damping;
    let (mut n_stalled, mut n_poor) = (0, 0);
    // Why the problem refused a step since the last one that made a difference: then a search that ends ends before what is refused, at no minimum.
    let mut refused = None;
    for round in 0..stop.max_rounds {
        let Some(Step { step, length2, fall }) = constrained_step(&here, &at, bounds, held, damping) else {
            damping = raised(damping);
            if damping > MOST_DAMPING {
                return Err(Failure::Undetermined(undetermined(&here, held)));
            }
            continue;
        };
        let trial = bounds.nearest(at.moved(&step));
        if stop.is_short(length2) {
            return Ok(Descent { at, here, last: Some(LastStep { to: trial, fall }) });
        }
        if let Some(met) = known.iter().find(|minimum| minimum.is_met_by(here.chi_squared(), &trial)) {
            return Ok(Descent { at: met.at.clone(), here: met.equations.clone(), last: None });
        }
        let is_poor = GIVE_UP_FACTOR * length2 < here.chi_squared() - stop.worth;
        n_poor = if is_poor { n_poor + 1 } else { 0 };
        if n_poor == POOR_ROUNDS {
            return Err(Failure::GivenUp { rounds: round });
        }
        let there = match problem.equations(&trial) {
            Ok(there) => there,
            // A step into values that the problem refuses is as wrong as one that rises, and a shorter one may not be.
            Err(why) => {
                damping = raised(damping);
                if damping > MOST_DAMPING {
                    return Err(Failure::Problem(why));
                }
                refused = Some(why);
                continue;
            }
        };
        if rises(here.chi_squared(), there.chi_squared()) {
            // At a kink of the model no step is short, but the shortest that is worth a try goes up on both sides.
            if fall < ROUNDING * here.chi_squared() {
                return refused
                    .map_or(Ok(Descent { at, here, last: None }), |why| Err(Failure::Problem(why)));
            }
            damping = raised(damping);
            continue;
        }
        if stop.is_short(here.chi_squared() - there.chi_squared()) {
            n_stalled += 1;
        } else {
            (n_stalled, refused) = (0, None);
        }
        (at, here) = (trial, there);
        damping = if damping > LEAST_DAMPING { damping / DAMPING_FACTOR } else { 0.0 };
        if n_stalled == STALLED_ROUNDS {
            return refused.map_or(Ok(Descent { at, here, last: None }), |why| Err(Failure::Problem(why)));
        }
    }
    Err(refused.map_or(Failure::Unsettled { rounds: stop.max_rounds }, Failure::Problem))
}

/// Whether a step from one sum of squares to another one went wrong.
fn rises(here: f64, there: f64) -> bool {
    there.is_nan() || there > here * (1.0 + ROUNDING)
}

fn raised(damping: f64) -> f64 {
    (DAMPING_FACTOR * damping).max(FIRST_DAMPING)
}

fn undetermined(equations: &NormalEquations, held: &[usize]) -> Vec<usize> {
    let system = equations.reduced(0.0).and_then(|reduced| {
        let mut system = reduced.system();
        held.iter().for_each(|unknown| system.hold(*unknown));
        system.covariance().err()
    });
    system.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;

    /// y = a exp(-b x), with derivatives by a and b, and a third unknown that may change nothing.
    struct Decay {
        y: Vec<f64>,
        bounds: Bounds,
    }

    impl Decay {
        fn of(a: f64, b: f64, bounds: Vec<(f64, f64)>) -> Self {
            let y = (0..30).map(|k| a * (-b * 0.1 * f64::from(k)).exp()).collect();
            Self { y, bounds: Bounds::dense(bounds) }
        }
    }

    impl LeastSquares for Decay {
        type Error = ();

        fn bounds(&self) -> &Bounds {
            &self.bounds
        }

        fn equations(&self, at: &Unknowns) -> Result<NormalEquations, ()> {
            let mut equations = NormalEquations::new(at.shared.len());
            for (k, y) in self.y.iter().enumerate() {
                let x = 0.1 * k as f64;
                let decayed = (-at.shared[1] * x).exp();
                let mut row = vec![decayed, -at.shared[0] * x * decayed, 0.0];
                row.truncate(at.shared.len());
                row.push(at.shared[0] * decayed - y);
                equations.add_row(&row);
            }
            Ok(equations)
        }
    }

    const FREE: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

    fn start(values: &[f64]) -> Unknowns {
        Unknowns::dense(DVector::from_column_slice(values))
    }

    #[test]
    fn it_finds_a_minimum_from_afar() {
        let problem = Decay::of(3.0, 1.5, vec![FREE; 2]);
        let found =
            least_of(&problem, [start(&[1.0, 0.0]), start(&[10.0, 4.0])], &[], &Stop::STATED).unwrap();
        assert_eq!(found.n_same, 2);
        let alone = minimise(&problem, start(&[1.0, 0.0]), &[], &Stop::STATED).unwrap();
        assert_eq!(found.minimum.at, alone.at, "the second search ends near what the first one found");
        // The last step was below 1e-2 of a standard error (some 0.5 here), and converges quadratically.
        assert!((found.minimum.at.shared - DVector::from_column_slice(&[3.0, 1.5])).amax() < 1e-4);
    }

    #[test]
    fn an_unknown_stays_at_its_bound_and_the_others_find_their_place() {
        let problem = Decay::of(3.0, -0.2, vec![FREE, (0.0, f64::INFINITY)]);
        let found = minimise(&problem, start(&[1.0, 1.0]), &[], &Stop::STATED).unwrap();
        assert!(found.at.shared[1].abs() < f64::MIN_POSITIVE, "{:?}", found.at);
        // A constant's best value is the mean.
        let mean = problem.y.iter().sum::<f64>() / problem.y.len() as f64;
        // The last step was below a hundredth of a standard error (0.2) and at most a thousandth of it was left: Marquardt's damping.
        assert!((found.at.shared[0] - mean).abs() < 2e-6, "{:?}", found.at);
    }

    #[test]
    fn an_unknown_that_is_held_stays() {
        let problem = Decay::of(3.0, 1.5, vec![FREE; 2]);
        let found = minimise(&problem, start(&[1.0, 1.2]), &[1], &Stop::STATED).unwrap();
        assert!((found.at.shared[1] - 1.2).abs() < f64::EPSILON);
        let decayed: Vec<f64> = (0..30).map(|k| (-1.2 * 0.1 * f64::from(k)).exp()).collect();
        let products: f64 = decayed.iter().zip(&problem.y).map(|(left, right)| left * right).sum();
        let best = products / decayed.iter().map(|value| value * value).sum::<f64>();
        // The last step was below a hundredth of a standard error (0.3) and at most a thousandth of it was left: Marquardt's damping.
        assert!((found.at.shared[0] - best).abs() < 3e-6, "{:?}", found.at);
    }

    #[test]
    fn the_least_sum_of_squares_is_that_of_the_minimum() {
        let problem = Decay::of(3.0, 1.5, vec![FREE; 2]);
        for held in [&[][..], &[1]] {
            let found = minimise(&problem, start(&[1.0, 1.2]), held, &Stop::STATED).unwrap();
            let least = least_chi_squared(&problem, start(&[1.0, 1.2]), held, &Stop::STATED).unwrap();
            // The step that is foretold is below a hundredth of a standard error, and so falls by less than its square.
            assert!((least - found.chi_squared()).abs() < 1e-4, "{least} {}", found.chi_squared());
        }
    }

    #[test]
    fn a_search_that_promises_too_little_is_given_up_and_one_that_arrives_is_not() {
        let problem = Decay::of(3.0, 1.5, vec![FREE; 2]);
        let from_afar = |worth: f64| {
            let stop = Stop { worth, ..Stop::STATED };
            minimise(&problem, start(&[10.0, 4.0]), &[], &stop).map(|found| found.at)
        };
        assert_eq!(from_afar(1.0), from_afar(f64::INFINITY));
        // No step promises a sum of squares so far below zero: the second one that says so is the last.
        assert_eq!(from_afar(-1e6), Err(Failure::GivenUp { rounds: POOR_ROUNDS - 1 }));
    }

    #[test]
    fn a_search_ends_where_it_leads_to_a_minimum_that_is_known_and_not_where_it_leads_below() {
        let problem = Decay::of(3.0, 1.5, vec![FREE; 2]);
        let followed_beside = |known: &[Minimum]| {
            let asked = Counted { problem: &problem, n: 0.into() };
            let found = followed(&asked, start(&[10.0, 4.0]), &[], &Stop::STATED, known).unwrap();
            (found.at, asked.n.into_inner())
        };
        let known = minimise(&problem, start(&[1.0, 0.0]), &[], &Stop::STATED).unwrap();
        let (alone, to_the_end) = followed_beside(&[]);
        let (met, until_met) = followed_beside(std::slice::from_ref(&known));
        assert_eq!(met, known.at);
        assert!(until_met < to_the_end, "{until_met} of {to_the_end}");
        // A minimum that is lower than the known one, and one that is elsewhere, are followed to their end.
        let above = Minimum { equations: problem.equations(&start(&[2.0, 0.5])).unwrap(), ..known.clone() };
        let elsewhere = Minimum { at: start(&[2.0, 0.5]), ..known };
        for other in [above, elsewhere] {
            assert_eq!(followed_beside(&[other]), (alone.clone(), to_the_end));
        }
    }

    /// A problem that counts how often its equations are asked for.
    struct Counted<'a> {
        problem: &'a Decay,
        n: std::cell::Cell<usize>,
    }

    impl LeastSquares for Counted<'_> {
        type Error = ();

        fn bounds(&self) -> &Bounds {
            self.problem.bounds()
        }

        fn equations(&self, at: &Unknowns) -> Result<NormalEquations, ()> {
            self.n.set(self.n.get() + 1);
            self.problem.equations(at)
        }
    }

    /// A problem that refuses a decay as slow as a bound, or slower.
    struct Refusing {
        problem: Decay,
        from: f64,
    }

    impl LeastSquares for Refusing {
        type Error = ();

        fn bounds(&self) -> &Bounds {
            self.problem.bounds()
        }

        fn equations(&self, at: &Unknowns) -> Result<NormalEquations, ()> {
            if at.shared[1] <= self.from { Err(()) } else { self.problem.equations(at) }
        }
    }

    #[test]
    fn a_step_into_values_that_are_refused_is_shortened_and_ends_no_search() {
        // From a fast decay the first step goes far beyond the slow one that is true, to a growth.
        let from_afar = start(&[3.0, 1.5]);
        let problem = Decay::of(3.0, 0.2, vec![FREE; 2]);
        let first = problem.equations(&from_afar).unwrap();
        let step = constrained_step(&first, &from_afar, problem.bounds(), &[], FIRST_DAMPING).unwrap();
        assert!(from_afar.shared[1] + step.step.shared[1] < 0.0, "{:?}", step.step);
        let refusing = Refusing { problem, from: 0.0 };
        let found = minimise(&refusing, from_afar, &[], &Stop::STATED).unwrap();
        assert!((found.at.shared - DVector::from_column_slice(&[3.0, 0.2])).amax() < 1e-3);
        // Where the way to the minimum is closed the reason is told.
        let closed = Refusing { problem: Decay::of(3.0, -0.5, vec![FREE; 2]), from: 0.0 };
        let found = minimise(&closed, start(&[3.0, 1e-9]), &[], &Stop::STATED);
        assert_eq!(found.err(), Some(Failure::Problem(())));
        // Values that are refused at once are.
        let found = minimise(&refusing, start(&[3.0, -1.0]), &[], &Stop::STATED);
        assert_eq!(found.err(), Some(Failure::Problem(())));
    }

    #[test]
    fn what_nothing_depends_on_is_named() {
        let problem = Decay::of(3.0, 1.5, vec![FREE; 3]);
        let found = minimise(&problem, start(&[1.0, 1.0, 7.0]), &[], &Stop::STATED);
        assert_eq!(found.err(), Some(Failure::Undetermined(vec![2])));
    }
}
