//! How the chain moves as it is stated, solved once for all that ask: when its wave comes, how fast it runs, and how bodies answer to the drive.

use std::num::NonZero;

use chainwave_analysis::exact_motion;
use chainwave_measurement::map_in_parallel;
use chainwave_mechanics::{Change, Schedule, Sensitivities, Simulation, simulate_with_sensitivities};
use chainwave_stitching::{HigherOrders, ModelResponse, ResponseSizes, StatedResponse};
use ndarray::{Array2, ArrayView1, s};

use crate::chain::chain_model::STARTING_SHARES;
use crate::chain::measuring::measure_motion;
use crate::configuration::Experiment;
use crate::error::Error;

/// Samples of a motion while a weak wave crosses the chain once...
const SAMPLES: f64 = 2000.0;
/// ...and how often it crosses it at least.
const CROSSINGS: f64 = 1.5;
/// What is kept of a body's motion: until it has moved this share of its way, which holds every onset...
const KEPT: f64 = 0.3;
/// ...from where it has moved this share of that.
const AT_REST: f64 = 1e-5;
/// Relative change of the drive, to both sides, of which its slope is made. A striker's velocity changes what follows in proportion from its first
/// instant on; of a load that a chain is let go from what follows bends, by the square of this.
const CHANGE: f64 = 1e-3;
/// How far drives are from their mean where their scatter is looked at: the stated one, between these. Of drives that differ by less the second order is
/// told badly from a solution's own error, of others that differ by more nothing is known of how the chain would answer.
const LEAST_SCATTER: f64 = 0.02;
const LARGEST_SCATTER: f64 = 0.5;

/// The motion of the stated chain with usual damping: until the recordings end, and at least for as long as a weak wave takes to cross it and half as
/// long again.
pub(crate) struct StatedMotion {
    simulation: Simulation,
    /// How its bodies answer to the drive, body by body.
    pub(crate) responses: Vec<StatedResponse>,
}

impl StatedMotion {
    /// Solves it, and what else it may be, until a time in seconds after the impact.
    ///
    /// # Errors
    /// A chain that cannot be solved.
    pub(crate) fn of(
        experiment: &Experiment,
        until_s: f64,
        n_threads: NonZero<usize>,
    ) -> Result<Self, Error> {
        let scatter = experiment.drive_scatter().clamp(LEAST_SCATTER, LARGEST_SCATTER);
        let [as_usual, more, of_striker] = [[1.0, 1.0], [4.0, 1.0], [1.0, 3.0]]
            .map(|factors: [f64; 2]| [0, 1].map(|k| factors[k] * STARTING_SHARES[k]));
        let cases = [
            (1.0, as_usual),
            (1.0, more),
            (1.0, of_striker),
            (1.0 + scatter, as_usual),
            (1.0 - scatter, as_usual),
        ];
        let [stated, damped_more, struck_softer, stronger, weaker] =
            in_parallel(cases, n_threads, |case| driven(experiment, until_s, case));
        let (stated, stronger, weaker) = (stated?, stronger?, weaker?);
        let otherwise = [&damped_more?, &struck_softer?, &stronger];
        let by_drive = ByDrive::of(scatter, [&weaker, &stated, &stronger]);
        let response = |body: usize| {
            let sizes = by_drive.sizes(body);
            StatedResponse {
                stated: onset(&stated, body),
                otherwise: otherwise.iter().map(|other| onset(other, body)).collect(),
                sizes,
                orders: by_drive.higher_orders(&stated, body, sizes),
            }
        };
        let responses = (0..experiment.chain.n_bodies).map(response).collect();
        Ok(Self { simulation: stated.simulation, responses })
    }

    /// How long after the first body's each body's motion begins, in seconds: it has begun where the body has moved so far.
    pub(crate) fn arrivals_s(&self, moved_m: f64) -> Vec<f64> {
        let motion = &self.simulation.trajectory;
        let arrival_s = |row: ArrayView1<'_, f64>| {
            let arrived = row.iter().position(|x_m| (x_m - row[0]).abs() > moved_m);
            motion.times_s[arrived.map_or(motion.times_s.len() - 1, |frame| frame.saturating_sub(1))]
        };
        motion.displacement_m.rows().into_iter().map(arrival_s).collect()
    }

    /// The leading pulse's speed in metres per second, read off as that of a measured motion is, without what the far end sends back; none where the
    /// chain has no such pulse.
    pub(crate) fn group_velocity_m_per_s(&self, experiment: &Experiment) -> Option<f64> {
        let motion = exact_motion(&self.simulation.trajectory);
        let found = measure_motion(experiment, &motion, None, NonZero::<usize>::MIN).ok()?;
        Some(found.group_velocity.ok()?.velocity_m_per_s.value)
    }
}

/// What comes of each of some cases, in their order.
fn in_parallel<C: Copy + Sync, T: Send + Sync, const N: usize>(
    cases: [C; N],
    n_threads: NonZero<usize>,
    of_case: impl Fn(C) -> T + Sync,
) -> [T; N] {
    let mut found = map_in_parallel(N, n_threads, |case| of_case(cases[case])).into_iter();
    cases.map(|case| found.next().unwrap_or_else(|| of_case(case)))
}

/// A motion and its slope against the drive's relative deviation, with a drive so many times as strong as stated, and dampings of that share of
/// the critical one.
fn driven(
    experiment: &Experiment,
    until_s: f64,
    (strength, shares): (f64, [f64; 2]),
) -> Result<Sensitivities, Error> {
    let linear = experiment.linear_chain()?;
    let crossing_s = linear.crossing_time_s(experiment.chain.n_bodies);
    let dampings = shares.map(|share| share * linear.critical_damping_kg_per_s());
    let duration_s = experiment.while_driven_s(until_s.max(CROSSINGS * crossing_s));
    let stated = experiment.nominal_drive().value;
    let chain = |factor: f64| experiment.chain_driven(factor * strength * stated, dampings, duration_s);
    let by_drive = Change { below: chain(1.0 - CHANGE)?, above: chain(1.0 + CHANGE)?, width: 2.0 * CHANGE };
    let schedule = Schedule::automatic(duration_s, crossing_s / SAMPLES);
    let Sensitivities { mut simulation, derivatives } =
        simulate_with_sensitivities(&chain(1.0)?, &schedule, &[by_drive])?;
    simulation.trajectory = experiment.seen_from_rest(simulation.trajectory);
    let derivatives = derivatives.into_iter().map(|slope| experiment.seen_from_rest(slope)).collect();
    Ok(Sensitivities { simulation, derivatives })
}

/// Of a body's motion and its slope the part that holds the onset.
fn onset(driven: &Sensitivities, body: usize) -> ModelResponse {
    let (motion, slope) = (&driven.simulation.trajectory, &driven.derivatives[0]);
    let motion_m = motion.displacement_m.row(body);
    let furthest_m = motion_m.fold(0.0_f64, |furthest, x_m| furthest.max(x_m.abs()));
    let moved =
        |share: f64| motion_m.iter().position(|x_m| x_m.abs() > share * furthest_m).unwrap_or(motion_m.len());
    let kept = s![moved(AT_REST).saturating_sub(1)..moved(KEPT)];
    ModelResponse {
        interval_s: motion.times_s[1] - motion.times_s[0],
        furthest_m,
        motion_m: motion_m.slice(kept).to_vec(),
        slope_m: slope.displacement_m.row(body).slice(kept).to_vec(),
    }
}

/// The third order's share of the second one at the drives' scatter from which on a response is no series in the drive.
const FALLING: f64 = 0.5;
/// A body that has moved this share of its way counts as reached by the wave.
const REACHED: f64 = 0.05;

/// A body's response to the drive's deviation s at one time: X + s S + s^2 Q + s^3 C.
struct OrdersOfResponse {
    motion_m: f64,
    /// S - X.
    departure_m: f64,
    second_m: f64,
    third_m: f64,
}

/// Motions and their slopes with drives that are weaker by their scatter, as stated, and stronger.
struct ByDrive<'a> {
    scatter: f64,
    motions_m: [&'a Array2<f64>; 3],
    /// Each by the relative change of its own drive.
    slopes_m: [&'a Array2<f64>; 3],
}

impl<'a> ByDrive<'a> {
    fn of(scatter: f64, solved: [&'a Sensitivities; 3]) -> Self {
        Self {
            scatter,
            motions_m: solved.map(|one| &one.simulation.trajectory.displacement_m),
            slopes_m: solved.map(|one| &one.derivatives[0].displacement_m),
        }
    }

    /// The orders of a body's response, by time: of X(s) those in the drive's deviation s from values and slopes at -h, 0 and h.
    ///
    /// With X(s) = X + s S + s^2 Q + s^3 C + s^4 R the mean of both sides is X + h^2 Q + h^4 R, half the difference of their slopes 2 h Q + 4 h^3 R, and
    /// the mean of these S + 3 h^2 C.
    fn orders_m(&self, body: usize) -> impl Iterator<Item = OrdersOfResponse> + '_ {
        let h = self.scatter;
        let [weaker_m, stated_m, stronger_m] = self.motions_m.map(|motion_m| motion_m.row(body));
        let [slope_of_weaker_m, slope_m, slope_of_stronger_m] =
            self.slopes_m.map(|slope_m| slope_m.row(body));
        (0..stated_m.len()).map(move |i| {
            let x_m = stated_m[i];
            let slopes_m = [slope_of_weaker_m[i] / (1.0 - h), slope_of_stronger_m[i] / (1.0 + h)];
            let bent_m = 0.5 * (weaker_m[i] + stronger_m[i]) - x_m;
            OrdersOfResponse {
                motion_m: x_m,
                departure_m: slope_m[i] - x_m,
                second_m: 2.0 * bent_m / h.powi(2) - (slopes_m[1] - slopes_m[0]) / (4.0 * h),
                third_m: (0.5 * (slopes_m[0] + slopes_m[1]) - slope_m[i]) / (3.0 * h.powi(2)),
            }
        })
    }

    /// What a body's response has beyond its slope, over the stated motion; nothing where orders do not fall at these drives, as where gaps snap.
    fn higher_orders(&self, stated: &Sensitivities, body: usize, sizes: ResponseSizes) -> HigherOrders {
        if self.scatter * sizes.third_order > FALLING * sizes.curvature {
            return HigherOrders::default();
        }
        let motion = &stated.simulation.trajectory;
        let furthest_m =
            self.orders_m(body).fold(0.0_f64, |furthest, orders| furthest.max(orders.motion_m.abs()));
        let reached_m = REACHED * furthest_m;
        let reached = self.orders_m(body).position(|orders| orders.motion_m.abs() > reached_m).unwrap_or(0);
        let orders_m = self.orders_m(body).map(|orders| [orders.second_m, orders.third_m]);
        HigherOrders {
            interval_s: motion.times_s[1] - motion.times_s[0],
            reached_m,
            reached,
            orders_m: orders_m.collect(),
        }
    }

    /// How large a body's response is.
    fn sizes(&self, body: usize) -> ResponseSizes {
        let mut squares = [0.0; 5];
        for OrdersOfResponse { motion_m, departure_m, second_m, third_m } in self.orders_m(body) {
            let orders_m = [motion_m, departure_m, second_m, second_m - departure_m, third_m];
            squares.iter_mut().zip(orders_m).for_each(|(sum, order_m)| *sum += order_m * order_m);
        }
        let [of_motion, slope, curvature, non_linearity, third_order] = squares;
        let size = |of_order: f64| if of_motion > 0.0 { (of_order / of_motion).sqrt() } else { 0.0 };
        ResponseSizes {
            slope: size(slope),
            curvature: size(curvature),
            non_linearity: size(non_linearity),
            third_order: size(third_order),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_of_a_response_are_told_apart() {
        const ORDERS: [f64; 5] = [1.0, 1.3, -0.4, 0.7, 2.0];
        let h = 0.05;
        let at = |s: f64| (0..5).map(|k| ORDERS[k as usize] * s.powi(k)).sum::<f64>();
        let by_s = |s: f64| (1..5).map(|k| f64::from(k) * ORDERS[k as usize] * s.powi(k - 1)).sum::<f64>();
        let of = |value: f64| Array2::from_elem((1, 3), value);
        let motions_m = [-h, 0.0, h].map(|s| of(at(s)));
        let slopes_m = [-h, 0.0, h].map(|s| of((1.0 + s) * by_s(s)));
        let by_drive = ByDrive { scatter: h, motions_m: motions_m.each_ref(), slopes_m: slopes_m.each_ref() };
        let found = by_drive.sizes(0);
        // S - X = 0.3; Q less that is -0.7. A polynomial of fourth order is told exactly, but for roundings over h^2.
        for (found, expected) in
            [(found.slope, 0.3), (found.curvature, 0.4), (found.non_linearity, 0.7), (found.third_order, 0.7)]
        {
            assert!((found - expected).abs() < 1e-11, "{found} {expected}");
        }
    }

    #[test]
    fn springs_answer_in_proportion_and_a_softening_chain_does_not() {
        let small = include_str!("../../../../tests/small-experiment/experiment.toml");
        let largest = |text: &str| {
            let experiment: Experiment = toml::from_str(text).unwrap();
            let motion = StatedMotion::of(&experiment, 0.0, NonZero::<usize>::MIN).unwrap();
            motion.responses.iter().map(|one| one.sizes.slope.max(one.sizes.third_order)).fold(0.0, f64::max)
        };
        let softening = largest(small);
        // The range that the usual sizes were looked up in.
        assert!((0.1..1.0).contains(&softening), "{softening}");
        let law = small
            .lines()
            .skip_while(|line| !line.starts_with("[contact]"))
            .take_while(|line| !line.is_empty());
        let law: Vec<&str> = law.collect();
        let springs = small.replace(&law.join("\n"), "[contact]\nlaw = \"linear\"\nk_n_per_m = 1474.0");
        assert_ne!(springs, small);
        // Steps that differ between drives leave an accuracy of 1e-6, a derivative some 1e-7 of its largest value, over 3 h^2 = 1.2e-3.
        let proportional = largest(&springs);
        assert!(proportional < 3e-3, "{proportional}");
    }
}
