//! The displacement field between two images, found from its most reliable points outwards.

mod agreement;
mod alike;
mod consensus;
mod halves;
mod island;
mod known;
mod overlap;
mod pair;
mod plane;
mod pulled;
mod queue;
mod seed;
mod shape_error;
pub(crate) mod strain;
mod truncation;

use std::collections::{BinaryHeap, VecDeque};
use std::num::NonZero;

use chainwave_measurement::Lost;

use crate::field::agreement::agree_on_shapes;
use crate::field::alike::widen_alike;
use crate::field::consensus::Consensus;
use crate::field::halves::Halves;
use crate::field::known::{Known, neighbours};
use crate::field::pair::{ImagePair, Settled};
use crate::field::pulled::widen_pulled;
use crate::field::queue::Candidate;
use crate::field::seed::Seeds;
use crate::field::shape_error::ShapeError;
use crate::icgn::outcome::Match;
use crate::warp::Warp;
use crate::{Acceptance, CorrelationError, Reference, Settings, Shape, ShapeChoice, Window, Workspace};

/// Where the points of a field lie, and how large their subsets are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FieldGrid {
    /// Pixels from one point to the next, along x and y.
    pub step_px: usize,
    /// Columns and rows of a subset on each side of its centre.
    pub half_px: usize,
}

/// One point of a field.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldPoint {
    /// Column in the reference.
    pub x_px: f64,
    /// Row in the reference.
    pub y_px: f64,
    /// Where it lies in the deformed image, or why it was not found.
    pub found: Result<Match, Lost>,
    /// The shape function that it was matched with.
    pub shape: Shape,
}

/// A displacement field on a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Pixels from one point to the next.
    pub step_px: usize,
    /// Columns and rows of a subset on each side of its centre.
    pub half_px: usize,
    /// Points along x.
    pub n_columns: usize,
    /// All points, row by row from the top.
    pub points: Vec<FieldPoint>,
}

/// Rows and columns of the reference beyond the outer subsets, so that a point which has not moved can be interpolated.
const BORDER_PX: usize = 3;
/// Points from which the field grows in one go. It does not depend on the threads, nor does the result.
const BATCH: usize = 64;
/// Neighbours from which a point is tried before it is given up.
const MAX_TRIES: u8 = 3;

/// The field between the reference and a deformed image, the latter interpolated as `target` is.
///
/// A first point is found by search. Each further one starts from the place and deformation of its neighbour with the
/// best correlation among all found so far (B. Pan, Appl. Opt. 48 (2009) 1535-1542), so that a bad region is entered
/// last and misleads nobody; parts that cannot be reached so are searched for anew. `progress` receives the number of
/// points settled. Where the field bends, and points lie farther apart than neighbours tell that, others are matched between them and left away
/// again.
///
/// # Errors
/// [`CorrelationError::Setting`] when a setting has no meaning, [`CorrelationError::GridTooLarge`] when no subset fits
/// in the reference.
pub fn correlate(
    reference: &Reference,
    target: &Window,
    grid: FieldGrid,
    settings: &Settings,
    choice: ShapeChoice,
    n_threads: NonZero<usize>,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Field, CorrelationError> {
    settings.check()?;
    let settings = Settings { interpolation: target.interpolation, ..settings.clone() };
    let grown = |grid: FieldGrid, progress: &(dyn Fn(u64) + Sync)| {
        let (settings, half_px) = (settings.clone(), grid.half_px);
        let pair = ImagePair { reference, target, settings, choice, half_px };
        let mut growth = Growth::new(pair, grid, n_threads)?;
        growth.grow(progress);
        Ok::<Grown, CorrelationError>(growth.finish(grid))
    };
    let Grown { field, bends } = grown(grid, progress)?;
    match grid.divided() {
        Some((fine, every)) if bends => Ok(grown(fine, &|_| ())?.field.thinned(every)),
        _ => Ok(field),
    }
}

/// A field that has grown to its last point.
struct Grown {
    field: Field,
    /// Whether it bends anywhere by what its shape function does not follow.
    bends: bool,
}

/// Parts into which a step is divided at most.
const MOST_PARTS: usize = 4;

impl FieldGrid {
    /// The same with so many points between that neighbours tell what a shape function leaves of a bend: what lies farther away than three quarters of
    /// half a subset is another part of a short wave. A step that no division brings so near is divided as far as it goes; `None` where nothing is.
    fn divided(self) -> Option<(Self, usize)> {
        let is_near = |parts: usize| 4 * self.step_px <= 3 * self.half_px * parts;
        let divides = |parts: &usize| self.step_px.is_multiple_of(*parts);
        let near = (1..=MOST_PARTS).filter(divides).find(|parts| is_near(*parts));
        let parts = near.or_else(|| (1..=MOST_PARTS).rev().find(divides)).filter(|parts| *parts > 1)?;
        Some((Self { step_px: self.step_px / parts, ..self }, parts))
    }
}

impl Field {
    /// Every so-manieth of its points along both axes, from the first on.
    fn thinned(self, every: usize) -> Self {
        let Self { step_px, half_px, n_columns, points } = self;
        let is_kept = |index: usize| {
            (index % n_columns).is_multiple_of(every) && (index / n_columns).is_multiple_of(every)
        };
        let kept = points.into_iter().enumerate().filter(|(index, _)| is_kept(*index));
        let points = kept.map(|(_, point)| point).collect();
        Self { step_px: step_px * every, half_px, n_columns: n_columns.div_ceil(every), points }
    }
}

/// A field on its way from the first point to the last.
struct Growth<'a> {
    pair: ImagePair<'a>,
    places: Vec<[f64; 2]>,
    n_columns: usize,
    step_px: f64,
    settled: Vec<Option<Settled>>,
    n_tries: Vec<u8>,
    front: BinaryHeap<Candidate>,
    /// One for each thread.
    workspaces: Vec<Workspace>,
}

impl<'a> Growth<'a> {
    fn new(
        pair: ImagePair<'a>,
        grid: FieldGrid,
        n_threads: NonZero<usize>,
    ) -> Result<Self, CorrelationError> {
        let region = pair.reference.region();
        let margin = grid.half_px + BORDER_PX;
        let line = |first: usize, n: usize| -> Vec<f64> {
            let places = (first + margin)..(first + n).saturating_sub(margin);
            places.step_by(grid.step_px.max(1)).map(|place| place as f64).collect()
        };
        let (columns, rows) = (line(region.x, region.width), line(region.y, region.height));
        if columns.is_empty() || rows.is_empty() {
            let (half_px, width_px, height_px) = (grid.half_px, region.width, region.height);
            return Err(CorrelationError::GridTooLarge { half_px, width_px, height_px });
        }
        let places: Vec<[f64; 2]> = rows.iter().flat_map(|&y| columns.iter().map(move |&x| [x, y])).collect();
        Ok(Self {
            pair,
            n_columns: columns.len(),
            step_px: grid.step_px.max(1) as f64,
            settled: vec![None; places.len()],
            n_tries: vec![0; places.len()],
            front: BinaryHeap::new(),
            workspaces: vec![Workspace::default(); n_threads.get()],
            places,
        })
    }

    fn known(&self) -> Known<'_, 'a> {
        let Self { pair, places, n_columns, step_px, settled, .. } = self;
        Known { pair, places, n_columns: *n_columns, step_px: *step_px, settled }
    }

    fn grow(&mut self, progress: &(dyn Fn(u64) + Sync)) {
        let mut seeds = Seeds::new(self.n_columns, self.places.len());
        while let Some(point) = seeds.next(&self.settled) {
            let mut workspace = std::mem::take(&mut self.workspaces[0]);
            let found = seeds.find(&self.known(), point, &mut workspace);
            self.workspaces[0] = workspace;
            let Some(settled) = found else { continue };
            self.settle(point, settled);
            progress(1);
            self.spread(progress);
        }
    }

    /// Goes from the front to all neighbours that can be reached.
    fn spread(&mut self, progress: &(dyn Fn(u64) + Sync)) {
        while !self.front.is_empty() {
            let starts = self.next_starts();
            for &(point, _) in &starts {
                self.n_tries[point] += 1;
            }
            let found = self.settle_all(&starts);
            for ((point, _), settled) in starts.into_iter().zip(found) {
                progress(u64::from(self.settled[point].is_none()));
                self.settle(point, settled);
            }
        }
    }

    /// The neighbours of the best points of the front, each with its start from the best of them.
    fn next_starts(&mut self) -> Vec<(usize, Warp)> {
        let mut starts: Vec<(usize, Warp)> = Vec::new();
        for _ in 0..BATCH {
            let Some(Candidate { point, warp, .. }) = self.front.pop() else { break };
            for neighbour in neighbours(point, self.n_columns, self.places.len()) {
                let open = !matches!(self.settled[neighbour], Some((Ok(_), _)));
                let listed = starts.iter().any(|&(listed, _)| listed == neighbour);
                if open && !listed && self.n_tries[neighbour] < MAX_TRIES {
                    starts.push((neighbour, self.known().start_from(&warp, point, neighbour)));
                }
            }
        }
        starts
    }

    /// Matches points side by side.
    fn settle_all(&mut self, starts: &[(usize, Warp)]) -> Vec<Settled> {
        /// Fewer points than this are not worth a thread.
        const LEAST_SHARE: usize = 8;
        let (pair, places) = (&self.pair, &self.places);
        let n_threads = self.workspaces.len().min(starts.len() / LEAST_SHARE).max(1);
        let settle = |workspace: &mut Workspace, part: &[(usize, Warp)]| -> Vec<Settled> {
            part.iter().map(|&(point, start)| pair.settle(places[point], start, workspace)).collect()
        };
        if n_threads == 1 {
            return settle(&mut self.workspaces[0], starts);
        }
        let parts = starts.chunks(starts.len().div_ceil(n_threads));
        std::thread::scope(|scope| {
            let threads: Vec<_> = self
                .workspaces
                .iter_mut()
                .zip(parts)
                .map(|(workspace, part)| scope.spawn(move || settle(workspace, part)))
                .collect();
            let join = |thread: std::thread::ScopedJoinHandle<'_, Vec<Settled>>| {
                thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            };
            threads.into_iter().flat_map(join).collect()
        })
    }

    fn settle(&mut self, point: usize, settled: Settled) {
        if let (Ok(found), _) = &settled {
            self.front.push(Candidate { zncc: found.position.zncc, point, warp: found.warp() });
        }
        self.settled[point] = Some(settled);
    }

    fn finish(mut self, grid: FieldGrid) -> Grown {
        if self.pair.settings.acceptance == Acceptance::ByEvidence {
            let (pair, places) = (&self.pair, self.places.as_slice());
            let consensus = Consensus { pair, places, n_columns: self.n_columns, step_px: self.step_px };
            consensus.judge(&mut self.settled);
        }
        self.explain_the_rest();
        widen_alike(&self.pair, &self.places, &mut self.settled);
        let n_threads = NonZero::new(self.workspaces.len()).unwrap_or(NonZero::<usize>::MIN);
        agree_on_shapes(&self.pair, &self.places, self.n_columns, n_threads, &mut self.settled);
        let is_mended = self.mend_parted(n_threads);
        let bends = self.take_off_shape_error(&is_mended, n_threads);
        widen_pulled(&self.pair, &self.places, self.n_columns, self.step_px, &mut self.settled);
        let points = self.places.iter().zip(self.settled).filter_map(|(&[x_px, y_px], settled)| {
            settled.map(|(found, shape)| FieldPoint { x_px, y_px, found, shape })
        });
        let points = points.collect();
        let FieldGrid { step_px, half_px } = grid;
        Grown { field: Field { step_px, half_px, n_columns: self.n_columns, points }, bends }
    }

    fn mend_parted(&mut self, n_threads: NonZero<usize>) -> Vec<bool> {
        let (pair, places) = (&self.pair, self.places.as_slice());
        let (n_columns, step_px) = (self.n_columns, self.step_px);
        Halves { pair, places, n_columns, step_px, n_threads }.mend(&mut self.settled)
    }

    /// Whether there is any.
    fn take_off_shape_error(&mut self, is_mended: &[bool], n_threads: NonZero<usize>) -> bool {
        let (pair, places) = (&self.pair, self.places.as_slice());
        let (n_columns, step_px) = (self.n_columns, self.step_px);
        ShapeError { pair, places, n_columns, step_px, is_mended, n_threads }.take_off(&mut self.settled)
    }

    /// A point that was not found is lost for its own reason: it has no texture, or lies outside of the picture where the nearest point
    /// that was found expects it; else for what its match met.
    fn explain_the_rest(&mut self) {
        let unprepared: Vec<Option<Lost>> = (0..self.settled.len())
            .map(|point| match &self.settled[point] {
                Some((Ok(_), _)) => None,
                _ => self.pair.prepare(self.places[point]).err(),
            })
            .collect();
        let nearest = self.nearest_found(&unprepared);
        for (point, nearest) in nearest.into_iter().enumerate() {
            let (reason, shape) = match &self.settled[point] {
                Some((Ok(_), _)) => continue,
                Some((Err(reason), shape)) => (*reason, *shape),
                None => (Lost::LowCorrelation, self.pair.first_shape()),
            };
            let leaves = |from: usize| match &self.settled[from] {
                Some((Ok(found), _)) => {
                    !self.pair.is_well_inside(&self.known().start_from(&found.warp(), from, point))
                }
                _ => false,
            };
            // What shows no texture is lost for that, wherever it would be.
            let reason = match (unprepared[point], reason, nearest) {
                (Some(reason), ..) => reason,
                (_, Lost::NotConverged | Lost::LowCorrelation, Some(from)) if leaves(from) => Lost::OutOfView,
                (_, reason, _) => reason,
            };
            self.settled[point] = Some((Err(reason), shape));
        }
    }

    /// For each point one that was found, as few steps away as any, over points with texture alone: behind bare ground lies another body.
    fn nearest_found(&self, unprepared: &[Option<Lost>]) -> Vec<Option<usize>> {
        let is_found = |point: &usize| matches!(self.settled[*point], Some((Ok(_), _)));
        let mut open: VecDeque<usize> = (0..self.settled.len()).filter(is_found).collect();
        let mut nearest = vec![None; self.settled.len()];
        open.iter().for_each(|point| nearest[*point] = Some(*point));
        while let Some(point) = open.pop_front() {
            for neighbour in neighbours(point, self.n_columns, self.places.len()) {
                if nearest[neighbour].is_none() && unprepared[neighbour].is_none() {
                    nearest[neighbour] = nearest[point];
                    open.push_back(neighbour);
                }
            }
        }
        nearest
    }
}
