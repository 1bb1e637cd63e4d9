//! The wave of one motion, measured or computed, as figures show it.

use std::path::Path;

use chainwave_analysis::{GapFront, HalfWidth, MeasureSettings, exact_motion, measure};
use chainwave_figures::{DataPoint, FrontPulse, Series, StrainMapPanel};
use chainwave_measurement::{Estimate, Trajectory, median_interval_s};
use ndarray::{Array2, ArrayView1, s};

use crate::error::Error;
use crate::run_files::{RESULTS, STRAIN};
use crate::table;
use chainwave_experiment::read_text;

/// Gaps to either side of its peak that an aligned pulse shows.
const PULSE_REACH: f64 = 25.0;

/// The wave of one motion. What a model gives has sigmas of 0.
#[derive(Debug, Clone)]
pub(crate) struct Wave {
    /// Whose it is: its name in figures, by which they colour it.
    pub(crate) name: &'static str,
    /// Sample times in seconds.
    pub(crate) times_s: Vec<f64>,
    /// Strain u_n, negative in compression, shape `[gap, time]`.
    pub(crate) strain: Array2<Option<Estimate>>,
    /// The leading pulse in the gaps that saw it.
    pub(crate) fronts: Vec<GapFront>,
    /// Half width of the front.
    pub(crate) half_widths: Vec<HalfWidth>,
    /// Group velocity, where it is known.
    pub(crate) speed: Option<Speed>,
    /// Frequency of the tail in hertz, where it is known.
    pub(crate) tail_hz: Option<f64>,
}

/// A group velocity and how much it varies along the chain.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Speed {
    /// In metres per second.
    pub(crate) group_m_per_s: Estimate,
    /// Last third of the gaps less the first, relative to it.
    pub(crate) variation: Option<Estimate>,
    /// First and last gap.
    pub(crate) gaps: (usize, usize),
}

impl Wave {
    /// A model's motion, measured as an experiment's is.
    ///
    /// # Errors
    /// A motion too short to measure.
    pub(crate) fn of_model(
        name: &'static str,
        trajectory: &Trajectory,
        settings: &MeasureSettings,
    ) -> Result<Self, Error> {
        let found = measure(&exact_motion(trajectory), settings, None)?;
        let speed = found.group_velocity.as_ref().ok().map(|speed| Speed {
            group_m_per_s: speed.velocity_m_per_s,
            variation: speed.relative_variation,
            gaps: speed.gaps,
        });
        Ok(Self {
            name,
            times_s: found.strain.times_s.clone(),
            strain: found.strain.strain.clone(),
            fronts: found.fronts.iter().flatten().copied().collect(),
            half_widths: found.half_widths.clone(),
            speed,
            tail_hz: found.local_resonance.as_ref().ok().map(|tail| tail.frequency_hz.value),
        })
    }

    /// What a run found, read from its folder, from the trigger on.
    ///
    /// # Errors
    /// A table that is missing or holds something else.
    pub(crate) fn of_results(name: &'static str, folder: &Path) -> Result<Self, Error> {
        let path = folder.join(RESULTS);
        let results: serde_json::Value = serde_json::from_str(&read_text(&path)?)
            .map_err(|wrong| Error::configuration(&path, wrong.to_string()))?;
        let number = |key: &str| results[key].as_f64();
        let estimate = |key: &str, sigma: &str| Some(Estimate::new(number(key)?, number(sigma)?));
        let gap = |at: usize| results["group_velocity_gaps"][at].as_u64().and_then(|gap| gap.try_into().ok());
        let speed = || {
            Some(Speed {
                group_m_per_s: estimate("group_velocity_m_per_s", "group_velocity_sigma")?,
                variation: estimate("group_velocity_variation", "group_velocity_variation_sigma"),
                gaps: (gap(0)?, gap(1)?),
            })
        };
        let (times_s, strain) = read_strain(&folder.join(STRAIN))?;
        Ok(Self {
            name,
            times_s,
            strain,
            fronts: read_fronts(&folder.join("front.parquet"))?,
            half_widths: read_half_widths(&folder.join("hwhm.parquet"))?,
            speed: speed(),
            tail_hz: number("local_resonance_hz"),
        })
    }

    /// Time between samples, in seconds.
    pub(crate) fn interval_s(&self) -> f64 {
        median_interval_s(&self.times_s).unwrap_or(0.0)
    }

    /// The strain map with its traces, up to a time.
    pub(crate) fn panel_until(&self, last_s: f64) -> StrainMapPanel {
        let n_times = self.times_s.partition_point(|time_s| *time_s <= last_s);
        let whole = self.panel();
        let strain = whole.strain.slice(s![.., ..n_times]).to_owned();
        StrainMapPanel { times_s: whole.times_s[..n_times].to_vec(), strain, ..whole }
    }

    /// The strain map with its traces.
    pub(crate) fn panel(&self) -> StrainMapPanel {
        StrainMapPanel {
            title: self.name.into(),
            times_s: self.times_s.clone(),
            strain: self.strain.mapv(|strain| strain.map(|strain| strain.value)),
            peak_trace: self.peaks(),
            leading_edge: self.edges(),
        }
    }

    /// Strain over the gaps at the sample nearest to a time, where it is known.
    pub(crate) fn profile(&self, time_s: f64) -> Vec<(f64, Estimate)> {
        if self.times_s.is_empty() {
            return Vec::new();
        }
        let column = self.strain.column(nearest(&self.times_s, time_s));
        column.iter().enumerate().filter_map(|(row, strain)| Some(((row + 1) as f64, (*strain)?))).collect()
    }

    /// The same as a line without uncertainties, which breaks where strain is not known.
    pub(crate) fn profile_line(&self, time_s: f64) -> Vec<(f64, f64)> {
        match self.times_s.is_empty() {
            true => Vec::new(),
            false => broken_profile(&self.strain.column(nearest(&self.times_s, time_s))),
        }
    }

    /// Gaps of the peak and of the leading edge at a time.
    pub(crate) fn front(&self, time_s: f64) -> Option<(f64, f64)> {
        Some((place_at(&self.peaks(), time_s)?, place_at(&self.edges(), time_s)?))
    }

    /// The front's half width in metres at the sample nearest to a time, where it is known within an interval of the samples.
    pub(crate) fn half_width_m(&self, time_s: f64) -> Option<f64> {
        let apart_s = |width: &&HalfWidth| (width.t_s - time_s).abs();
        let nearest = self.half_widths.iter().min_by(|a, b| apart_s(a).total_cmp(&apart_s(b)))?;
        (apart_s(&nearest) <= self.interval_s()).then_some(nearest.hwhm_m.value)
    }

    /// Share of the steps between samples in which the half width grows.
    pub(crate) fn rising_share(&self) -> f64 {
        let steps = self.half_widths.windows(2);
        let n_rising = steps.clone().filter(|pair| pair[1].hwhm_m.value > pair[0].hwhm_m.value).count();
        n_rising as f64 / steps.len().max(1) as f64
    }

    /// The half widths as a model's line.
    pub(crate) fn half_width_line(&self) -> Series {
        Series::model(self.name, self.half_widths.iter().map(|width| (width.t_s, width.hwhm_m.value)))
    }

    /// The half widths as some measured markers: one a sample would be a solid band.
    pub(crate) fn half_width_markers(&self, n_markers: usize) -> Series {
        let step = self.half_widths.len().div_ceil(n_markers.max(1)).max(1);
        let markers = self.half_widths.iter().step_by(step);
        Series::measured(
            self.name,
            markers.map(|width| DataPoint::measured(width.t_s, width.hwhm_m)).collect(),
        )
    }

    /// The leading pulse about its crest at a time, the crest itself among its points; none where strain is not known beside the peak.
    pub(crate) fn pulse(&self, time_s: f64) -> Option<FrontPulse> {
        let near = place_at(&self.peaks(), time_s)?;
        let profile = self.profile_line(time_s);
        let known: Vec<(f64, f64)> = profile.iter().copied().filter(|point| point.1.is_finite()).collect();
        let (place, crest) = crest(&known, near)?;
        let mut about = about_peak(&profile, place, PULSE_REACH)?;
        let behind = about.partition_point(|(offset, _)| *offset < 0.0);
        if about.get(behind).is_none_or(|(offset, _)| *offset > 0.0) {
            about.insert(behind, (0.0, crest));
        }
        Some(FrontPulse { time_s, profile: about })
    }

    fn peaks(&self) -> Vec<(f64, f64)> {
        self.fronts.iter().map(|front| (front.gap as f64, front.peak_time_s.value)).collect()
    }

    fn edges(&self) -> Vec<(f64, f64)> {
        let edge = |front: &GapFront| Some((front.gap as f64, front.edge_time_s?.value));
        self.fronts.iter().filter_map(edge).collect()
    }
}

/// Strain over the gaps at one time, row i being gap i + 1, as a line that breaks where strain is not known.
pub(crate) fn broken_profile(strain: &ArrayView1<'_, Option<Estimate>>) -> Vec<(f64, f64)> {
    let value = |strain: &Option<Estimate>| strain.map_or(f64::NAN, |strain| strain.value);
    strain.iter().enumerate().map(|(row, strain)| ((row + 1) as f64, value(strain))).collect()
}

/// The part of such a line about a pulse's peak, counted from it; none where no gap within one cell of the peak is known.
pub(crate) fn about_peak(profile: &[(f64, f64)], peak: f64, reach: f64) -> Option<Vec<(f64, f64)>> {
    let about = profile.iter().map(|(gap, strain)| (gap - peak, *strain));
    let about: Vec<(f64, f64)> = about.filter(|(offset, _)| offset.abs() <= reach).collect();
    let is_seen = about.iter().any(|(offset, strain)| offset.abs() <= 1.0 && strain.is_finite());
    is_seen.then_some(about)
}

/// Reads a motion that `simulate` wrote: `t_s, body, x_m, v_m_per_s`, time by time; body 0, the striker, is left out.
///
/// # Errors
/// A missing column, and bodies that are not all there at every time.
pub(crate) fn read_trajectory(path: &Path) -> Result<Trajectory, Error> {
    let table = table::read(path)?;
    let (rows_s, bodies) = (table.full_numbers("t_s")?, table.counts("body")?);
    let (x_m, v_m_per_s) = (table.full_numbers("x_m")?, table.full_numbers("v_m_per_s")?);
    let mut times_s = rows_s.clone();
    times_s.dedup();
    let n_bodies = bodies.iter().copied().max().unwrap_or(0);
    let rows_a_time = rows_s.len() / times_s.len().max(1);
    if rows_a_time * times_s.len() != rows_s.len() || rows_a_time < n_bodies {
        let found = format!("{} rows for {n_bodies} bodies and {} times", rows_s.len(), times_s.len());
        return Err(Error::place(path, "column body", "every body at every time", &found));
    }
    let mut displacement_m = Array2::zeros((n_bodies, times_s.len()));
    let mut velocity_m_per_s = displacement_m.clone();
    for (row, body) in bodies.into_iter().enumerate() {
        if let Some(body) = body.checked_sub(1) {
            displacement_m[[body, row / rows_a_time]] = x_m[row];
            velocity_m_per_s[[body, row / rows_a_time]] = v_m_per_s[row];
        }
    }
    Ok(Trajectory { times_s, displacement_m, velocity_m_per_s })
}

/// Strain from the trigger on, with its times.
fn read_strain(path: &Path) -> Result<(Vec<f64>, Array2<Option<Estimate>>), Error> {
    let table = table::read(path)?;
    let (rows_s, gaps) = (table.full_numbers("t_s")?, table.counts("gap")?);
    let (strains, sigmas) = (table.numbers("strain")?, table.numbers("sigma")?);
    let mut times_s = rows_s.clone();
    times_s.sort_by(f64::total_cmp);
    times_s.dedup();
    let n_gaps = gaps.iter().copied().max().unwrap_or(0);
    let mut strain = Array2::from_elem((n_gaps, times_s.len()), None);
    for (row, time_s) in rows_s.iter().enumerate() {
        let column = times_s.partition_point(|before_s| before_s < time_s);
        let known = strains[row].zip(sigmas[row]).map(|(value, sigma)| Estimate::new(value, sigma));
        let gap = gaps[row].checked_sub(1);
        let gap = gap.ok_or_else(|| table.cell(row, "gap", "a number from 1", "0"))?;
        strain[[gap, column]] = known;
    }
    let first = times_s.partition_point(|time_s| *time_s < 0.0);
    Ok((times_s.split_off(first), strain.slice(s![.., first..]).to_owned()))
}

fn read_fronts(path: &Path) -> Result<Vec<GapFront>, Error> {
    let table = table::read(path)?;
    let gaps = table.counts("gap")?;
    let [peak_s, peak_sigma_s, edge_s, strain, strain_sigma] =
        ["t_peak_s", "t_peak_sigma_s", "t_edge_s", "peak_strain", "peak_strain_sigma"]
            .map(|name| table.numbers(name));
    let (peak_s, peak_sigma_s, edge_s) = (peak_s?, peak_sigma_s?, edge_s?);
    let (strain, strain_sigma) = (strain?, strain_sigma?);
    let front = |(row, gap): (usize, usize)| {
        Some(GapFront {
            gap,
            peak_time_s: Estimate::new(peak_s[row]?, peak_sigma_s[row]?),
            peak_strain: Estimate::new(strain[row]?, strain_sigma[row]?),
            // The table states no uncertainty of the edge.
            edge_time_s: edge_s[row].map(|edge_s| Estimate::new(edge_s, 0.0)),
            particle_velocity_m_per_s: None,
        })
    };
    Ok(gaps.into_iter().enumerate().filter_map(front).collect())
}

fn read_half_widths(path: &Path) -> Result<Vec<HalfWidth>, Error> {
    let table = table::read(path)?;
    let (times_s, widths_m) = (table.full_numbers("t_s")?, table.full_numbers("hwhm_m")?);
    let estimates = widths_m.into_iter().zip(table.full_numbers("sigma_m")?);
    let estimates = estimates.map(|(value, sigma)| Estimate::new(value, sigma));
    Ok(times_s.into_iter().zip(estimates).map(|(t_s, hwhm_m)| HalfWidth { t_s, hwhm_m }).collect())
}

/// Place and strain of the crest of a profile of (gap, strain) near a gap: by the parabola through the strongest compression and its
/// neighbours, or itself where it has but one.
fn crest(profile: &[(f64, f64)], near: f64) -> Option<(f64, f64)> {
    /// Where the peak over time passes a gap, the peak over the chain is a few gaps away at most.
    const REACH: f64 = 4.0;
    let close = profile.iter().enumerate().filter(|(_, (gap, _))| (gap - near).abs() <= REACH);
    let (at, &(gap, strain)) = close.min_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
    let neighbours = at.checked_sub(1).and_then(|before| Some((profile[before], *profile.get(at + 1)?)));
    let Some(((gap_before, before), (gap_behind, behind))) = neighbours else { return Some((gap, strain)) };
    let bend = before - 2.0 * strain + behind;
    if bend <= 0.0 || gap_behind - gap_before > 2.5 {
        return Some((gap, strain));
    }
    let shift = (0.5 * (before - behind) / bend).clamp(-0.5, 0.5);
    Some((gap + shift, strain - 0.25 * shift * (before - behind)))
}

/// Index of the time nearest to `time_s`; 0 where there is none.
pub(crate) fn nearest(times_s: &[f64], time_s: f64) -> usize {
    let right = times_s.partition_point(|time| *time < time_s).min(times_s.len().saturating_sub(1));
    let left = right.saturating_sub(1);
    let apart_s = |index: usize| times_s.get(index).map_or(f64::INFINITY, |time| (time - time_s).abs());
    if apart_s(left) <= apart_s(right) { left } else { right }
}

/// Where a trace of (gap, time) stands at a time, linearly between its points; `None` before its first and after its last.
pub(crate) fn place_at(trace: &[(f64, f64)], time_s: f64) -> Option<f64> {
    let pair = trace.windows(2).find(|pair| pair[0].1 <= time_s && time_s < pair[1].1)?;
    Some(pair[0].0 + (time_s - pair[0].1) / (pair[1].1 - pair[0].1) * (pair[1].0 - pair[0].0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trace_is_known_between_its_points_alone() {
        let trace = [(1.0, 1e-3), (2.0, 2e-3), (4.0, 3e-3)];
        assert_eq!(place_at(&trace, 2.5e-3), Some(3.0));
        assert_eq!(place_at(&trace, 0.5e-3), None);
        assert_eq!(place_at(&trace, 3e-3), None);
    }

    #[test]
    fn a_parabolas_crest_is_found_between_its_samples() {
        let parabola = |gap: f64| -0.05 + 0.001 * (gap - 7.3) * (gap - 7.3);
        let profile: Vec<(f64, f64)> = (1..=12).map(f64::from).map(|gap| (gap, parabola(gap))).collect();
        let (place, strain) = crest(&profile, 8.0).unwrap();
        // Rounding of a second difference of 0.002 among strains of 0.05.
        assert!((place - 7.3).abs() < 1e-12 && (strain + 0.05).abs() < 1e-14, "{place} {strain}");
        assert_eq!(crest(&profile[..7], 7.0), Some((7.0, parabola(7.0))));
        assert_eq!(crest(&[], 7.0), None);
    }

    #[test]
    fn the_nearest_of_two_samples_is_taken_and_of_none_the_first() {
        assert_eq!(nearest(&[0.0, 1.0, 2.0], 1.4), 1);
        assert_eq!(nearest(&[0.0, 1.0, 2.0], 9.0), 2);
        assert_eq!(nearest(&[], 1.0), 0);
    }

    #[test]
    fn a_motion_that_simulate_wrote_is_read_without_its_striker() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("motion.csv");
        let rows = "t_s,body,x_m,v_m_per_s\n0,0,1,0\n0,1,2,0\n0,2,3,0\n1,0,4,0\n1,1,5,0\n1,2,6,7\n";
        std::fs::write(&path, rows).unwrap();
        let read = read_trajectory(&path).unwrap();
        assert_eq!(read.times_s, [0.0, 1.0]);
        assert_eq!(read.displacement_m, ndarray::array![[2.0, 5.0], [3.0, 6.0]]);
        assert_eq!(read.velocity_m_per_s[[1, 1]].to_bits(), 7.0_f64.to_bits());
        std::fs::write(&path, &rows[..rows.len() - 8]).unwrap();
        assert!(read_trajectory(&path).unwrap_err().to_string().contains("every body"));
    }
}
