//! Motions with holes, without a wave, or that make no sense.

use chainwave_analysis::{
    AnalysisError, FrontSettings, MeasureSettings, Measurement, Missing, exact_motion, leading_pulses,
    measure, measure_peak_energies, profile_times, replicate, strain_map,
};
use chainwave_measurement::ChainMotion;
use chainwave_mechanics::FarEnd;
use ndarray::Array2;

use crate::common::{PITCH_M, motion_of_strain, paper_chain, with_sigma};

fn settings() -> MeasureSettings {
    MeasureSettings { n_replicas: 20, ..MeasureSettings::new(PITCH_M, 3) }
}

fn chain() -> ChainMotion {
    with_sigma(exact_motion(&paper_chain(26, 2.73, FarEnd::Free, 0.017).trajectory), 0.3e-6)
}

fn measured(motion: &ChainMotion) -> Measurement {
    measure(motion, &settings(), Some(&|_, overlap_m| overlap_m * overlap_m)).unwrap()
}

#[test]
fn peak_energies_alone_are_those_of_the_whole_measurement() {
    let mut motion = chain();
    motion.displacement_m.row_mut(20).fill(None);
    let alone = measure_peak_energies(&motion, &settings(), &|_, overlap_m| overlap_m * overlap_m);
    assert_eq!(alone.unwrap(), measured(&motion).energies.unwrap());
}

#[test]
fn a_body_that_was_never_seen_costs_its_two_gaps_and_the_half_width_beside_them() {
    let complete = measured(&chain());
    let mut motion = chain();
    motion.displacement_m.row_mut(9).fill(None);
    let holed = measured(&motion);
    for (row, (a, b)) in holed.fronts.iter().zip(&complete.fronts).enumerate() {
        match row {
            8 | 9 => assert_eq!(*a, Err(Missing::TooFewSamples)),
            _ => assert_eq!(a.map(|front| front.peak_time_s.value), b.map(|front| front.peak_time_s.value)),
        }
    }
    let (a, b) = (holed.group_velocity.unwrap(), complete.group_velocity.unwrap());
    assert_eq!(a.n_gaps + 2, b.n_gaps);
    // The line through fewer gaps of a trace that bends by some percent.
    assert!((a.velocity_m_per_s.value / b.velocity_m_per_s.value - 1.0).abs() < 2e-3);
    let energies = holed.energies.unwrap();
    assert_eq!(energies.missing, vec![(9, Missing::TooFewSamples), (10, Missing::TooFewSamples)]);
    assert_eq!(energies.gaps.len(), energies.energy_j.len());
    assert_eq!(energies.covariance_j2.dim(), (energies.gaps.len(), energies.gaps.len()));
    assert!(holed.half_widths.len() > complete.half_widths.len() / 3);
    for width in &holed.half_widths {
        let same = complete.half_widths.iter().find(|other| (other.t_s - width.t_s).abs() < 1e-9).unwrap();
        // Where an outer gap of the cubic is missing, a line stands in: two standard uncertainties.
        assert!((width.hwhm_m.value - same.hwhm_m.value).abs() < 150e-6, "{width:?} {same:?}");
    }
}

#[test]
fn holes_in_time_cost_what_they_hide() {
    let mut motion = chain();
    // Body 6 is lost while the pulse passes; body 16 misses single frames.
    for k in 100..150 {
        motion.displacement_m[(5, k)] = None;
    }
    for k in (0..400).step_by(9) {
        motion.displacement_m[(15, k)] = None;
    }
    let holed = measured(&motion);
    assert!(holed.fronts[4].is_err() && holed.fronts[5].is_err());
    let complete = measured(&chain());
    for row in [14, 15] {
        let (a, b) = (holed.fronts[row].unwrap(), complete.fronts[row].unwrap());
        // The motion has no noise, so the lost frames change little: a tenth of the noise's uncertainty.
        assert!((a.peak_time_s.value - b.peak_time_s.value).abs() < 0.1e-6);
        assert!(a.peak_time_s.sigma > 0.8 * b.peak_time_s.sigma);
    }
    assert!(holed.group_velocity.is_ok());
}

#[test]
fn noise_alone_is_no_pulse() {
    let flat = with_sigma(motion_of_strain(10, 300, |_, _| 0.0), 1e-6);
    let noise = replicate(&flat, 1, 17).next().unwrap();
    for motion in [flat, noise] {
        let measured = measured(&motion);
        assert!(measured.fronts.iter().all(|front| *front == Err(Missing::NoPulse)));
        assert_eq!(measured.group_velocity.unwrap_err(), Missing::TooFewGaps);
        assert_eq!(measured.local_resonance.unwrap_err(), Missing::NoTail);
        assert!(measured.half_widths.is_empty());
        assert!(measured.energies.unwrap().gaps.is_empty());
    }
}

#[test]
fn the_smallest_and_the_emptiest_motions_give_reasons() {
    let tiny = with_sigma(motion_of_strain(1, 8, |_, t_s| -t_s), 1e-9);
    assert_eq!(measured(&tiny).fronts, vec![Err(Missing::PeakOutsideRecord)]);
    let mut empty = chain();
    empty.displacement_m.fill(None);
    let measured = measured(&empty);
    assert!(measured.fronts.iter().all(|front| *front == Err(Missing::TooFewSamples)));
    assert!(measured.strain.strain.iter().all(Option::is_none));
}

#[test]
fn a_body_that_is_lost_before_the_pulse_comes_has_no_peak_energy() {
    let mut motion = chain();
    let complete = measured(&motion).energies.unwrap();
    // Body 12 rests while it is seen: gaps 11 and 12 would have the energy of noise, and a small sigma.
    for k in 60..motion.times_s.len() {
        motion.displacement_m[(11, k)] = None;
    }
    let energies = measured(&motion).energies.unwrap();
    assert!(complete.gaps.contains(&11) && complete.gaps.contains(&12), "{:?}", complete.gaps);
    assert!(!energies.gaps.contains(&11) && !energies.gaps.contains(&12), "{:?}", energies.gaps);
    assert!(energies.missing.iter().any(|(gap, _)| *gap == 11), "{:?}", energies.missing);
    let others =
        |all: &[usize]| all.iter().copied().filter(|gap| ![11, 12].contains(gap)).collect::<Vec<_>>();
    assert_eq!(energies.gaps, others(&complete.gaps));
}

#[test]
fn a_record_that_ends_on_the_rise_has_no_peak() {
    let mut motion = chain();
    let kept = 180;
    motion.times_s.truncate(kept);
    motion.displacement_m = motion.displacement_m.slice(ndarray::s![.., ..kept]).to_owned();
    motion.independent_sigma_m = motion.independent_sigma_m.slice(ndarray::s![.., ..kept]).to_owned();
    let measured = measured(&motion);
    assert!(measured.fronts[6].is_ok());
    assert_eq!(measured.fronts[11], Err(Missing::PeakOutsideRecord));
}

#[test]
fn profiles_are_shown_while_the_pulse_runs_however_short_the_record_is() {
    let pulses = |n_times: usize| {
        let mut motion = chain();
        motion.times_s.truncate(n_times);
        motion.displacement_m = motion.displacement_m.slice(ndarray::s![.., ..n_times]).to_owned();
        motion.independent_sigma_m = motion.independent_sigma_m.slice(ndarray::s![.., ..n_times]).to_owned();
        leading_pulses(&strain_map(&motion, PITCH_M).unwrap(), &FrontSettings::default())
    };
    for n_times in [400, 120, 90] {
        let times_s = profile_times(&pulses(n_times));
        assert_eq!(times_s.len(), 3, "{n_times}");
        assert!(times_s.is_sorted() && times_s[0] > 0.0 && times_s[2] < 4e-5 * n_times as f64, "{times_s:?}");
    }
    // It ends before the pulse has passed two gaps.
    assert!(profile_times(&pulses(10)).is_empty());
}

#[test]
fn the_same_motion_and_seed_give_the_same_bits() {
    let noisy = replicate(&chain(), 1, 2).next().unwrap();
    assert_eq!(measured(&noisy), measured(&noisy));
    let other = measure(&noisy, &MeasureSettings { seed: 4, ..settings() }, None).unwrap();
    assert_ne!(other.group_velocity.unwrap(), measured(&noisy).group_velocity.unwrap());
}

#[test]
fn a_motion_that_makes_no_sense_is_refused() {
    let refused = |motion: &ChainMotion| measure(motion, &settings(), None).unwrap_err();
    let mut motion = chain();
    motion.times_s[7] += 1e-5;
    assert!(matches!(refused(&motion), AnalysisError::UnequalTimes { index: 7, .. }));
    let mut motion = chain();
    if let Some(x) = &mut motion.displacement_m[(2, 5)] {
        x.value = f64::NAN;
    }
    assert!(matches!(refused(&motion), AnalysisError::NotFinite { body: 3, index: 5, .. }));
    let mut motion = chain();
    motion.independent_sigma_m[(0, 0)] = -1.0;
    assert!(matches!(refused(&motion), AnalysisError::NotFinite { body: 1, index: 0, .. }));
    let mut motion = chain();
    motion.modes.push("stage".into(), &Array2::ones((3, 3)));
    assert!(matches!(refused(&motion), AnalysisError::Shape { found: (3, 3), .. }));
    let mut motion = chain();
    motion.times_s.clear();
    assert!(matches!(refused(&motion), AnalysisError::TooFewTimes { found: 0, .. }));
    let wrong = MeasureSettings { n_replicas: 3, ..settings() };
    assert!(matches!(measure(&chain(), &wrong, None).unwrap_err(), AnalysisError::Setting { .. }));
    let wrong = MeasureSettings { spacing: (-0.03).into(), ..settings() };
    assert!(measure(&chain(), &wrong, None).unwrap_err().to_string().contains("pitch_m"));
}
