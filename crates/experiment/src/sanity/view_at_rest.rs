//! One view at rest: the first of its recordings that can be read, which bodies it should show, and what its picture has there.

use std::sync::Arc;

use chainwave_correlation::{PreparedSubset, Reference, Settings, Shape, ShapeChoice, mean_of_frames};
use chainwave_measurement::{Recording, RecordingInfo, Region, Subset};

use super::repetition::pitch_in_picture;
use crate::configuration::Trial;
use crate::finding::Sanity;
use crate::recordings::view::{bodies_in_view, frames_at_rest};
use crate::setup::Setup;

/// Frames at rest whose mean is looked at: enough to see texture, and little to read.
const MOST_FRAMES: usize = 8;

/// A view as one of its recordings shows it.
pub(super) struct ViewAtRest {
    /// The recordings of the view that were made with the stage in one place.
    pub(super) trials: Vec<Trial>,
    /// The one that was opened.
    pub(super) trial: Trial,
    pub(super) recording: Arc<dyn Recording>,
    /// The bodies that it should show, with their subsets.
    pub(super) bodies: Vec<(usize, Subset)>,
}

/// One for each view and place of the stage, by the recordings that are not left out.
pub(super) fn views_at_rest(setup: &Setup, sanity: &Sanity) -> Vec<ViewAtRest> {
    let is_used = |trial: &&Trial| sanity.reason(&trial.recording).is_none();
    let of_views = Trial::by_place(setup.trials.iter().filter(is_used));
    of_views.into_iter().filter_map(|trials| ViewAtRest::of(setup, trials)).collect()
}

impl ViewAtRest {
    fn of(setup: &Setup, trials: Vec<Trial>) -> Option<Self> {
        let opened = |trial: &Trial| Some((trial.clone(), setup.open(trial).ok()?));
        let (trial, recording) = trials.iter().find_map(opened)?;
        let bodies = bodies_in_view(setup, &trial, recording.info());
        Some(Self { trials, trial, recording: recording.into(), bodies })
    }

    /// The same view with its stage elsewhere.
    pub(super) fn moved(&self, setup: &Setup, stage_m: f64) -> Self {
        let trial = Trial { stage_m, ..self.trial.clone() };
        let bodies = bodies_in_view(setup, &trial, self.recording.info());
        Self { trials: self.trials.clone(), trial, recording: Arc::clone(&self.recording), bodies }
    }

    /// The view by its number and its place.
    pub(super) fn name(&self) -> String {
        format!("view {} (stage at {} m)", self.trial.view, self.trial.stage_m)
    }
}

/// What the picture of a view at rest has at some body's place.
pub(super) struct Place {
    /// Number of the body; 0 and one more than the last lie a pitch beyond the chain's ends.
    pub(super) body: i64,
    pub(super) at_px: [f64; 2],
    /// Texture, if there is any that places can be told by.
    pub(super) texture: Option<Texture>,
    /// Share of the pixels there that saturate.
    pub(super) saturated: f64,
}

/// The texture of a subset.
#[derive(Debug, Clone, Copy)]
pub(super) struct Texture {
    /// Mean square of the differences between neighbouring pixels, in counts squared.
    pub(super) steepness: f64,
    /// Share of the pixels that can be used.
    pub(super) used: f64,
}

/// What the picture of one view at rest tells.
pub(super) struct Facts {
    pub(super) view: String,
    /// The bodies in view, in their order.
    pub(super) bodies: Vec<Place>,
    /// Places a pitch beyond either end of the chain that lie in the picture.
    pub(super) beyond: Vec<Place>,
    /// Pixels between neighbours: as the experiment has them, and as the picture repeats itself.
    pub(super) pitch_px: Option<[f64; 2]>,
}

impl Facts {
    /// `None` where the frames at rest cannot be read: tracking says why.
    pub(super) fn of(setup: &Setup, view: &ViewAtRest) -> Option<Self> {
        let (recording, info) = (view.recording.as_ref(), view.recording.info());
        let rest = frames_at_rest(setup, recording).ok()?.range();
        let n_frames = rest.len().min(MOST_FRAMES);
        let whole = Region::whole(info.width_px, info.height_px);
        let picture = mean_of_frames(recording, whole, rest.start..rest.start + n_frames).ok()?;
        let pitch_px = pitch_in_picture(&picture, info.width_px, &view.bodies);
        // By evidence, subsets are followed with the affine shape function first.
        let shape = match setup.experiment.tracking.shape {
            ShapeChoice::Named(shape) => shape,
            ShapeChoice::ByEvidence => Shape::Affine,
        };
        let looked_at =
            Looked { width_px: info.width_px, picture: &picture, shape, full_scale: info.full_scale() };
        let reference =
            Reference::new(whole, picture.clone(), n_frames).ok()?.saturating_at(info.full_scale());
        let place = |body: i64, subset: &Subset| Place {
            body,
            at_px: [subset.x_px, subset.y_px],
            texture: looked_at.texture(&reference, subset),
            saturated: looked_at.saturated(subset),
        };
        let beyond = [0, setup.experiment.chain.n_bodies as i64 + 1].into_iter().filter_map(|body| {
            let subset = subset_at(setup, body, &view.trial, info)?;
            Reference::lies_inside(recording, &subset).then(|| place(body, &subset))
        });
        Some(Self {
            view: view.name(),
            beyond: beyond.collect(),
            bodies: view.bodies.iter().map(|(body, subset)| place(*body as i64, subset)).collect(),
            pitch_px,
        })
    }
}

fn subset_at(setup: &Setup, body: i64, trial: &Trial, info: &RecordingInfo) -> Option<Subset> {
    let tracking = &setup.experiment.tracking;
    let [x_px, y_px] = setup.map_of(trial, info).rest_px(body, trial.stage_m)?;
    let (half_width_px, half_height_px) = (tracking.half_width_px, tracking.half_height_px);
    let subset = Subset::new(body.to_string(), x_px, y_px, half_width_px, half_height_px);
    Some(subset.within(tracking.outline_px.clone()))
}

/// A picture, row by row from the top.
struct Looked<'a> {
    width_px: usize,
    picture: &'a [f32],
    /// The shape function that subsets are followed with.
    shape: Shape,
    full_scale: f64,
}

impl Looked<'_> {
    fn texture(&self, reference: &Reference, subset: &Subset) -> Option<Texture> {
        let settings = Settings { shape: self.shape, ..Settings::default() };
        let prepared = PreparedSubset::new(reference, subset, &settings).ok()?;
        let used = prepared.n_used() as f64 / prepared.n_outlined().max(1) as f64;
        Some(Texture { steepness: self.steepness(subset), used })
    }

    fn steepness(&self, subset: &Subset) -> f64 {
        let (mut sum, mut n) = (0.0, 0.0);
        for [column, row] in places(subset) {
            let here = self.count(column, row);
            sum +=
                (self.count(column + 1, row) - here).powi(2) + (self.count(column, row + 1) - here).powi(2);
            n += 2.0;
        }
        sum / f64::max(n, 1.0)
    }

    fn saturated(&self, subset: &Subset) -> f64 {
        let (mut n_saturated, mut n) = (0.0, 0.0);
        for [column, row] in places(subset) {
            n += 1.0;
            n_saturated += f64::from(u8::from(self.count(column, row) >= self.full_scale));
        }
        n_saturated / f64::max(n, 1.0)
    }

    fn count(&self, column: usize, row: usize) -> f64 {
        self.picture.get(row * self.width_px + column).copied().map_or(0.0, f64::from)
    }
}

/// Columns and rows of a subset's pixels.
fn places(subset: &Subset) -> impl Iterator<Item = [usize; 2]> {
    let (x, y) = (subset.x_px.round() as usize, subset.y_px.round() as usize);
    let columns = x.saturating_sub(subset.half_width_px)..x + subset.half_width_px;
    let rows = y.saturating_sub(subset.half_height_px)..y + subset.half_height_px;
    rows.flat_map(move |row| columns.clone().map(move |column| [column, row]))
}
