//! `chainwave correlate`: the displacement field between two images.

use std::path::{Path, PathBuf};

use chainwave_correlation::{Field, FieldPoint, Strain};
use chainwave_experiment::{FieldRequest, FoundField, MethodChoice, SensorFiles, field_table};
use chainwave_figures::{FieldMap, FieldPanel};
use chainwave_measurement::{Estimate, Lost, Recording};
use ndarray::Array2;

use crate::choices::{BY_HALF_SIZE, Choices, ChosenSize, file_name};
use crate::cli;
use crate::closing_line::{PointReadings, all_lost, closing_json, closing_line};
use crate::error::Error;
use crate::matching;
use crate::outcome::Outcome;
use crate::output::expect_apart;
use crate::parallel::threads;
use crate::progress;
use crate::table;
use crate::terminal::{say, tell};

/// Correlates two images and writes the field, its strain and its pictures.
pub(crate) fn correlate(arguments: &cli::Correlate) -> Result<Outcome, Error> {
    let choice = matching::choice(&arguments.matching)?;
    if arguments.strain_window.is_multiple_of(2) {
        let found = arguments.strain_window;
        return Err(Error::Argument(format!("--strain-window {found}: expected an odd number of points")));
    }
    table::expect_writable(&arguments.out)?;
    expect_files_apart(arguments)?;
    let [reference, deformed] = open(arguments)?;
    let (field, choices) = field(arguments, choice, reference.as_ref(), deformed.as_ref())?;
    let line = closing(&field)?;
    let reach = usize::from(arguments.strain_window) / 2;
    let strains = chainwave_correlation::strains(&field, reach, threads(arguments.jobs));
    table::write_result(&arguments.out, field_table(&field, &strains))?;
    draw(&arguments.out, &field, &strains)?;
    choices.write_beside(&arguments.out)?;
    choices.lines().iter().for_each(|line| print(line));
    print(&line);
    Ok(Outcome::default())
}

/// Refuses a table, or a picture beside it, in the place of a file that is read.
fn expect_files_apart(arguments: &cli::Correlate) -> Result<(), Error> {
    let cli::Correlate { reference, deformed, out, sensor, .. } = arguments;
    let of_sensor = [&sensor.dark, &sensor.flat].into_iter().flatten();
    let read: Vec<&Path> = [reference, deformed].into_iter().chain(of_sensor).map(PathBuf::as_path).collect();
    let [svg, png, _, drawing] = chainwave_figures::files_of(&out.with_extension(""));
    let drawn = [svg, png, drawing].map(|path| ("a picture of the field", path));
    let mut written = vec![("the table", out.clone()), ("what was chosen", Choices::path_beside(out))];
    written.extend(drawn);
    expect_apart(&read, &written)
}

/// The field on the grid that is asked for, or on one that the pictures ask for by themselves; and what was chosen.
fn field(
    arguments: &cli::Correlate,
    choice: MethodChoice,
    reference: &dyn Recording,
    deformed: &dyn Recording,
) -> Result<(Field, Choices), Error> {
    let accuracy_px = arguments.matching.accuracy;
    let (half_px, step_px) = (arguments.half_size.map(usize::from), arguments.step.map(usize::from));
    let request = FieldRequest { choice, half_px, step_px, n_threads: threads(arguments.jobs) };
    let bar = progress::bar("correlating", 0);
    let FoundField { field, method, settled } = request.carry_out(reference, deformed, &|n| bar.inc(n))?;
    bar.finish_and_clear();
    let mut choices = Choices::new(accuracy_px);
    if accuracy_px.is_some() {
        choices.add_method(&arguments.reference, method);
    }
    if settled.is_some() || step_px.is_none() {
        choices.add_sizes([ChosenSize {
            recording: file_name(&arguments.reference),
            point: "field".into(),
            half_width_px: field.half_px,
            half_height_px: field.half_px,
            step_px: Some(field.step_px),
            noise_px: settled.map(|settled| settled.floor_px),
            reason: settled.map_or(BY_HALF_SIZE.into(), |one| one.reason.to_string()),
        }]);
    }
    Ok((field, choices))
}

/// Opens both images, without what the sensor adds where that is known. What they say of themselves matters where they are read in an
/// unusual way.
fn open(arguments: &cli::Correlate) -> Result<[Box<dyn Recording>; 2], Error> {
    let cli::Correlate { reading, sensor: cli::Sensor { dark, flat }, .. } = arguments;
    let options = reading.options(None);
    let sensor = SensorFiles::read(dark.as_deref(), flat.as_deref(), &options)?;
    let is_unusual = reading.raw.is_some() || reading.partial || sensor.is_some();
    let open = |path: &Path| -> Result<Box<dyn Recording>, Error> {
        let opened = chainwave_camera::open_with(path, &options)?;
        let recording = match &sensor {
            Some(sensor) => sensor.correct(opened)?,
            None => opened,
        };
        for warning in recording.info().warnings.iter().filter(|_| is_unusual) {
            print(&format!("warning: {}: {warning}", path.display()));
        }
        Ok(recording)
    };
    let images = [open(&arguments.reference)?, open(&arguments.deformed)?];
    images.iter().filter_map(|image| one_of_many(image.as_ref())).for_each(|line| print(&line));
    other_size(&images).iter().for_each(|line| print(line));
    Ok(images)
}

/// What is said of a recording of several frames, of which one is taken.
fn one_of_many(image: &dyn Recording) -> Option<String> {
    let (path, n_frames) = (image.path().display(), image.info().n_frames);
    (n_frames > 1).then(|| {
        format!(
            "note: {path}: the first of its {n_frames} frames is taken (hint: `chainwave inspect {path} --frame K --out FRAME.tif` writes \
             another one)"
        )
    })
}

/// What is said of images of different sizes: the same place is then another column and row, unless both begin at one corner.
fn other_size([reference, deformed]: &[Box<dyn Recording>; 2]) -> Option<String> {
    let size = |image: &dyn Recording| [image.info().width_px, image.info().height_px];
    let [one, other] = [size(reference.as_ref()), size(deformed.as_ref())];
    (one != other).then(|| {
        format!(
            "warning: {} has {} x {} px and {} has {} x {} px: places are compared from the upper left corner of both (hint: images of one \
             camera, cut alike)",
            reference.path().display(),
            one[0],
            one[1],
            deformed.path().display(),
            other[0],
            other[1]
        )
    })
}

fn print(line: &str) {
    say!("{line}");
}

/// The closing line, or that every point is lost.
fn closing(field: &Field) -> Result<String, Error> {
    let found = |point: &FieldPoint| {
        let position = point.found.as_ref().ok()?.position;
        Some(PointReadings::new(format!("({}, {})", point.x_px, point.y_px), [Ok(&position)].into_iter()))
    };
    let readings: Vec<PointReadings> = field.points.iter().filter_map(found).collect();
    match readings.is_empty() {
        true => Err(all_lost(field.points.iter().filter_map(|point| point.found.as_ref().err()))),
        false => {
            let lost: Vec<Lost> =
                field.points.iter().filter_map(|point| point.found.as_ref().err().copied()).collect();
            tell("readings", closing_json(&readings, lost.len()));
            Ok(closing_line(&readings, &lost))
        }
    }
}

/// The pictures beside the table.
fn draw(out: &Path, field: &Field, strains: &[Option<Strain>]) -> Result<(), Error> {
    let n_columns = field.n_columns;
    let map = |value: &dyn Fn(usize) -> Option<f64>| {
        Array2::from_shape_fn((field.points.len() / n_columns, n_columns), |(row, column)| {
            value(row * n_columns + column)
        })
    };
    let moved = |i: usize| field.points[i].found.as_ref().ok().map(|found| found.position);
    let u = map(&|i| moved(i).map(|position| position.x_px.value - field.points[i].x_px));
    let v = map(&|i| moved(i).map(|position| position.y_px.value - field.points[i].y_px));
    let strain =
        |of: fn(&Strain) -> Estimate| map(&|i| strains[i].as_ref().map(|strain| 100.0 * of(strain).value));
    let (xx, yy, xy) = (strain(|s| s.xx), strain(|s| s.yy), strain(|s| s.xy));
    let panel = |title: &str, values| FieldPanel { title: title.into(), values };
    let x_px: Vec<f64> = field.points.iter().take(n_columns).map(|point| point.x_px).collect();
    let y_px: Vec<f64> = field.points.iter().step_by(n_columns).map(|point| point.y_px).collect();
    let panels = vec![
        panel("u (px)", u),
        panel("v (px)", v),
        panel("strain xx (%)", xx),
        panel("strain yy (%)", yy),
        panel("strain xy (%)", xy),
    ];
    let field_map = FieldMap { x_px, y_px, panels };
    Ok(chainwave_figures::field_map(&out.with_extension(""), &field_map)?)
}
