//! The paper's chain, as the model moves it.

use chainwave_analysis::{
    FrontSettings, MeasureSettings, Measurement, Reflection, exact_motion, leading_pulses, measure,
    replicate, strain_map,
};
use chainwave_measurement::Trajectory;
use chainwave_mechanics::{FarEnd, PowerLaw};

use crate::common::{PITCH_M, paper_chain, with_sigma};

fn measured(trajectory: &Trajectory) -> Measurement {
    let law = PowerLaw::ELLIPTICAL_RING;
    let settings = MeasureSettings::new(PITCH_M, 1);
    measure(&exact_motion(trajectory), &settings, Some(&|_, overlap_m| law.energy_j(overlap_m))).unwrap()
}

/// Every `step`-th sample of a trajectory.
fn thinned(trajectory: &Trajectory, step: usize) -> Trajectory {
    let rows = |array: &ndarray::Array2<f64>| array.slice(ndarray::s![.., ..;step]).to_owned();
    Trajectory {
        times_s: trajectory.times_s.iter().step_by(step).copied().collect(),
        displacement_m: rows(&trajectory.displacement_m),
        velocity_m_per_s: rows(&trajectory.velocity_m_per_s),
    }
}

#[test]
fn what_the_window_biases_stays_below_the_noise() {
    let trajectory = paper_chain(26, 2.73, FarEnd::Free, 0.017).trajectory;
    let map = strain_map(&exact_motion(&trajectory), PITCH_M).unwrap();
    // A window of a fifth of the length divides the bias, of sixth order in it, by some thousand.
    let wide = leading_pulses(&map, &FrontSettings::default());
    let narrow = leading_pulses(&map, &FrontSettings { peak_fraction: 0.99, ..FrontSettings::default() });
    for (wide, narrow) in wide.iter().zip(&narrow).take(21) {
        let (wide, narrow) = (wide.unwrap(), narrow.unwrap());
        // Standard uncertainties at 0.3 um: 0.6 to 0.9 us and 4e-6; a third of them is allowed.
        assert!((wide.peak_time_s - narrow.peak_time_s).abs() < 0.25e-6, "{wide:?} {narrow:?}");
        assert!((wide.peak_strain - narrow.peak_strain).abs() < 1.3e-6, "{wide:?} {narrow:?}");
    }
}

#[test]
fn results_hardly_depend_on_the_sampling_rate() {
    let trajectory = paper_chain(26, 2.73, FarEnd::Free, 0.017).trajectory;
    let (full, half) = (measured(&trajectory), measured(&thinned(&trajectory, 2)));
    let speed = |measurement: &Measurement| measurement.group_velocity.unwrap().velocity_m_per_s.value;
    // Half the sampling rate leaves the windows the same in time: 0.01 %, a tenth of the target for c_g.
    assert!((speed(&full) / speed(&half) - 1.0).abs() < 1e-4);
    for width in &half.half_widths {
        let same = full.half_widths.iter().find(|other| (other.t_s - width.t_s).abs() < 1e-9).unwrap();
        // A third of the noise of a real recording (70 um).
        assert!((same.hwhm_m.value - width.hwhm_m.value).abs() < 25e-6, "{width:?} {same:?}");
    }
}

#[test]
fn peak_energies_agree_with_the_simulation() {
    let simulation = paper_chain(26, 2.73, FarEnd::Free, 0.017);
    let energies = measured(&simulation.trajectory).energies.unwrap();
    assert_eq!(energies.gaps, (1..=25).collect::<Vec<_>>());
    for (energy, truth_j) in energies.energy_j.iter().zip(&simulation.psi_max_j) {
        // Standard uncertainty at 0.3 um: 2e-4; a fourth of it.
        assert!((energy.value / truth_j - 1.0).abs() < 5e-5, "{energy:?}, expected {truth_j}");
    }
}

#[test]
fn what_the_far_end_disturbs_is_left_out() {
    let short = measured(&paper_chain(26, 2.73, FarEnd::Free, 0.017).trajectory);
    let long = measured(&paper_chain(60, 2.73, FarEnd::Free, 0.030).trajectory);
    let velocity = short.group_velocity.unwrap();
    assert!(velocity.gaps.1 >= 17, "most of the chain is used: {:?}", velocity.gaps);
    for gap in velocity.gaps.0..=velocity.gaps.1 {
        let (short, long) = (short.fronts[gap - 1].unwrap(), long.fronts[gap - 1].unwrap());
        // A tenth of the noise of a real recording.
        assert!((short.peak_time_s.value - long.peak_time_s.value).abs() < 0.1e-6, "{short:?} {long:?}");
    }
    for width in &short.half_widths {
        let undisturbed = long.half_widths.iter().find(|other| (other.t_s - width.t_s).abs() < 1e-9).unwrap();
        // A third of the noise of a real recording; the frames' speeds differ too.
        assert!((width.hwhm_m.value - undisturbed.hwhm_m.value).abs() < 25e-6, "{width:?} {undisturbed:?}");
    }
    assert!(short.half_widths.len() > 200);
}

#[test]
fn the_reflection_returns_before_it_is_seen() {
    let short =
        strain_map(&exact_motion(&paper_chain(26, 2.73, FarEnd::Free, 0.017).trajectory), PITCH_M).unwrap();
    let long =
        strain_map(&exact_motion(&paper_chain(60, 2.73, FarEnd::Free, 0.017).trajectory), PITCH_M).unwrap();
    let pulses = leading_pulses(&short, &FrontSettings::default());
    let reflection = Reflection::of_feet(&pulses, 3).unwrap();
    for gap in 12..=24 {
        let pairs = short.strain.row(gap - 1).into_iter().zip(long.strain.row(gap - 1)).zip(&short.times_s);
        let before = pairs.filter(|(_, t_s)| **t_s < reflection.arrival_s(gap as f64));
        let difference = before.filter_map(|((a, b), _)| Some(((*a)?.value - (*b)?.value).abs()));
        // 4e-4 of the pulse's height; the last gap (25) feels the free end itself from the start.
        let largest = difference.fold(0.0, f64::max);
        assert!(largest < 2e-5 || gap > 21 && largest < 1e-3, "gap {gap}: {largest}");
    }
}

#[test]
fn noise_of_a_tenth_of_a_percent_strain_is_survived() {
    let trajectory = paper_chain(26, 2.73, FarEnd::Free, 0.017).trajectory;
    let truth = measured(&trajectory);
    let settings = MeasureSettings { n_replicas: 50, ..MeasureSettings::new(PITCH_M, 8) };
    let noisy = replicate(&with_sigma(exact_motion(&trajectory), 20e-6), 1, 4).next().unwrap();
    let measured = measure(&noisy, &settings, None).unwrap();
    for (found, truth) in measured.fronts.iter().zip(&truth.fronts).take(19) {
        let (found, truth) = (found.unwrap(), truth.unwrap());
        // 19 gaps: none farther than 4 sigma. Replicas scatter by 120 us at most; a polynomial over half as far has `sqrt(2)` times the variance, so that its peak differs by
        // 0.64 of that, and three times so much may join. Had a replica taken another peak, the sigma would be a millisecond.
        let distance = found.peak_time_s.value - truth.peak_time_s.value;
        assert!(distance.abs() < 4.0 * found.peak_time_s.sigma, "{found:?} {truth:?}");
        assert!(found.peak_time_s.sigma < 120e-6 * f64::hypot(1.0, 3.0 * 0.64), "{found:?}");
    }
}

#[test]
fn particle_velocities_agree_with_the_simulation() {
    let trajectory = paper_chain(26, 2.73, FarEnd::Free, 0.017).trajectory;
    let measured = measured(&trajectory);
    for (row, front) in measured.fronts.iter().enumerate().take(20) {
        let front = front.unwrap();
        let moment = trajectory.at(front.peak_time_s.value).unwrap();
        let known = 0.5 * (moment.velocity_m_per_s(row) + moment.velocity_m_per_s(row + 1));
        let found = front.particle_velocity_m_per_s.unwrap().value;
        // The polynomial's own bias over a window as wide as the front; noise of 0.3 um adds 0.1 %.
        assert!((found / known - 1.0).abs() < 1e-3, "gap {}: {found}, expected {known}", front.gap);
    }
    let velocity = measured.group_velocity.unwrap();
    let mean = velocity.particle_velocity_m_per_s.unwrap().value;
    assert!((0.5..2.73).contains(&mean), "{mean}");
}

#[test]
fn particle_velocities_hold_their_intervals_from_little_noise_to_much() {
    let trajectory = paper_chain(26, 2.73, FarEnd::Free, 0.017).trajectory;
    let truth = measured(&trajectory);
    let known = |row: usize| {
        let moment = trajectory.at(truth.fronts[row].unwrap().peak_time_s.value).unwrap();
        0.5 * (moment.velocity_m_per_s(row) + moment.velocity_m_per_s(row + 1))
    };
    for sigma_m in [0.02e-6, 0.3e-6, 3e-6] {
        let motion = with_sigma(exact_motion(&trajectory), sigma_m);
        let mut off = Vec::new();
        for (draw, noisy) in replicate(&motion, 10, 7).enumerate() {
            let settings =
                MeasureSettings { n_replicas: 100, ..MeasureSettings::new(PITCH_M, 100 + draw as u64) };
            let found = measure(&noisy, &settings, None).unwrap();
            off.extend((0..20).map(|row| {
                let velocity = found.fronts[row].unwrap().particle_velocity_m_per_s.unwrap();
                (velocity.value - known(row)) / velocity.sigma
            }));
        }
        // Of 200 values, of which neighbours share half their noise, 1.9 % are a standard deviation of those that hold, and 6 % of their rms. Four of
        // these, a tenth for sigmas by 100 replicas, and what the bend beyond noise leaves.
        let held = off.iter().filter(|off| off.abs() < 1.96).count();
        let rms = (off.iter().map(|off| off * off).sum::<f64>() / off.len() as f64).sqrt();
        let n = off.len();
        assert!(held as f64 >= 0.86 * n as f64 && rms < 1.3, "{sigma_m}: {held} of {n}, rms {rms}");
    }
}
