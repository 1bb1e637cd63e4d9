//! When the chain was struck, roughly: where a fit to the tracks begins.

use chainwave_measurement::{ChainMotion, Estimate};
use chainwave_mechanics::{Bodies, Chain, Integration, MechanicsError, Schedule, simulate};

/// Share of its farthest displacement at which the first body has left its place.
const LEVEL: f64 = 0.05;
/// Accuracy that a rough time needs.
const ACCURACY: f64 = 1e-3;
/// Samples of the motion over the time that it is compared for.
const N_SAMPLES: f64 = 1000.0;
/// A body that has moved by less than so many standard uncertainties has not been struck.
const LEAST_SIGMAS: f64 = 20.0;

/// How long after t = 0 the chain was struck, in seconds, as the body nearest to the striker leaves its place then, and as long after the strike
/// as the chain model says; 0 where that is less than a quarter of a period of the chain's fastest oscillation, which is as far as a search
/// finds by itself, or where no body tells it.
///
/// A camera triggers within some hundred microseconds of the strike, but a recording without a trigger begins at its own first frame.
///
/// # Errors
/// What the chain model refuses.
pub(crate) fn first_impact_s(motion: &ChainMotion, chain: &Chain) -> Result<f64, MechanicsError> {
    let first =
        motion.displacement_m.outer_iter().enumerate().find(|(_, x)| x.iter().flatten().any(has_moved));
    let Some((row, seen)) = first else { return Ok(0.0) };
    let farthest_m = seen.iter().flatten().map(|x| x.value.abs()).fold(0.0, f64::max);
    let has_left = |x_m: f64| x_m.abs() > LEVEL * farthest_m;
    let left = seen.iter().position(|x| x.is_some_and(|x| has_left(x.value) && has_moved(&x)));
    let Some(left_s) = left.map(|i| motion.times_s[i]) else { return Ok(0.0) };
    let duration_s = motion.times_s.last().map_or(0.0, |last_s| last_s - motion.times_s[0]);
    let schedule = Schedule {
        duration_s,
        output_interval_s: duration_s / N_SAMPLES,
        integration: Integration::Automatic { accuracy: ACCURACY },
        bodies: Bodies::Reached,
    };
    let moved = simulate(chain, &schedule)?.trajectory;
    let of_body = moved.displacement_m.row(row);
    let held_m = of_body.first().copied().unwrap_or(0.0);
    let arrival = of_body.iter().position(|x_m| has_left(x_m - held_m));
    let Some(arrival_s) = arrival.map(|i| moved.times_s[i]) else { return Ok(0.0) };
    let impact_s = left_s - arrival_s;
    // Bodies that hardly touch have no such period, and a wave that needs some time to them instead.
    let reach_s = chain.linear().map_or(arrival_s, |linear| 0.25 / linear.band_edge_hz());
    Ok(if impact_s.abs() > reach_s { impact_s } else { 0.0 })
}

fn has_moved(x: &Estimate) -> bool {
    x.value.abs() > LEAST_SIGMAS * x.sigma
}

#[cfg(test)]
mod tests {
    use chainwave_mechanics::{Drive, Striker};

    use super::*;

    #[test]
    fn a_strike_behind_the_first_frame_is_found_from_the_body_that_is_seen_first() {
        let chain = Chain {
            drive: Drive::Striker(Striker { velocity_m_per_s: 1.89, ..Striker::OF_RINGS }),
            ..Chain::of_rings(12)
        };
        let moved = simulate(&chain, &Schedule::automatic(0.012, 1e-5)).unwrap().trajectory;
        // Body 3 and those behind it, every 40 us to 2 um.
        let seen = |struck_s: f64| {
            let mut motion = ChainMotion::unseen(12, (0..300).map(|k| 4e-5 * f64::from(k)).collect());
            for (k, time_s) in motion.times_s.clone().into_iter().enumerate() {
                for row in 2..12 {
                    let x_m = moved.at(time_s - struck_s).map_or(0.0, |at| at.displacement_m(row));
                    motion.displacement_m[(row, k)] = Some(Estimate::new(x_m, 2e-6));
                }
            }
            motion
        };
        let reach_s = 0.25 / chain.linear().unwrap().band_edge_hz();
        for struck_s in [1.2e-3, 4e-3] {
            let found_s = first_impact_s(&seen(struck_s), &chain).unwrap();
            assert!((found_s - struck_s).abs() < 0.25 * reach_s, "{found_s} of {struck_s}");
        }
        assert_eq!(first_impact_s(&seen(1e-4), &chain).unwrap().to_bits(), 0, "a search finds it by itself");
        let unseen = ChainMotion::unseen(12, vec![0.0, 1e-4]);
        assert_eq!(first_impact_s(&unseen, &chain).unwrap().to_bits(), 0);
    }
}
