//! `chainwave correlate`: the displacement field between two images.

use std::path::Path;

use chainwave_correlation::{
    ChosenGrid, Field, FieldGrid, FieldPoint, Interpolation, Method, PicturePair, Reference, ReferenceFrames,
    Settings, ShapeChoice, Strain, Window,
};
use chainwave_experiment::SensorFiles;
use chainwave_figures::{FieldMap, FieldPanel};
use chainwave_measurement::{Estimate, Recording, Region, Subset};
use ndarray::Array2;
use polars::prelude::Column;

use crate::choices::{Choices, ChosenSize, file_name, noise_px};
use crate::cli;
use crate::closing::{PointReadings, all_lost, closing_line};
use crate::error::Error;
use crate::matching::Chosen;
use crate::outcome::Outcome;
use crate::parallel::threads;
use crate::progress;
use crate::table::{self, column};

/// Correlates two images and writes the field, its strain and its pictures.
pub(crate) fn correlate(arguments: &cli::Correlate) -> Result<Outcome, Error> {
    let chosen = Chosen::of(&arguments.matching)?;
    if arguments.strain_window.is_multiple_of(2) {
        let found = arguments.strain_window;
        return Err(Error::Argument(format!("--strain-window {found}: expected an odd number of points")));
    }
    table::expect_writable(&arguments.out)?;
    let [reference, deformed] = open(arguments)?;
    let (field, choices) = field(arguments, &chosen, reference.as_ref(), deformed.as_ref())?;
    let line = closing(&field)?;
    let strains = chainwave_correlation::strains(&field, usize::from(arguments.strain_window) / 2);
    table::write(&arguments.out, columns(&field, &strains))?;
    draw(&arguments.out, &field, &strains)?;
    choices.write_beside(&arguments.out)?;
    choices.lines().iter().for_each(|line| print(line));
    print(&line);
    Ok(Outcome::default())
}

/// The field on the grid that is asked for, or on one that the pictures ask for by themselves; and what was chosen.
fn field(
    arguments: &cli::Correlate,
    chosen: &Chosen,
    reference: &dyn Recording,
    deformed: &dyn Recording,
) -> Result<(Field, Choices), Error> {
    let accuracy_px = arguments.matching.accuracy;
    let whole = Reference::read_whole(reference, &ReferenceFrames::Single(0))?;
    let by_texture = match arguments.half_size {
        Some(_) => None,
        None => Some(ChosenGrid::by_texture(&whole, noise_px(accuracy_px))?),
    };
    let half_px = by_texture.map_or(arguments.half_size.map_or(0, usize::from), |chosen| chosen.grid.half_px);
    let (interpolation, shape) = solver(chosen, reference, half_px)?;
    let bar = progress::bar("correlating", 0);
    let pair = PicturePair {
        reference: &whole,
        target: &window(deformed, interpolation)?,
        settings: &Settings::default(),
        choice: shape,
        n_threads: threads(arguments.jobs),
        progress: &|n| bar.inc(n),
    };
    let step_px = arguments.step.map(usize::from);
    let on = |grid: FieldGrid| pair.field(FieldGrid { step_px: step_px.unwrap_or(grid.step_px), ..grid });
    let mut choices = Choices::new(accuracy_px);
    if accuracy_px.is_some() {
        choices.add_method(&arguments.reference, Method::IcGn { interpolation, shape });
    }
    let (field, settled) = match by_texture {
        None => (on(FieldGrid::with_half(half_px))?, None),
        Some(by_texture) => {
            let (settled, field) = by_texture.correlate(&pair, noise_px(accuracy_px))?;
            (if step_px.is_some() { on(settled.grid)? } else { field }, Some(settled))
        }
    };
    bar.finish_and_clear();
    if settled.is_some() || step_px.is_none() {
        choices.add_sizes([ChosenSize {
            recording: file_name(&arguments.reference),
            point: "field".into(),
            half_width_px: field.half_px,
            half_height_px: field.half_px,
            step_px: Some(field.step_px),
            noise_px: settled.map(|settled| settled.floor_px),
            reason: settled
                .map_or("the step that goes with the half size".into(), |one| one.reason.to_string()),
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
    Ok([open(&arguments.reference)?, open(&arguments.deformed)?])
}

#[expect(clippy::print_stdout, reason = "what was correlated is no failure: standard error stays empty")]
fn print(line: &str) {
    println!("{line}");
}

/// The closing line, or that every point is lost.
fn closing(field: &Field) -> Result<String, Error> {
    let found = |point: &FieldPoint| {
        let position = point.found.as_ref().ok()?.position;
        Some(PointReadings::new(format!("({}, {})", point.x_px, point.y_px), [Some(&position)].into_iter()))
    };
    let readings: Vec<PointReadings> = field.points.iter().filter_map(found).collect();
    match readings.is_empty() {
        true => Err(all_lost(field.points.iter().filter_map(|point| point.found.as_ref().err()))),
        false => Ok(closing_line(&readings, field.points.len() - readings.len())),
    }
}

/// The first frame; what saturates in it counts as unseen.
fn window(recording: &dyn Recording, interpolation: Interpolation) -> Result<Window, Error> {
    let info = recording.info();
    let whole = Region::whole(info.width_px, info.height_px);
    let mut pixels = vec![0.0; whole.n_pixels()];
    recording.read_region(0, whole, &mut pixels)?;
    Ok(Window::saturating_at(whole, &pixels, interpolation, info.full_scale())?)
}

/// The interpolation and the shape function; where an accuracy asks for them, by nine subsets over the reference.
fn solver(
    chosen: &Chosen,
    reference: &dyn Recording,
    half_px: usize,
) -> Result<(Interpolation, ShapeChoice), Error> {
    let (width, height) = (reference.info().width_px, reference.info().height_px);
    let fits = width.min(height) > 2 * half_px + 1;
    let place = |i: usize, n: usize| half_px as f64 + 0.25 * (i + 1) as f64 * (n - 2 * half_px - 1) as f64;
    let subset = |i: usize| Subset {
        name: i.to_string(),
        x_px: place(i % 3, width).floor(),
        y_px: place(i / 3, height).floor(),
        half_width_px: half_px,
        half_height_px: half_px,
    };
    let subsets: Vec<Subset> = (0..9).filter(|_| fits).map(subset).collect();
    match chosen.method(reference, &subsets, &ReferenceFrames::Single(0))? {
        Method::IcGn { interpolation, shape } => Ok((interpolation, shape)),
        other => Err(Error::Argument(format!(
            "method {other}: expected one of the icgn methods, which give a field (hint: --method icgn-cubic-affine)"
        ))),
    }
}

fn columns(field: &Field, strains: &[Option<Strain>]) -> Vec<Column> {
    let points = &field.points;
    let displacement = |axis: usize| -> Vec<Option<Estimate>> {
        let of = |point: &FieldPoint| {
            let position = point.found.as_ref().ok()?.position;
            let (moved, place) =
                if axis == 0 { (position.x_px, point.x_px) } else { (position.y_px, point.y_px) };
            Some(Estimate::new(moved.value - place, moved.sigma))
        };
        points.iter().map(of).collect()
    };
    let (u, v) = (displacement(0), displacement(1));
    let values = |of: &[Option<Estimate>]| of.iter().map(|e| e.map(|e| e.value)).collect::<Vec<_>>();
    let sigmas = |of: &[Option<Estimate>]| of.iter().map(|e| e.map(|e| e.sigma)).collect::<Vec<_>>();
    let strain = |of: fn(&Strain) -> Estimate| -> Vec<Option<Estimate>> {
        strains.iter().map(|strain| strain.as_ref().map(of)).collect()
    };
    let (xx, yy, xy) = (strain(|s| s.xx), strain(|s| s.yy), strain(|s| s.xy));
    let positions = || points.iter().map(|point| point.found.as_ref().ok().map(|found| found.position));
    let status = |point: &FieldPoint| point.found.as_ref().err().map_or("ok", |lost| lost.as_str());
    vec![
        column("x_px", points.iter().map(|point| point.x_px).collect::<Vec<_>>()),
        column("y_px", points.iter().map(|point| point.y_px).collect::<Vec<_>>()),
        column("u_px", values(&u)),
        column("v_px", values(&v)),
        column("sigma_u_px", sigmas(&u)),
        column("sigma_v_px", sigmas(&v)),
        column("zncc", positions().map(|p| p.map(|p| p.zncc)).collect::<Vec<_>>()),
        column("iterations", positions().map(|p| p.map(|p| p.iterations)).collect::<Vec<_>>()),
        column("status", points.iter().map(status).collect::<Vec<_>>()),
        column("shape", points.iter().map(|point| point.shape.to_string()).collect::<Vec<_>>()),
        column("strain_xx", values(&xx)),
        column("strain_yy", values(&yy)),
        column("strain_xy", values(&xy)),
        column("sigma_strain_xx", sigmas(&xx)),
        column("sigma_strain_yy", sigmas(&yy)),
        column("sigma_strain_xy", sigmas(&xy)),
    ]
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
