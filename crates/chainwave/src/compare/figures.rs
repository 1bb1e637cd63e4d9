//! The figures of a study: the experiment with its models.

use std::path::Path;

use chainwave_analysis::damping_share;
use chainwave_figures::{
    ContactCurve, DataPoint, EnergyShares, FrontWidth, GroupVelocities, LongChain, PeakEnergy, ProfilePanel,
    RightHalves, Series,
};
use chainwave_mechanics::{Contact, Law, PowerLaw};
use serde::Deserialize;

use super::parts::{CHAIN, Compared, EXPERIMENT, LawResults, RINGS, Struck};
use super::study::Study;
use super::tail::tail;
use crate::error::Error;
use crate::table;
use chainwave_experiment::read_toml;

/// Markers of the measured half widths.
const N_MARKERS: usize = 12;
/// Points of the fitted law's curve.
const N_OF_CURVE: usize = 200;

/// Draws every figure into a folder.
pub(super) fn draw(study: &Study, from: &Path, compared: &Compared, out: &Path) -> Result<(), Error> {
    chainwave_figures::contact_curve(&out.join("contact-curve"), &contact_curve(study, from)?)?;
    if let Some(struck) = compared.strikes.first() {
        let ends_s = struck.waves().map(|wave| wave.times_s.last().copied().unwrap_or(0.0));
        let common_s = ends_s.into_iter().fold(f64::INFINITY, f64::min);
        let panels = struck.waves().map(|wave| wave.panel_until(common_s));
        chainwave_figures::strain_map(&out.join("strain-map"), &panels)?;
        let profiles: Vec<_> = study.profile_times_s.iter().map(|time_s| profile(struck, *time_s)).collect();
        chainwave_figures::strain_profiles(&out.join("strain-profiles"), &profiles)?;
        chainwave_figures::right_halves(&out.join("right-halves"), &right_halves(study, compared, struck))?;
        if let Some((of_tail, strike)) = study.tail.as_ref().zip(study.strikes.first()) {
            let last_gap = struck.experiment.speed.map_or(usize::MAX, |speed| speed.gaps.1);
            let spectra = tail(of_tail, from, &from.join(&strike.experiment), last_gap)?;
            chainwave_figures::tail_spectrum(&out.join("tail-spectrum"), &spectra)?;
        }
        if let Some(law) = compared.law() {
            chainwave_figures::peak_energy(&out.join("peak-energy"), &peak_energy(study, law, struck))?;
        }
    }
    let profile = |time_s: &f64| (*time_s, compared.long.profile_line(*time_s));
    let profiles = study.long_chain.profile_times_s.iter().map(profile).collect();
    chainwave_figures::long_chain(&out.join("long-chain"), &LongChain { profiles })?;
    Ok(chainwave_figures::group_velocity(&out.join("group-velocity"), &group_velocities(study, compared))?)
}

/// Force over compression with the fitted law (the paper's Fig. 1).
fn contact_curve(study: &Study, from: &Path) -> Result<ContactCurve, Error> {
    #[derive(Deserialize)]
    struct Fitted {
        a: f64,
        delta_0_m: f64,
        p: f64,
    }
    let table = table::read(&from.join(&study.contact.curve))?;
    let (overlaps_m, forces_n) = (table.full_numbers("overlap_m")?, table.full_numbers("force_n")?);
    let path = from.join(&study.contact.law);
    let law: Fitted = read_toml(&path)?;
    let law = Contact::from(Law::Power(PowerLaw::new(law.a, law.delta_0_m, law.p)?));
    let force_n = |overlap_m: f64| law.force_and_energy(overlap_m).0;
    let last_m = overlaps_m.iter().copied().fold(0.0, f64::max);
    let curve = (0..=N_OF_CURVE).map(|k| last_m * k as f64 / N_OF_CURVE as f64);
    let points = || overlaps_m.iter().copied().zip(forces_n.iter().copied());
    Ok(ContactCurve {
        // Broken lines lie on whole ones, so that both are seen.
        series: vec![
            Series::model("chain model, fitted law", curve.map(|overlap_m| (overlap_m, force_n(overlap_m)))),
            Series::model("rings, compressed", points()),
        ],
        residuals: Some(Series::model(
            "rings less law",
            points().map(|(overlap_m, found_n)| (overlap_m, found_n - force_n(overlap_m))),
        )),
    })
}

/// Strain over the chain at one time: measured with its uncertainty, and by both models.
fn profile(struck: &Struck, time_s: f64) -> ProfilePanel {
    let measured = struck.experiment.profile(time_s).into_iter();
    let measured = measured.map(|(gap, strain)| DataPoint::measured(gap, strain)).collect();
    ProfilePanel {
        time_s,
        series: vec![
            Series::measured(EXPERIMENT, measured),
            Series::model(RINGS, struck.rings.profile_line(time_s)),
            Series::model(CHAIN, struck.chain.profile_line(time_s)),
        ],
        front: struck.experiment.front(time_s),
    }
}

/// Right halves of the long chain's pulses, and half widths of the long chain with those that were measured.
fn right_halves(study: &Study, compared: &Compared, struck: &Struck) -> RightHalves {
    let pulses = study.long_chain.pulse_times_s.iter();
    RightHalves(FrontWidth {
        pulses: pulses.filter_map(|time_s| compared.long.pulse(*time_s)).collect(),
        hwhm: vec![struck.experiment.half_width_markers(N_MARKERS), compared.long.half_width_line()],
        pitch_m: Some(study.pitch_m.get()),
    })
}

/// Group velocities over the striker's: measured, of rings, and the chain model's curve.
fn group_velocities(study: &Study, compared: &Compared) -> GroupVelocities {
    let measured = compared.measured.iter().map(|&(x, y)| DataPoint { x, y }).collect();
    let of_rings = |struck: &Struck| {
        Some((struck.velocity_m_per_s, struck.rings.speed.map(|speed| speed.group_m_per_s.value)?))
    };
    let scanned = compared.law().map_or(&[][..], |law| &law.scan);
    GroupVelocities {
        series: vec![
            Series::measured(EXPERIMENT, measured),
            Series::model_points(RINGS, compared.strikes.iter().filter_map(of_rings)),
            Series::model(CHAIN, scanned.iter().map(|row| (row.striker_m_per_s, row.group_m_per_s))),
        ],
        sound_speed_m_per_s: Some(study.sound_speed_m_per_s.get()),
    }
}

/// Peak energies relative to what gap 1 takes up without damping, and what took them at the last gap.
fn peak_energy(study: &Study, law: &LawResults, struck: &Struck) -> PeakEnergy {
    let input_j = law.undamped_j.first().copied().filter(|input_j| *input_j > 0.0).unwrap_or(1.0);
    let curve = |energies_j: &[f64]| {
        let shown = energies_j.iter().take(study.energy_gap).enumerate();
        shown.map(|(row, energy_j)| ((row + 1) as f64, energy_j / input_j)).collect()
    };
    let share =
        damping_share(&law.damped_j, &law.undamped_j).into_iter().nth(study.energy_gap.saturating_sub(1));
    // Behind the last gap of the group velocity, the far end's reflection has changed the peak.
    let last = struck.experiment.speed.map_or(f64::INFINITY, |speed| speed.gaps.1 as f64);
    let measured = struck.energies_j.iter().filter(|(gap, _)| *gap <= last);
    PeakEnergy {
        measured: measured
            .map(|(gap, energy)| DataPoint::measured(*gap, energy.scaled(1.0 / input_j)))
            .collect(),
        damped: curve(&law.damped_j),
        undamped: curve(&law.undamped_j),
        shares: share.map(|share| EnergyShares {
            dispersion: share.spread,
            damping: share.damped,
            gap: Some(share.gap),
            is_of_uniform_chain: true,
        }),
        relative_to_gap: None,
    }
}
