//! Points followed through recordings, as `chainwave track` follows them.

use std::num::NonZero;
use std::str::FromStr;

use chainwave_correlation::{CorrelationError, ReferenceFrames};
use chainwave_experiment::{
    FollowedPoints, MethodChoice, NamedMatching, PlacedPoint, PointTracking, TrackRows,
};
use chainwave_measurement::Recording;
use pyo3::prelude::*;

use crate::cells::TableArgument;
use crate::failure::Failure;
use crate::recording::OpenedRecording;
use crate::table::ArrowTable;
use crate::work::{Stoppable, watched};

/// How pictures are matched, as the commands' options name it.
#[derive(FromPyObject)]
pub(crate) struct Matching {
    #[pyo3(item)]
    method: Option<String>,
    #[pyo3(item)]
    accuracy: Option<f64>,
    #[pyo3(item)]
    shape: Option<String>,
    #[pyo3(item)]
    interpolation: Option<String>,
    #[pyo3(item)]
    threads: Option<NonZero<usize>>,
}

impl Matching {
    /// The way of matching, and the threads.
    pub(crate) fn choice(self) -> Result<(MethodChoice, NonZero<usize>), Failure> {
        let Self { method, accuracy, shape, interpolation, threads: asked } = self;
        let named = NamedMatching {
            method: parsed(method)?,
            accuracy_px: accuracy,
            shape: parsed(shape)?,
            interpolation: parsed(interpolation)?,
        };
        Ok((named.choice()?, threads(asked)))
    }
}

/// What a name stands for, where one is given.
fn parsed<T: FromStr<Err = CorrelationError>>(name: Option<String>) -> Result<Option<T>, Failure> {
    Ok(name.map(|name| name.parse()).transpose()?)
}

/// Threads: all cores where they are left open.
pub(crate) fn threads(asked: Option<NonZero<usize>>) -> NonZero<usize> {
    asked.unwrap_or_else(|| std::thread::available_parallelism().unwrap_or(NonZero::<usize>::MIN))
}

/// A subset as it was placed: recording, point, half width, half height, and why where its size was left open.
type Placed = (String, String, usize, usize, Option<String>);

/// A table of tracks, what is to be said of each recording, the subsets, and the method of each recording.
type Found = (ArrowTable, Vec<(String, String)>, Vec<Placed>, Vec<String>);

/// The tracks of points in recordings, what is to be said of each recording, the subsets, and the method of each recording.
#[pyfunction]
#[pyo3(signature = (recordings, points, matching, *, reference, progress = None))]
pub(crate) fn track(
    py: Python<'_>,
    recordings: Vec<(String, PyRef<'_, OpenedRecording>)>,
    points: TableArgument,
    matching: Matching,
    reference: usize,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Found> {
    let points = PlacedPoint::of_table(&points.table("points")?).map_err(Failure::from)?;
    let (choice, n_threads) = matching.choice()?;
    let recordings: Vec<_> =
        recordings.into_iter().map(|(name, opened)| (name, opened.recording.clone())).collect();
    let work = move |monitor: &chainwave_experiment::Monitor<'_>, link: &_| {
        let reference = ReferenceFrames::Single(reference);
        let tracking = PointTracking { points: &points, choice, reference: &reference, n_threads };
        let follow = |(name, recording): (String, _)| -> Result<(String, FollowedPoints), Failure> {
            let recording = Stoppable { recording, link: std::sync::Arc::clone(link) };
            Ok((name, tracking.follow(&recording as &dyn Recording, monitor)?))
        };
        recordings.into_iter().map(follow).collect::<Result<Vec<_>, _>>()
    };
    let found = watched(py, progress, work)?;
    let (mut rows, mut notes, mut subsets, mut methods) =
        (TrackRows::default(), Vec::new(), Vec::new(), Vec::new());
    for (name, FollowedPoints { followed, notes: said, placed, method }) in found {
        rows.add_points(&name, &followed);
        notes.extend(said.into_iter().map(|note| (name.clone(), note)));
        subsets.extend(placed.into_iter().map(|placed| {
            let (subset, reason) = (placed.subset, placed.chosen.map(|chosen| chosen.reason.to_string()));
            (name.clone(), subset.name, subset.half_width_px, subset.half_height_px, reason)
        }));
        methods.push(method.to_string());
    }
    Ok((ArrowTable::of(rows.table())?, notes, subsets, methods))
}
