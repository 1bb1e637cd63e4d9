//! What is measured of a motion as tables: strain, front, half widths, energies, spectra, dispersion.

use chainwave_analysis::{GapFront, Measurement, Missing};
use chainwave_measurement::Estimate;

use crate::tables::motion::by_time;
use crate::tables::result_table::{ResultTable, column};

/// The strains: `t_s, gap, strain, sigma`.
pub fn strain_table(measurement: &Measurement) -> ResultTable {
    let map = &measurement.strain;
    let rows: Vec<(usize, usize, Estimate)> = by_time(&map.strain).collect();
    let columns = vec![
        column("t_s", rows.iter().map(|(_, i, _)| map.times_s[*i]).collect::<Vec<_>>()),
        column("gap", rows.iter().map(|(row, ..)| *row as u32 + 1).collect::<Vec<_>>()),
        column("strain", rows.iter().map(|(.., u)| u.value).collect::<Vec<_>>()),
        column("sigma", rows.iter().map(|(.., u)| u.sigma).collect::<Vec<_>>()),
    ];
    ResultTable { columns }
}

/// The fronts: `gap, t_peak_s, t_peak_sigma_s, t_edge_s, peak_strain, peak_strain_sigma, t_edge_sigma_s, particle_velocity_m_per_s,
/// particle_velocity_sigma, status`.
///
/// A gap whose leading pulse is missing keeps its row, with the reason in `status`.
pub fn front_table(measurement: &Measurement) -> ResultTable {
    let fronts = &measurement.fronts;
    let of = |value: &dyn Fn(&GapFront) -> Option<f64>| -> Vec<Option<f64>> {
        fronts.iter().map(|front| front.as_ref().ok().and_then(value)).collect()
    };
    let status = |front: &Result<_, Missing>| front.as_ref().err().map_or("ok", |reason| reason.as_str());
    let columns = vec![
        column("gap", (1..=fronts.len() as u32).collect::<Vec<_>>()),
        column("t_peak_s", of(&|front| Some(front.peak_time_s.value))),
        column("t_peak_sigma_s", of(&|front| Some(front.peak_time_s.sigma))),
        column("t_edge_s", of(&|front| front.edge_time_s.map(|time| time.value))),
        column("peak_strain", of(&|front| Some(front.peak_strain.value))),
        column("peak_strain_sigma", of(&|front| Some(front.peak_strain.sigma))),
        column("t_edge_sigma_s", of(&|front| front.edge_time_s.map(|time| time.sigma))),
        column("particle_velocity_m_per_s", of(&|front| front.particle_velocity_m_per_s.map(|v| v.value))),
        column("particle_velocity_sigma", of(&|front| front.particle_velocity_m_per_s.map(|v| v.sigma))),
        column("status", fronts.iter().map(status).collect::<Vec<_>>()),
    ];
    ResultTable { columns }
}

/// Half widths at half maximum: `t_s, hwhm_m, sigma_m`.
pub fn half_width_table(measurement: &Measurement) -> ResultTable {
    let widths = &measurement.half_widths;
    let columns = vec![
        column("t_s", widths.iter().map(|width| width.t_s).collect::<Vec<_>>()),
        column("hwhm_m", widths.iter().map(|width| width.hwhm_m.value).collect::<Vec<_>>()),
        column("sigma_m", widths.iter().map(|width| width.hwhm_m.sigma).collect::<Vec<_>>()),
    ];
    ResultTable { columns }
}

/// Peak potential energies: `gap, psi_max_j, sigma_j`; empty where no contact law tells them.
pub fn energy_table(measurement: &Measurement) -> ResultTable {
    let (gaps, energies): (Vec<usize>, Vec<Estimate>) = match &measurement.energies {
        Some(energies) => (energies.gaps.clone(), energies.energy_j.clone()),
        None => (Vec::new(), Vec::new()),
    };
    let columns = vec![
        column("gap", gaps.iter().map(|gap| *gap as u32).collect::<Vec<_>>()),
        column("psi_max_j", energies.iter().map(|energy| energy.value).collect::<Vec<_>>()),
        column("sigma_j", energies.iter().map(|energy| energy.sigma).collect::<Vec<_>>()),
    ];
    ResultTable { columns }
}

/// Spectra of the strains: `gap, frequency_hz, amplitude`.
pub fn spectrum_table(measurement: &Measurement) -> ResultTable {
    let spectrum = &measurement.spectrum;
    let lines =
        || spectrum.gaps.iter().flat_map(|of_gap| of_gap.amplitude.iter().map(move |a| (of_gap.gap, *a)));
    let n_gaps = spectrum.gaps.len();
    let columns = vec![
        column("gap", lines().map(|(gap, _)| gap as u32).collect::<Vec<_>>()),
        column("frequency_hz", spectrum.frequency_hz.repeat(n_gaps)),
        column("amplitude", lines().map(|(_, amplitude)| amplitude).collect::<Vec<_>>()),
    ];
    ResultTable { columns }
}

/// `kappa_rad, frequency_hz, amplitude`: the dispersion map.
///
/// The tails over wavenumber and frequency, up to a limit; empty where too few gaps have a tail.
pub fn dispersion_table(limit_hz: f64, measurement: &Measurement) -> ResultTable {
    let map = measurement.dispersion.as_ref().ok();
    let cells = || map.into_iter().flat_map(|map| map.amplitude.indexed_iter().map(move |cell| (map, cell)));
    let shown: Vec<_> = cells().filter(|(map, ((_, bin), _))| map.frequency_hz[*bin] <= limit_hz).collect();
    let columns = vec![
        column("kappa_rad", shown.iter().map(|(map, ((row, _), _))| map.kappa_rad[*row]).collect::<Vec<_>>()),
        column(
            "frequency_hz",
            shown.iter().map(|(map, ((_, bin), _))| map.frequency_hz[*bin]).collect::<Vec<_>>(),
        ),
        column("amplitude", shown.iter().map(|(_, (_, amplitude))| **amplitude).collect::<Vec<_>>()),
    ];
    ResultTable { columns }
}
