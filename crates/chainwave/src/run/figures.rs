//! Every figure of a run.

use std::path::{Path, PathBuf};

use chainwave_analysis::{
    CameraMotion, DampingShare, DispersionMap, GapFront, LocalResonance, Measurement, Missing, StrainMap,
    line_rule, normalised_residuals,
};
use chainwave_experiment::{Evaluation, Experiment, ModelBeside};
use chainwave_figures::{
    BodyMotion, DataPoint, DispersionPanel, EnergyShares, FrequencyMark, FrontPulse, FrontWidth, GapSpectrum,
    PeakEnergy, PeakFit, PeakTrace, ProfilePanel, RecordingMotion, ResidualMapPanel, Series, StrainMapPanel,
    TailSpectrum,
};
use chainwave_measurement::{ChainMotion, Estimate};

use crate::error::Error;
use crate::outcome::Outcome;
use crate::output::figures_folder;
use crate::wave::{about_peak, broken_profile, nearest, place_at};

/// A figure that was drawn.
pub(crate) struct Figure {
    /// File name without ending, in the folder `figures`.
    pub(crate) name: String,
    /// What it shows.
    pub(crate) caption: String,
}

/// Draws every figure of a run; one that cannot be drawn is named, and the others are there.
pub(crate) fn draw(
    experiment: &Experiment,
    out: &Path,
    evaluation: &Evaluation,
    outcome: &mut Outcome,
) -> Result<Vec<Figure>, Error> {
    let album = Album { experiment, evaluation, folder: figures_folder(out)? };
    let mut figures = vec![
        album.displacements(),
        album.strain_maps(),
        album.strain_profiles(),
        album.peak_trace(),
        album.front_width(),
        album.peak_energy(),
        album.tail_spectrum(),
    ];
    figures.extend(evaluation.measurement.dispersion.as_ref().ok().map(|map| album.dispersion(map)));
    figures.extend(evaluation.model.as_ref().map(|model| album.residuals(model)));
    figures.extend(evaluation.camera_motion().map(|motion| album.camera_motion(motion)));
    let drawn =
        |figure: Result<Figure, Error>| figure.map_err(|why| outcome.fail(format!("a figure: {why}"))).ok();
    Ok(figures.into_iter().filter_map(drawn).collect())
}

/// Draws what follows from a motion alone: displacements and the strain map.
pub(crate) fn draw_motion(
    folder: &Path,
    name: &str,
    motion: &ChainMotion,
    measurement: &Measurement,
) -> Result<(), Error> {
    let folder = figures_folder(folder)?;
    chainwave_figures::displacements(&folder.join("displacements"), &BodyMotion::spread_over(motion))?;
    Ok(chainwave_figures::strain_map(&folder.join("strain-map"), &[panel_of(name, measurement)])?)
}

struct Album<'a> {
    experiment: &'a Experiment,
    evaluation: &'a Evaluation,
    folder: PathBuf,
}

impl Album<'_> {
    fn displacements(&self) -> Result<Figure, Error> {
        let mut bodies = BodyMotion::spread_over(&self.evaluation.stitched.motion);
        if let Some(model) = &self.evaluation.model {
            let times_s = || model.motion.times_s.iter().copied();
            for body in &mut bodies {
                let row = model.motion.displacement_m.row(body.body - 1);
                body.model = times_s().zip(row.iter().copied()).collect();
            }
        }
        chainwave_figures::displacements(&self.folder.join("displacements"), &bodies)?;
        let (n_bodies, beside) = (bodies.len(), self.evaluation.model.as_ref());
        let beside = beside.map_or("", |_| ", and the chain model with the fitted damping");
        Ok(Figure {
            name: "displacements".into(),
            caption: format!("Displacements of {n_bodies} bodies with 95 % bands{beside}."),
        })
    }

    fn camera_motion(&self, motion: &CameraMotion) -> Result<Figure, Error> {
        let named = |(name, samples): (&str, _)| RecordingMotion { recording: name.into(), samples };
        let all: Vec<RecordingMotion> = motion.of_recordings().map(named).collect();
        let shown = RecordingMotion::spread_over(&all);
        chainwave_figures::camera_motion(&self.folder.join("camera-motion"), &shown)?;
        Ok(Figure {
            name: "camera-motion".into(),
            caption: format!(
                "Motion of the camera, told by bodies that the wave has not reached, with 95 % bands: {} of {} recordings. It was taken out.",
                shown.len(),
                all.len()
            ),
        })
    }

    fn strain_maps(&self) -> Result<Figure, Error> {
        let mut panels = vec![panel_of("experiment", &self.evaluation.measurement)];
        let model = self.evaluation.model.as_ref();
        panels.extend(model.map(|model| panel_of("chain model", &model.measurement)));
        chainwave_figures::strain_map(&self.folder.join("strain-map"), &panels)?;
        Ok(Figure {
            name: "strain-map".into(),
            caption: "Compressive strain over gaps and time; peak of the leading pulse dotted, leading edge dashed.".into(),
        })
    }

    fn strain_profiles(&self) -> Result<Figure, Error> {
        let map = &self.evaluation.measurement.strain;
        let last_s = map.times_s.last().copied().unwrap_or(0.0);
        let times = self.profile_times_s().into_iter().filter(|time_s| *time_s <= last_s);
        let panels: Vec<ProfilePanel> = times.map(|time_s| self.profile(map, time_s)).collect();
        chainwave_figures::strain_profiles(&self.folder.join("strain-profiles"), &panels)?;
        Ok(Figure {
            name: "strain-profiles".into(),
            caption: "Strain over the chain at several times; the front is shaded.".into(),
        })
    }

    /// The times that the experiment names, else those at which the pulse has passed a quarter, half and three quarters of its gaps.
    fn profile_times_s(&self) -> Vec<f64> {
        if let Some(times_s) = &self.experiment.analysis.profile_times_s {
            return times_s.clone();
        }
        let fronts = self.evaluation.measurement.fronts.iter().flatten();
        let mut peaks_s: Vec<f64> = fronts.map(|front| front.peak_time_s.value).collect();
        peaks_s.sort_by(f64::total_cmp);
        let last = peaks_s.len().saturating_sub(1);
        let mut times_s: Vec<f64> =
            (1..4).filter_map(|quarter| peaks_s.get((quarter * last).div_ceil(4)).copied()).collect();
        times_s.dedup();
        times_s
    }

    fn profile(&self, map: &StrainMap, time_s: f64) -> ProfilePanel {
        let index = nearest(&map.times_s, time_s);
        let measured = map.strain.column(index);
        let points = measured.iter().enumerate();
        let points =
            points.filter_map(|(row, strain)| Some(DataPoint::measured((row + 1) as f64, (*strain)?)));
        let mut series = vec![Series::measured("experiment", points.collect())];
        if let Some(model) = &self.evaluation.model {
            let strain = model.measurement.strain.strain.column(index);
            series.push(Series::model("chain model", broken_profile(&strain)));
        }
        ProfilePanel { time_s: map.times_s[index], series, front: self.front_at(map.times_s[index]) }
    }

    /// Gaps between the pulse's peak and its leading edge at a time.
    fn front_at(&self, time_s: f64) -> Option<(f64, f64)> {
        let fronts: Vec<&GapFront> = self.evaluation.measurement.fronts.iter().flatten().collect();
        let peaks: Vec<(f64, f64)> =
            fronts.iter().map(|front| (front.gap as f64, front.peak_time_s.value)).collect();
        let edges = fronts.iter().filter_map(|front| Some((front.gap as f64, front.edge_time_s?.value)));
        Some((place_at(&peaks, time_s)?, place_at(&edges.collect::<Vec<_>>(), time_s)?))
    }

    fn peak_trace(&self) -> Result<Figure, Error> {
        let measurement = &self.evaluation.measurement;
        let pitch_m = self.experiment.chain.mean_pitch_m();
        let velocity = measurement.group_velocity.as_ref().ok();
        // Without a fit every peak is shown; with one, those that it uses (the others feel the striker or the far end).
        let used = velocity.map_or(1..=usize::MAX, |velocity| velocity.gaps.0..=velocity.gaps.1);
        let fronts = measurement.fronts.iter().flatten().filter(|front| used.contains(&front.gap));
        let peaks: Vec<_> = fronts.map(|front| (front.gap as f64, front.peak_time_s)).collect();
        let fit = velocity.map(|velocity| {
            let slowness = pitch_m / velocity.velocity_m_per_s.value;
            let starts: Vec<f64> = peaks.iter().map(|(gap, time)| time.value - gap * slowness).collect();
            PeakFit {
                group_velocity_m_per_s: velocity.velocity_m_per_s,
                t_at_gap_zero_s: starts.iter().sum::<f64>() / starts.len().max(1) as f64,
            }
        });
        chainwave_figures::peak_trace(&self.folder.join("peak-trace"), &PeakTrace { peaks, pitch_m, fit })?;
        Ok(Figure {
            name: "peak-trace".into(),
            caption: "Peak of the leading pulse against time; its slope is the group velocity. Below: what is left.".into(),
        })
    }

    fn front_width(&self) -> Result<Figure, Error> {
        let measurement = &self.evaluation.measurement;
        let width = |width: &chainwave_analysis::HalfWidth| DataPoint::measured(width.t_s, width.hwhm_m);
        // Every sample would be a solid band: about 25 markers.
        let step = measurement.half_widths.len().div_ceil(25).max(1);
        let points = measurement.half_widths.iter().step_by(step).map(width).collect();
        let mut hwhm = vec![Series::measured("experiment", points)];
        if let Some(model) = &self.evaluation.model {
            let line = model.measurement.half_widths.iter().map(|width| (width.t_s, width.hwhm_m.value));
            hwhm.push(Series::model("chain model", line));
        }
        let pulses =
            self.profile_times_s().into_iter().filter_map(|time_s| self.aligned_pulse(time_s)).collect();
        let front = FrontWidth { pulses, hwhm, pitch_m: Some(self.experiment.chain.mean_pitch_m()) };
        chainwave_figures::front_width(&self.folder.join("front-width"), &front)?;
        Ok(Figure {
            name: "front-width".into(),
            caption:
                "Leading pulses aligned at their peaks, and the half width at half maximum of the front."
                    .into(),
        })
    }

    /// The leading pulse at a time; it breaks where strain was not measured, and is left out where that is so about its peak.
    fn aligned_pulse(&self, time_s: f64) -> Option<FrontPulse> {
        const REACH: f64 = 8.0;
        let map = &self.evaluation.measurement.strain;
        let index = nearest(&map.times_s, time_s);
        let fronts = self.evaluation.measurement.fronts.iter().flatten();
        let peaks: Vec<(f64, f64)> =
            fronts.map(|front| (front.gap as f64, front.peak_time_s.value)).collect();
        let peak = place_at(&peaks, map.times_s[index])?;
        let profile = about_peak(&broken_profile(&map.strain.column(index)), peak, REACH)?;
        Some(FrontPulse { time_s: map.times_s[index], profile })
    }

    fn peak_energy(&self) -> Result<Figure, Error> {
        let energies = self.evaluation.measurement.energies.as_ref();
        let model = self.evaluation.model.as_ref();
        // The input is what gap 1 would take up without damping; without a model, all that is known is what a gap was measured to take up.
        let modelled_input = model.and_then(|model| model.undamped_j.first().copied());
        let first = energies.and_then(|found| Some((*found.gaps.first()?, found.energy_j.first()?.value)));
        let relative_to_gap = first.map(|(gap, _)| gap).filter(|_| modelled_input.is_none());
        let input_j = modelled_input.or(first.map(|(_, energy_j)| energy_j)).unwrap_or(1.0);
        let measured = energies.map_or_else(Vec::new, |energies| {
            let point = |(gap, energy): (&usize, &Estimate)| {
                DataPoint::measured(*gap as f64, energy.scaled(1.0 / input_j))
            };
            energies.gaps.iter().zip(&energies.energy_j).map(point).collect()
        });
        let ratio = |energies: &[f64]| -> Vec<(f64, f64)> {
            energies.iter().enumerate().map(|(row, energy)| ((row + 1) as f64, energy / input_j)).collect()
        };
        // Where the pulse gains on its way, as in a stiffening chain, there is no loss to share.
        let share = model
            .and_then(ModelBeside::damping_share)
            .filter(|share| share.spread >= 0.0 && share.damped >= 0.0);
        let is_of_uniform_chain = self.experiment.is_uniform()?;
        let energy = PeakEnergy {
            measured,
            damped: model.map_or_else(Vec::new, |model| ratio(&model.damped_j)),
            undamped: model.map_or_else(Vec::new, |model| ratio(&model.undamped_j)),
            shares: share.map(|share| EnergyShares {
                dispersion: share.spread,
                damping: share.damped,
                gap: Some(share.gap),
                is_of_uniform_chain,
            }),
            relative_to_gap,
        };
        chainwave_figures::peak_energy(&self.folder.join("peak-energy"), &energy)?;
        let relative_to = match relative_to_gap {
            Some(gap) => format!("that of gap {gap}, as measured"),
            None => "the input, which is what gap 1 takes up without damping".into(),
        };
        let told = share.map_or_else(String::new, |share| told_of_loss(&share, is_of_uniform_chain));
        Ok(Figure {
            name: "peak-energy".into(),
            caption: format!("Peak potential energy of each gap relative to {relative_to}.{told}"),
        })
    }

    fn tail_spectrum(&self) -> Result<Figure, Error> {
        let measurement = &self.evaluation.measurement;
        let frequencies_hz = &measurement.spectrum.frequency_hz;
        // A tail cut short by the end of the record resolves nothing.
        let longest_s = measurement.spectrum.gaps.iter().map(|of_gap| of_gap.duration_s).fold(0.0, f64::max);
        let resolved = measurement.spectrum.gaps.iter().filter(|of_gap| of_gap.duration_s >= 0.4 * longest_s);
        let spectra = resolved.map(|of_gap| GapSpectrum {
            gap: of_gap.gap,
            frequencies_hz: frequencies_hz.clone(),
            amplitude: of_gap.amplitude.clone(),
        });
        let band_edge_hz = self.experiment.band_edge_hz()?;
        let mut marks =
            vec![FrequencyMark { name: "band edge of the chain model".into(), frequency_hz: band_edge_hz }];
        let line = measurement.local_resonance.as_ref().ok();
        let line = line.filter(|found| is_line_in_band(found, band_edge_hz));
        if let Some(line) = line {
            let frequency_hz = line.frequency_hz.value;
            marks.push(FrequencyMark { name: "frequency of the line".into(), frequency_hz });
        }
        let tail =
            TailSpectrum { spectra: spectra.collect(), marks, max_frequency_hz: Some(3.0 * band_edge_hz) };
        chainwave_figures::tail_spectrum(&self.folder.join("tail-spectrum"), &tail)?;
        Ok(Figure {
            name: "tail-spectrum".into(),
            caption: format!(
                "Amplitude spectrum of the strain behind the leading pulse. {}",
                told_of_the_tail(&measurement.local_resonance, band_edge_hz)
            ),
        })
    }

    fn dispersion(&self, map: &DispersionMap) -> Result<Figure, Error> {
        let panel = DispersionPanel {
            kappa_rad: map.kappa_rad.clone(),
            frequency_hz: map.frequency_hz.clone(),
            amplitude: map.amplitude.clone(),
            bands: self.experiment.bands(&map.kappa_rad)?,
            max_frequency_hz: 2.0 * self.experiment.band_edge_hz()?,
        };
        chainwave_figures::dispersion(&self.folder.join("dispersion"), &panel)?;
        Ok(Figure {
            name: "dispersion".into(),
            caption: format!(
                "Strain behind the leading pulse over phase from gap to gap and frequency, gaps {} to {}; waves that come back stand \
                 left of 0. Resolution {:.2} rad and {:.0} Hz.",
                map.gaps.0, map.gaps.1, map.kappa_resolution_rad, map.frequency_resolution_hz
            ),
        })
    }

    fn residuals(&self, model: &ModelBeside) -> Result<Figure, Error> {
        let map = &self.evaluation.measurement.strain;
        let residual = normalised_residuals(map, &model.measurement.strain);
        let panel = ResidualMapPanel { title: "strain".into(), times_s: map.times_s.clone(), residual };
        chainwave_figures::residual_map(&self.folder.join("residual-map"), &[panel])?;
        Ok(Figure {
            name: "residual-map".into(),
            caption: "Measured strain less the fitted chain model's, in units of the stated uncertainty."
                .into(),
        })
    }
}

/// What took the peak energy on its way.
fn told_of_loss(share: &DampingShare, is_of_uniform_chain: bool) -> String {
    let without_damping = match is_of_uniform_chain {
        true => "dispersion and rarefaction",
        false => "what the chain does without damping",
    };
    format!(
        " At gap {}, {without_damping} took {:.1} % of the undamped input and damping {:.1} %.",
        share.gap,
        100.0 * share.spread,
        100.0 * share.damped
    )
}

/// Whether the highest maximum of the tails' power is a frequency of the wave: a line by the test, where the chain lets waves pass.
fn is_line_in_band(found: &LocalResonance, band_edge_hz: f64) -> bool {
    line_rule().rejects(found.line.p_value) && found.frequency_hz.value <= band_edge_hz
}

/// What the highest maximum of the tails' power is, by the test for a line.
fn told_of_the_tail(found: &Result<LocalResonance, Missing>, band_edge_hz: f64) -> String {
    let found = match found {
        Ok(found) => found,
        Err(missing) => return format!("No frequency of it is stated: {}.", missing.as_str()),
    };
    let (frequency_hz, p_value) = (found.frequency_hz.value, found.line.p_value);
    let tested = format!(
        "if there were no line, tails would look as much like one at some frequency with a probability of {}",
        probability(p_value)
    );
    let of_what = if frequency_hz > band_edge_hz {
        "lies beyond the band of the chain model and is not marked"
    } else if is_line_in_band(found, band_edge_hz) {
        "is a line"
    } else {
        "is not told from the crest of a continuum, and is not marked"
    };
    format!(
        "Its highest maximum, at {frequency_hz:.0} Hz with a resolution of {:.0} Hz, {of_what}: {tested}.",
        found.resolution_hz
    )
}

/// A probability to two decimals, or two digits where it is small.
fn probability(p: f64) -> String {
    if p < 0.01 { format!("{p:.1e}") } else { format!("{p:.2}") }
}

/// A strain map with its traces.
fn panel_of(title: &str, measurement: &Measurement) -> StrainMapPanel {
    let fronts = measurement.fronts.iter().flatten();
    let fronts =
        fronts.map(|front| (front.gap, front.peak_time_s.value, front.edge_time_s.map(|edge| edge.value)));
    StrainMapPanel::new(title, &measurement.strain.times_s, &measurement.strain.strain, fronts)
}
