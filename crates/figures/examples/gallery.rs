//! Draws every figure from made-up, analytic data into the folder given as the argument: SVG, PNG, PDF and the table of its
//! numbers.

use std::error::Error;
use std::path::{Path, PathBuf};

use chainwave_figures::{
    Against, BodyMotion, ContactCurve, CoverageCount, CoverageRow, DataPoint, DispersionPanel, Draw,
    EnergyShares, ExtremeRow, FieldMap, FieldPanel, Format, FrequencyMark, FrontPulse, FrontWidth,
    GapSpectrum, GroupVelocities, GroupVelocityFigure, LongChain, PeakCurve, PeakEnergy, PeakFit, PeakTrace,
    PointMotion, ProfilePanel, ResidualMapPanel, RightHalves, Series, StrainMapPanel, Style, TailSpectrum,
    TradeOff, TradeOffPoint,
};
use chainwave_measurement::Estimate;
use ndarray::Array2;

const N_GAPS: usize = 25;
const PITCH_M: f64 = 0.03;
const SPEED_M_PER_S: f64 = 51.6;

type Outcome = Result<(), Box<dyn Error>>;

fn main() -> Outcome {
    let folder = PathBuf::from(std::env::args_os().nth(1).ok_or("usage: gallery FOLDER")?);
    std::fs::create_dir_all(&folder)?;
    contact(&folder)?;
    long_chain(&folder)?;
    tables(&folder)?;
    fields(&folder)?;
    waves(&folder)?;
    maps(&folder)?;
    profiles(&folder)?;
    widths(&folder)?;
    trace(&folder)?;
    velocities(&folder)?;
    energies(&folder)?;
    spectra(&folder)?;
    motions(&folder)?;
    coverages(&folder)?;
    Ok(())
}

fn save<D: Draw + ?Sized>(folder: &Path, name: &str, drawn: &D) -> Outcome {
    Ok(drawn.draw(&Style::default())?.write(&folder.join(name), &Format::ALL)?)
}

/// Time at which the pulse of a gap peaks.
fn peak_s(gap: f64) -> f64 {
    0.8e-3 + gap * PITCH_M / SPEED_M_PER_S
}

/// A pulse that widens and decays, with an oscillating tail behind it.
fn strain(gap: f64, t_s: f64) -> f64 {
    let behind_s = t_s - peak_s(gap);
    let peak = 0.055 * gap.powf(-0.18);
    if behind_s < 0.0 {
        let width_s = 0.42e-3 * (1.0 + 0.05 * gap);
        -peak * (-(behind_s / width_s).powi(2)).exp()
    } else {
        let decay = (-behind_s / 2.2e-3).exp();
        -peak
            * decay
            * (0.22 + 0.78 * (std::f64::consts::TAU * 480.0 * behind_s * (1.0 + 60.0 * behind_s)).cos())
    }
}

/// Numbers between -1 and 1 that look random.
fn noise(i: usize, j: usize) -> f64 {
    let mixed = (i as f64 * 12.9898 + j as f64 * 78.233).sin() * 43_758.545_3;
    2.0 * (mixed - mixed.floor()) - 1.0
}

fn gaps() -> impl Iterator<Item = f64> {
    (1..=N_GAPS).map(|gap| gap as f64)
}

fn maps(folder: &Path) -> Outcome {
    let times_s: Vec<f64> = (0..450).map(|i| 4e-5 * f64::from(i)).collect();
    let shape = (N_GAPS, times_s.len());
    let model = Array2::from_shape_fn(shape, |(n, i)| Some(strain((n + 1) as f64, times_s[i])));
    let seen = |n: usize, i: usize| n != 17 && !(n > 20 && i > 380) && !(n < 3 && i < 14);
    let measured = Array2::from_shape_fn(shape, |(n, i)| {
        seen(n, i).then(|| strain((n + 1) as f64, times_s[i]) + 1.5e-3 * noise(n, i))
    });
    let peaks: Vec<_> = gaps().map(|gap| (gap, peak_s(gap))).collect();
    let edges: Vec<_> = gaps().map(|gap| (gap, peak_s(gap) - 0.9e-3 * (1.0 + 0.05 * gap))).collect();
    let panel = |title: &str, strain: &Array2<Option<f64>>, traces: bool| StrainMapPanel {
        title: title.into(),
        times_s: times_s.clone(),
        strain: strain.clone(),
        peak_trace: if traces { peaks.clone() } else { Vec::new() },
        leading_edge: if traces { edges.clone() } else { Vec::new() },
    };
    let experiment = panel("experiment", &measured, true);
    let chain = panel("discrete elements", &model, false);
    let ring = panel("finite elements", &model, false);
    save(folder, "strain_map", &[experiment.clone(), ring, chain.clone()][..])?;
    save(folder, "strain_map_two", &[experiment.clone(), chain][..])?;
    save(folder, "strain_map_single", &[experiment][..])?;
    let residual = Array2::from_shape_fn(shape, |(n, i)| {
        let sum: f64 = (0..6).map(|k| noise(n + 31 * k, i + 57 * k)).sum();
        seen(n, i).then(|| 0.7 * sum + 60.0 * strain((n + 1) as f64, times_s[i]) * noise(n, 7))
    });
    let panel = ResidualMapPanel { title: "strain".into(), times_s, residual };
    save(folder, "residual_map", &[panel][..])?;
    Ok(())
}

fn profiles(folder: &Path) -> Outcome {
    let panel = |time_s: f64| {
        let measured = gaps().map(|gap| {
            let value = strain(gap, time_s) + 1.5e-3 * noise(gap as usize, (1e6 * time_s) as usize);
            DataPoint::measured(gap, Estimate::new(value, 1.2e-3))
        });
        let peak = (time_s - 0.8e-3) * SPEED_M_PER_S / PITCH_M;
        ProfilePanel {
            time_s,
            series: vec![
                Series::measured("experiment", measured.collect()),
                Series::model("finite elements", gaps().map(|gap| (gap, strain(gap, time_s - 4e-5)))),
                Series::model("discrete elements", gaps().map(|gap| (gap, 1.04 * strain(gap, time_s)))),
            ],
            front: Some((peak, peak + 2.5 + 0.1 * peak)),
        }
    };
    save(folder, "strain_profiles", &[2.73e-3, 6.78e-3, 10.88e-3].map(panel)[..])?;
    save(folder, "strain_profiles_single", &[panel(6.78e-3)][..])?;
    Ok(())
}

fn widths(folder: &Path) -> Outcome {
    let half_width = |t_s: f64| 0.9 + 6.0 * t_s.powf(0.42);
    let pulse = |t_s: f64| FrontPulse {
        time_s: t_s,
        profile: (0..=100)
            .map(|i| 0.08 * f64::from(i))
            .map(|x| (x, -0.056 / (1.0 + 8.0 * t_s) * (-(x / half_width(t_s)).powi(2) * 0.693).exp()))
            .collect(),
    };
    let measured = (3..30).map(|i| 0.5e-3 * f64::from(i)).map(|t_s| {
        let value = PITCH_M * (half_width(t_s) + 0.04 * noise((2e4 * t_s) as usize, 3));
        DataPoint::measured(t_s, Estimate::new(value, 1.3e-3))
    });
    let model = (1..=71).map(|i| 1e-3 * f64::from(i)).map(|t_s| (t_s, PITCH_M * half_width(t_s)));
    let front = FrontWidth {
        pulses: [1.7e-3, 3.9e-3, 15e-3, 29e-3, 43e-3, 57e-3, 71e-3].map(pulse).to_vec(),
        hwhm: vec![
            Series::measured("experiment", measured.collect()),
            Series::model("finite elements, N = 300", model),
        ],
        pitch_m: Some(PITCH_M),
    };
    save(folder, "front_width", &front)?;
    save(folder, "right_halves", &RightHalves(front))?;
    Ok(())
}

fn trace(folder: &Path) -> Outcome {
    let peaks = gaps().map(|gap| {
        let scatter_s = 4e-6 * noise(gap as usize, 11) + 2e-8 * (gap - 13.0).powi(2);
        (gap, Estimate::new(peak_s(gap) + scatter_s, 3e-6))
    });
    let fit = PeakFit { group_velocity_m_per_s: Estimate::new(51.612, 0.036), t_at_gap_zero_s: 0.8e-3 };
    let trace = PeakTrace { peaks: peaks.collect(), pitch_m: PITCH_M, fit: Some(fit) };
    save(folder, "peak_trace", &trace)?;
    let time_s = |gap: f64| 0.8e-3 + 5.4e-4 * gap + 1.6e-6 * gap * gap;
    let curve = PeakCurve {
        peaks: gaps()
            .map(|gap| (gap, Estimate::new(time_s(gap) + 2e-6 * noise(gap as usize, 4), 3e-6)))
            .collect(),
        pitch_m: PITCH_M,
        group_velocity_m_per_s: Estimate::new(51.5, 0.4),
        variation: Estimate::new(0.069, 0.004),
        curve: gaps().map(|gap| (gap, time_s(gap))).collect(),
    };
    save(folder, "peak_curve", &curve)?;
    Ok(())
}

fn velocities(folder: &Path) -> Outcome {
    let speed = |striker: f64| 45.0 + 9.0 * (-striker / 4.5).exp();
    let measured = [(2.73, 0.05), (1.89, 0.07), (0.83, 0.04)].map(|(striker, sigma)| DataPoint {
        x: Estimate::new(striker, sigma),
        y: Estimate::new(speed(striker) + 0.1, 0.12),
    });
    let rings = [2.73, 1.89, 0.83].map(|striker| (striker, speed(striker) - 0.2));
    let chain = (1..=40).map(|i| 0.25 * f64::from(i)).map(|striker| (striker, speed(striker)));
    let velocities = GroupVelocities {
        series: vec![
            Series::measured("experiment", measured.to_vec()),
            Series::model_points("finite elements", rings),
            Series::model("discrete elements", chain),
        ],
        sound_speed_m_per_s: Some(54.0),
    };
    let against = Against::Striker;
    let short = GroupVelocities { series: velocities.series[..2].to_vec(), ..velocities };
    save(folder, "group_velocity", &GroupVelocityFigure { velocities, against })?;
    save(folder, "group_velocity_short", &GroupVelocityFigure { velocities: short, against })?;
    Ok(())
}

fn coverages(folder: &Path) -> Outcome {
    let quantities = ["displacement", "group velocity", "c_d, tracks", "trigger offset"];
    let rows: Vec<CoverageRow> = quantities
        .iter()
        .enumerate()
        .map(|(i, quantity)| CoverageRow {
            quantity: (*quantity).into(),
            within_68: Estimate::new(0.68 + 0.03 * noise(i, 6), 0.02),
            within_95: Estimate::new(0.95 + 0.01 * noise(i, 7), 0.01),
        })
        .collect();
    save(folder, "coverage", &rows[..])?;
    let counts: Vec<CoverageCount> = quantities
        .iter()
        .enumerate()
        .map(|(i, quantity)| CoverageCount {
            quantity: (*quantity).into(),
            n: 40,
            within_68: 25 + i,
            within_95: 37 + i % 4,
        })
        .collect();
    save(folder, "coverage_counts", &counts[..])?;
    Ok(())
}

fn energies(folder: &Path) -> Outcome {
    let undamped = |gap: f64| 0.15 + 0.85 * gap.powf(-0.42);
    let damped = |gap: f64| undamped(gap) * (-(gap - 1.0) / 140.0).exp();
    let measured = || {
        (1..=20).map(f64::from).map(|gap| {
            let value = damped(gap) * (1.0 + 0.03 * noise(gap as usize, 5));
            DataPoint::measured(gap, Estimate::new(value, 0.025 * value.sqrt()))
        })
    };
    let curve = |n_gaps: i32, f: &dyn Fn(f64) -> f64| {
        (1..=n_gaps).map(f64::from).map(|gap| (gap, f(gap))).collect::<Vec<_>>()
    };
    for (name, n_gaps) in [("peak_energy", 250), ("peak_energy_short", 25)] {
        let end = f64::from(n_gaps);
        let energy = PeakEnergy {
            measured: measured().collect(),
            damped: curve(n_gaps, &damped),
            undamped: curve(n_gaps, &undamped),
            shares: Some(EnergyShares {
                dispersion: 1.0 - undamped(end),
                damping: undamped(end) - damped(end),
                gap: Some(n_gaps as usize),
                is_of_uniform_chain: true,
            }),
            relative_to_gap: None,
        };
        save(folder, name, &energy)?;
    }
    Ok(())
}

fn spectra(folder: &Path) -> Outcome {
    let spectrum = |gap: usize| {
        let frequencies_hz: Vec<f64> = (0..260).map(|i| 12.5 * f64::from(i)).collect();
        let amplitude = |(i, f): (usize, &f64)| {
            let ridge = 8e-4 / (1.0 + ((f - 560.0 + 4.0 * (N_GAPS - gap) as f64) / 45.0).powi(2));
            let slow = 4e-4 * (-(f / 260.0).powi(2)).exp();
            (ridge + slow) * (1.0 - 0.02 * gap as f64) + 1.5e-6 * (1.3 + noise(i, gap))
        };
        let amplitude = frequencies_hz.iter().enumerate().map(amplitude).collect();
        GapSpectrum { gap, frequencies_hz, amplitude }
    };
    let mark = |name: &str, frequency_hz| FrequencyMark { name: name.into(), frequency_hz };
    let tail = TailSpectrum {
        spectra: (1..=N_GAPS).filter(|&gap| gap != 18).map(spectrum).collect(),
        marks: vec![mark("band edge, 572 Hz", 572.0), mark("local resonance, 541 Hz", 541.0)],
        max_frequency_hz: Some(2000.0),
    };
    save(folder, "tail_spectrum", &tail)?;
    Ok(())
}

fn motions(folder: &Path) -> Outcome {
    let body = |body: usize| {
        let arrival_s = peak_s(body as f64) - 0.6e-3;
        let x_m = |t_s: f64| {
            let since_s = (t_s - arrival_s).max(0.0);
            0.017 * (1.0 - (-since_s / 6e-3).exp())
                + 4e-4 * (3000.0 * since_s).sin() * (-since_s / 4e-3).exp()
        };
        let lost = |i: usize| body == 14 && (560..700).contains(&i);
        let sample = |i: usize| {
            let t_s = 2e-5 * i as f64;
            let measured =
                Estimate::new(x_m(t_s) + 2e-5 * noise(i, body), 6e-5 + 6e-3 * t_s * (body as f64 / 26.0));
            (t_s, (!lost(i)).then_some(measured))
        };
        BodyMotion {
            body,
            samples: (0..900).map(sample).collect(),
            model: (0..450).map(|i| 4e-5 * f64::from(i)).map(|t_s| (t_s, 1.01 * x_m(t_s))).collect(),
        }
    };
    let bodies: Vec<BodyMotion> = [1, 5, 9, 14, 20, 26].map(body).to_vec();
    save(folder, "displacements", &bodies[..])?;
    let point = |k: usize| {
        let samples = body(1 + k % 26).samples.into_iter().map(|(t_s, x)| (t_s, x.map(|x| x.scaled(8e3))));
        PointMotion {
            name: format!("point_{} {}", 1 + k / 2, ["x", "y"][k % 2]),
            samples: samples.collect(),
            in_frames: false,
        }
    };
    save(folder, "tracks", &(0..20).map(point).collect::<Vec<_>>()[..])?;
    Ok(())
}

/// A softening law and a compression test that follows it.
fn contact(folder: &Path) -> Outcome {
    let force = |mm: f64| 60.1 * ((mm + 2.27).powf(0.114) - 2.27_f64.powf(0.114));
    let places = || (0..=50).map(|i| 2e-4 * f64::from(i));
    let wave = |x_m: f64| 4e-3 * (900.0 * x_m).sin();
    let measured = places().map(|x_m| {
        let value = force(1e3 * x_m) + wave(x_m) + 4e-3 * noise((1e6 * x_m) as usize, 8);
        DataPoint::measured(x_m, Estimate::new(value, 5e-3))
    });
    let measured: Vec<DataPoint> = measured.collect();
    let left = measured.iter().map(|point| DataPoint {
        y: Estimate::new(point.y.value - force(1e3 * point.x.value), point.y.sigma),
        ..*point
    });
    let left = Series::measured("experiment", left.collect());
    let law = Series::model("$F = A(Δ + δ_0)^p − f_0$", places().map(|x_m| (x_m, force(1e3 * x_m))));
    let curve =
        ContactCurve { series: vec![Series::measured("experiment", measured), law], residuals: Some(left) };
    save(folder, "contact_curve", &curve)
}

fn long_chain(folder: &Path) -> Outcome {
    let profile = |t_s: f64| {
        let (front, height) = (SPEED_M_PER_S * t_s / PITCH_M, 0.055 * (5e-3 / t_s).powf(0.25));
        let strain = move |n: f64| {
            let behind = front - n;
            let width = 4.0 + 60.0 * t_s;
            if behind < 0.0 {
                -height * (-(behind / width).powi(2)).exp()
            } else {
                -height * (-behind / 45.0).exp() * (0.3 + 0.7 * (behind / 2.6).cos())
            }
        };
        (t_s, (1..300).map(f64::from).map(|n| (n, strain(n))).collect())
    };
    let profiles = [20e-3, 52e-3, 84e-3, 116e-3, 148e-3].map(profile).to_vec();
    save(folder, "long_chain", &LongChain { profiles })
}

/// Figures of tables: extreme cases and methods.
fn tables(folder: &Path) -> Outcome {
    let row = |i: usize| ExtremeRow {
        name: format!("case number {}, velocity_m_per_s = {:e}", i / 6, 10.0_f64.powi(i as i32 % 6 - 3)),
        share_of_bound: (i % 17 != 3)
            .then(|| 10.0_f64.powf(3.0 * noise(i, 2) - 3.0 + f64::from(i == 40) * 4.0)),
        passed: i != 40,
    };
    save(folder, "extremes", &(0..110).map(row).collect::<Vec<_>>()[..])?;
    let method = |i: usize| TradeOffPoint {
        name: format!("method_{i}, step_s = 1e-6"),
        seconds_per_item: 1e-6 * 2.0_f64.powi(i as i32),
        error: 1e-2 * 0.4_f64.powi(i as i32) * (1.0 + f64::from(i % 3 == 1) * 20.0),
        on_front: i % 3 != 1,
    };
    let methods = TradeOff {
        time_label: "time per item (s)".into(),
        error_label: "error (px)".into(),
        points: (0..9).map(method).collect(),
    };
    save(folder, "trade_off", &methods)
}

fn fields(folder: &Path) -> Outcome {
    let places = |n: usize| -> Vec<f64> { (0..n).map(|i| 20.0 + 10.0 * i as f64).collect() };
    let (x_px, y_px) = (places(60), places(40));
    let map = |f: &dyn Fn(f64, f64) -> f64| {
        Array2::from_shape_fn((40, 60), |(row, column)| {
            let hole = (row as f64 - 20.0).hypot(column as f64 - 30.0) < 6.0;
            (!hole && (row * 7 + column * 3) % 211 != 0).then(|| f(x_px[column], y_px[row]))
        })
    };
    let u = map(&|x, y| 1.5 + 2e-3 * x + 4e-4 * y);
    let xx = map(&|x, y| 0.2 * (0.02 * x).sin() * (0.015 * y).cos());
    let panels = vec![
        FieldPanel { title: "displacement $u$ (px)".into(), values: u },
        FieldPanel { title: "strain $ε_{xx}$ (%)".into(), values: xx },
    ];
    save(folder, "field_map", &FieldMap { x_px, y_px, panels })
}

fn waves(folder: &Path) -> Outcome {
    use std::f64::consts::PI;
    let kappa_rad: Vec<f64> = (0..64).map(|row| -PI + PI / 32.0 * f64::from(row)).collect();
    let frequency_hz: Vec<f64> = (0..400).map(|bin| 4.0 * f64::from(bin)).collect();
    let curve: Vec<(f64, f64)> = kappa_rad.iter().map(|k| (*k, 572.0 * (0.5 * k).sin().abs())).collect();
    let amplitude = Array2::from_shape_fn((64, 400), |(row, bin)| {
        let crest = 1e-3 / (1.0 + ((frequency_hz[bin] - curve[row].1) / 30.0).powi(2));
        if kappa_rad[row] < 0.0 { 0.1 * crest } else { crest }
    });
    let panel =
        DispersionPanel { kappa_rad, frequency_hz, amplitude, bands: vec![curve], max_frequency_hz: 1200.0 };
    save(folder, "dispersion", &panel)
}
