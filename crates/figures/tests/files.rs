//! The files that the figures write, looked at from outside.

use std::fs;
use std::path::Path;

use chainwave_figures::{
    Against, BodyMotion, DataPoint, DecimalSign, Draw, FigureError, Format, FrequencyMark, FrontPulse,
    FrontWidth, GapSpectrum, GroupVelocities, GroupVelocityFigure, PeakEnergy, PeakFit, PeakTrace, Picture,
    ProfilePanel, ResidualMapPanel, RightHalves, Series, StrainMapPanel, Style, TailSpectrum, displacements,
    front_width, group_velocity, peak_energy, peak_trace, residual_map, right_halves, strain_map,
    strain_profiles, tail_spectrum,
};
use chainwave_measurement::Estimate;
use ndarray::Array2;

type Outcome = Result<(), FigureError>;

const NAMES: [(&str, &[&str]); 10] = [
    ("strain_map", &["compressive strain −u_n (%)", "gap number n", "time (ms)", "not measured"]),
    ("residual_map", &["(measured − model) / σ"]),
    ("strain_profiles", &["compressive strain −u_n (%)", "t = 2.73 ms", "experiment"]),
    ("front_width", &["distance from the peak (cells)", "half width at half maximum (mm)"]),
    ("right_halves", &["distance from the peak (cells)", "HWHM (mm)"]),
    ("peak_trace", &["c_g = 52.00 ± 0.10 m/s", "residual (µs)"]),
    ("group_velocity", &["striker velocity v_s (m/s)", "group velocity c_g (m/s)"]),
    ("peak_energy", &["peak energy Ψ(n) / input", "without damping"]),
    ("tail_spectrum", &["frequency (kHz)", "strain amplitude", "band edge"]),
    ("displacements", &["displacement (mm)", "lost"]),
];

fn draw_all(folder: &Path) -> Outcome {
    let stem = |name: &str| folder.join(name);
    draw_maps(&stem("strain_map"), &stem("residual_map"))?;
    let curve = |x: f64| -0.05 * (-0.1 * x).exp();
    let points: Vec<DataPoint> = (1..20)
        .map(|n| DataPoint::measured(f64::from(n), Estimate::new(curve(f64::from(n)), 1e-3)))
        .collect();
    let series = vec![Series::measured("experiment", points.clone())];
    let profile = ProfilePanel { time_s: 2.73e-3, series: series.clone(), front: Some((3.0, 5.0)) };
    strain_profiles(&stem("strain_profiles"), &[profile])?;
    let pulse = FrontPulse { time_s: 1e-3, profile: vec![(0.0, -0.05), (2.0, -0.01)] };
    let front = FrontWidth { pulses: vec![pulse], hwhm: series.clone(), pitch_m: Some(0.03) };
    front_width(&stem("front_width"), &front)?;
    right_halves(&stem("right_halves"), &RightHalves(front))?;
    let fit = PeakFit { group_velocity_m_per_s: Estimate::new(52.0, 0.1), t_at_gap_zero_s: 0.0 };
    let peaks = (1..20).map(|n| (f64::from(n), Estimate::new(0.03 * f64::from(n) / 52.0, 1e-6)));
    let trace = PeakTrace { peaks: peaks.collect(), pitch_m: 0.03, fit: Some(fit) };
    peak_trace(&stem("peak_trace"), &trace)?;
    group_velocity(&stem("group_velocity"), &GroupVelocities { series, sound_speed_m_per_s: None })?;
    let undamped = vec![(1.0, 1.0), (20.0, 0.4)];
    let energy =
        PeakEnergy { measured: points, damped: vec![], undamped, shares: None, relative_to_gap: None };
    peak_energy(&stem("peak_energy"), &energy)?;
    let amplitude = vec![1e-3, 1e-4, 1e-5];
    let spectrum = GapSpectrum { gap: 4, frequencies_hz: vec![0.0, 500.0, 1000.0], amplitude };
    let marks = vec![FrequencyMark { name: "band edge".into(), frequency_hz: 572.0 }];
    tail_spectrum(
        &stem("tail_spectrum"),
        &TailSpectrum { spectra: vec![spectrum], marks, max_frequency_hz: None },
    )?;
    let samples =
        vec![(0.0, Some(Estimate::new(0.0, 1e-5))), (1e-3, Some(Estimate::new(1e-3, 1e-5))), (2e-3, None)];
    displacements(&stem("displacements"), &[BodyMotion { body: 3, samples, model: vec![] }])
}

fn draw_maps(strain_stem: &Path, residual_stem: &Path) -> Outcome {
    let times_s: Vec<f64> = (0..450).map(|i| 4e-5 * f64::from(i)).collect();
    let values =
        Array2::from_shape_fn((25, 450), |(n, i)| (n != 9).then(|| (0.37 * (n * 7 + i) as f64).sin()));
    let panel = StrainMapPanel {
        title: "experiment".into(),
        times_s: times_s.clone(),
        strain: values.clone(),
        peak_trace: vec![(1.0, 1e-3), (25.0, 15e-3)],
        leading_edge: vec![(1.0, 0.5e-3), (25.0, 13e-3)],
    };
    strain_map(strain_stem, &[panel])?;
    residual_map(residual_stem, &[ResidualMapPanel { title: String::new(), times_s, residual: values }])
}

#[test]
fn every_figure_writes_its_files_with_its_labels_and_the_same_bytes_again() {
    let (first, second) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    draw_all(first.path()).unwrap();
    draw_all(second.path()).unwrap();
    for (name, labels) in NAMES {
        let is_map = name.ends_with("_map");
        for ending in if is_map { &["svg", "png", "cbor"][..] } else { &["svg", "png", "cbor", "csv"] } {
            let file = format!("{name}.{ending}");
            let bytes = fs::read(first.path().join(&file)).unwrap();
            assert_eq!(bytes, fs::read(second.path().join(&file)).unwrap(), "{file}");
            // A page of many megabytes would make the report slow.
            assert!(bytes.len() < 1_000_000, "{file}: {} bytes", bytes.len());
        }
        let document = fs::read_to_string(first.path().join(format!("{name}.svg"))).unwrap();
        for label in labels {
            assert!(document.contains(label), "{name}: {label}");
        }
        assert!(document.contains("mm\""), "{name} states its size");
        let image = fs::read(first.path().join(format!("{name}.png"))).unwrap();
        assert_eq!(&image[1..4], b"PNG");
    }
    let n_files = fs::read_dir(first.path()).unwrap().count();
    // Two of the nine are maps.
    assert_eq!(n_files, 4 * NAMES.len() - 2, "no temporary file stays");
}

#[test]
fn a_figure_that_was_kept_is_drawn_again_to_the_last_byte_and_in_another_style() {
    let folder = tempfile::tempdir().unwrap();
    draw_all(folder.path()).unwrap();
    let wide =
        Style { column_mm: 120.0, page_mm: 240.0, decimal_sign: DecimalSign::Comma, ..Style::default() };
    for (name, _) in NAMES {
        let picture = Picture::read(&folder.path().join(format!("{name}.cbor"))).unwrap();
        let again = picture.draw(&Style::default()).unwrap();
        let svg = fs::read(folder.path().join(format!("{name}.svg"))).unwrap();
        assert_eq!(again.bytes(Format::Svg).unwrap(), svg, "{name}");
        let width_mm = picture.draw(&wide).unwrap().size_mm().0;
        assert!(width_mm > again.size_mm().0 + 1.0, "{name}: {width_mm} mm");
    }
}

#[test]
fn what_is_no_kept_figure_is_refused_with_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("torn.cbor");
    for bytes in [&b""[..], b"no figure", &[0xa2, 0x66]] {
        fs::write(&path, bytes).unwrap();
        let said = Picture::read(&path).unwrap_err().to_string();
        assert!(said.contains("torn.cbor") && said.contains("expected the values of a figure"), "{said}");
    }
    assert!(Picture::read(&folder.path().join("none.cbor")).is_err());
}

#[test]
fn every_format_is_written_and_the_table_has_the_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let points: Vec<DataPoint> =
        (1..4).map(|n| DataPoint::measured(f64::from(n), Estimate::new(50.0 - f64::from(n), 0.25))).collect();
    let velocities =
        GroupVelocities { series: vec![Series::measured("experiment", points)], sound_speed_m_per_s: None };
    let figure = GroupVelocityFigure { velocities, against: Against::Striker };
    figure.draw(&Style::default()).unwrap().write(&folder.path().join("v"), &Format::ALL).unwrap();
    let read = |ending: &str| fs::read(folder.path().join(format!("v.{ending}"))).unwrap();
    assert!(read("svg").starts_with(b"<svg") && read("pdf").starts_with(b"%PDF"));
    assert_eq!(&read("png")[1..4], b"PNG");
    let table = String::from_utf8(read("csv")).unwrap();
    assert_eq!(table.lines().count(), 4);
    assert!(
        table.contains(",experiment,striker velocity v_s (m/s),2,0,group velocity c_g (m/s),48,0.25,,"),
        "{table}"
    );
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 4, "no temporary file stays");
}

#[test]
fn a_dot_in_the_stem_stays() {
    let folder = tempfile::tempdir().unwrap();
    let velocities = GroupVelocities { series: vec![], sound_speed_m_per_s: Some(54.0) };
    group_velocity(&folder.path().join("v_2.73"), &velocities).unwrap();
    assert!(folder.path().join("v_2.73.svg").exists() && folder.path().join("v_2.73.png").exists());
}

#[test]
fn a_missing_folder_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let stem = folder.path().join("missing").join("figure");
    let velocities = GroupVelocities { series: vec![], sound_speed_m_per_s: None };
    let message = group_velocity(&stem, &velocities).unwrap_err().to_string();
    assert!(message.contains("missing") && message.contains("figure.svg"), "{message}");
}
