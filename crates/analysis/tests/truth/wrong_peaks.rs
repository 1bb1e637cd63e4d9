//! Peaks that are not the pulse's: of a reflection in a short chain, or of the edge of a hole in the record.

use chainwave_analysis::{MeasureSettings, Missing, exact_motion, measure, replicate};
use chainwave_measurement::ChainMotion;
use chainwave_mechanics::FarEnd;

use crate::common::{INTERVAL_S, PITCH_M, motion_of_strain, paper_chain, with_sigma};

fn settings() -> MeasureSettings {
    MeasureSettings { n_replicas: 20, ..MeasureSettings::new(PITCH_M, 3) }
}

/// What a long chain says of the same gaps.
fn true_m_per_s() -> f64 {
    let long = exact_motion(&paper_chain(26, 2.73, FarEnd::Free, 0.009).trajectory);
    let settings = MeasureSettings { velocity_gaps: Some(3..=6), ..settings() };
    measure(&long, &settings, None).unwrap().group_velocity.unwrap().velocity_m_per_s.value
}

#[test]
fn short_chains_have_the_group_velocity_of_long_ones_or_none() {
    let truth = true_m_per_s();
    let mut n_measured = 0;
    for (n_bodies, end_reflects) in (4..=12).flat_map(|n| [(n, true), (n, false)]) {
        for far_end in [FarEnd::Free, FarEnd::Fixed] {
            let motion = exact_motion(&paper_chain(n_bodies, 2.73, far_end, 0.017).trajectory);
            let settings = MeasureSettings { end_reflects, ..settings() };
            let found = measure(&with_sigma(motion, 1e-6), &settings, None).unwrap();
            let Ok(speed) = found.group_velocity else {
                let reason = found.group_velocity.unwrap_err();
                let reasons = [
                    Missing::TooFewGaps,
                    Missing::NotOneLine,
                    Missing::ReflectionUntold,
                    Missing::NoProgress,
                ];
                assert!(reasons.contains(&reason), "{reason:?}");
                assert!(found.half_widths.is_empty() || reason == Missing::Unstable, "{n_bodies}");
                continue;
            };
            n_measured += 1;
            // The speed grows by a tenth along the chain. That an end reflects and is said not to is not for the analysis to find, but where the reflection leaves nothing of
            // a line; else it shows in the variation along the chain.
            let error = (speed.velocity_m_per_s.value / truth - 1.0).abs();
            assert!(error < 0.1 || !end_reflects, "{n_bodies}: {speed:?}, {truth}");
            let varies = speed.relative_variation.is_some_and(|variation| variation.value.abs() > 0.2);
            assert!(error < 0.1 || varies, "{n_bodies}: {speed:?}, {truth}");
        }
    }
    assert!(n_measured > 8, "{n_measured}");
}

#[test]
fn a_reflection_of_which_nothing_is_known_leaves_no_velocity() {
    let mut motion = exact_motion(&paper_chain(12, 2.73, FarEnd::Free, 0.017).trajectory);
    // The record begins behind the feet of the first eight gaps, at whose end a reflection's peaks would pass for the pulse's.
    let peaks = measure(&motion, &settings(), None).unwrap().fronts;
    let begins_s = peaks[8].unwrap().peak_time_s.value - 4.0 * INTERVAL_S;
    for (row, mut of_body) in motion.displacement_m.rows_mut().into_iter().enumerate() {
        let times = motion.times_s.iter().zip(&mut of_body);
        times.filter(|(t_s, _)| row < 8 && **t_s < begins_s).for_each(|(_, x)| *x = None);
    }
    let found = measure(&motion, &settings(), None).unwrap();
    assert!(found.group_velocity.is_err() && found.half_widths.is_empty(), "{:?}", found.group_velocity);
}

/// A pulse of 3 % that runs a gap each 0.6 ms, and a body that is lost for a while as it passes.
fn with_hole(centre_s: f64, length_s: f64) -> ChainMotion {
    let strain = |gap: usize, t_s: f64| -0.03 / ((t_s - peak_s(gap)) / 0.5e-3).cosh().powi(2);
    let mut motion = with_sigma(motion_of_strain(6, 300, strain), 1e-6);
    for (t_s, x) in motion.times_s.iter().zip(motion.displacement_m.row_mut(3)) {
        if (t_s - centre_s).abs() < 0.5 * length_s {
            *x = None;
        }
    }
    motion
}

fn peak_s(gap: usize) -> f64 {
    2e-3 + 0.6e-3 * gap as f64
}

#[test]
fn the_edge_of_a_hole_is_no_peak() {
    let (mut n_found, mut n_lost) = (0, 0);
    for length in [4, 7, 12, 20, 35, 50] {
        for centre in (-20..=20).step_by(2) {
            let length_s = f64::from(length) * INTERVAL_S;
            let stated = with_hole(peak_s(3) + f64::from(centre) * INTERVAL_S, length_s);
            let motion = replicate(&stated, 1, (100 * length + centre + 20) as u64).next().unwrap();
            let found = measure(&motion, &settings(), None).unwrap();
            for gap in [3, 4] {
                let Ok(front) = found.fronts[gap - 1] else {
                    n_lost += 1;
                    continue;
                };
                n_found += 1;
                // Some hundreds of peaks: none farther than 6 sigma, and beside a hole than an interval for what the polynomial leaves. Edges are off by tens of either.
                let error_s = front.peak_time_s.value - peak_s(gap);
                let allowed_s = (6.0 * front.peak_time_s.sigma).hypot(INTERVAL_S);
                assert!(error_s.abs() < allowed_s, "gap {gap}, {length} at {centre}: {error_s:e} s");
            }
        }
    }
    // Most of these holes take the peak of one gap or of both.
    assert!(n_found > 60 && n_lost > 60, "{n_found} {n_lost}");
    // One that begins when both have fallen costs neither.
    let found = measure(&with_hole(peak_s(4) + 1.5e-3, 2e-3), &settings(), None).unwrap();
    assert!(found.fronts.iter().all(Result::is_ok), "{:?}", found.fronts);
}

/// A second hump follows each gap's pulse, and a body is lost until the pulse has nearly passed, or has passed and left the gap open.
#[test]
fn a_later_hump_is_not_taken_for_the_pulse_that_a_hole_hides() {
    let hump = |t_s: f64, height: f64| height / (t_s / 0.5e-3).cosh().powi(2);
    let strain = |gap: usize, t_s: f64| {
        let since_s = t_s - peak_s(gap);
        hump(since_s - 5e-3, -0.02) + hump(since_s - 2.5e-3, 0.01) + hump(since_s, -0.03)
    };
    let lost = |from_s: f64, until_s: f64| {
        let mut motion = with_sigma(motion_of_strain(6, 400, strain), 1e-6);
        for (t_s, x) in motion.times_s.iter().zip(motion.displacement_m.row_mut(3)) {
            if (from_s..until_s).contains(t_s) {
                *x = None;
            }
        }
        measure(&motion, &settings(), None).unwrap().fronts
    };
    for behind_s in [0.3e-3, 0.6e-3, 1e-3, 2e-3, 2.5e-3] {
        let fronts = lost(peak_s(3) - 1.5e-3, peak_s(4) + behind_s);
        for gap in [3, 4] {
            assert!(
                fronts[gap - 1].is_err(),
                "gap {gap}, {behind_s} s behind its peak: {:?}",
                fronts[gap - 1]
            );
        }
        assert!(fronts[0].is_ok() && fronts[5].is_ok());
    }
    // A hole that is over before the pulse comes costs nothing.
    assert!(lost(0.5e-3, 1.2e-3).iter().all(Result::is_ok));
}
