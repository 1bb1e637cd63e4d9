//! Two pictures that are compared, and one subset of them matched with the shape function that it needs.

use chainwave_measurement::{Lost, Subset};

use crate::evidence::ShapeTest;
use crate::icgn::outcome::{Match, Stop};
use crate::middle::shows_its_middle;
use crate::warp::Warp;
use crate::{PreparedSubset, Reference, Settings, Shape, ShapeChoice, Window, Workspace};

/// What is lost where it is expected within so many pixels of the edge has left the view.
const SPARE_PX: f64 = 3.0;

/// What is compared, and how.
pub(crate) struct ImagePair<'a> {
    pub(crate) reference: &'a Reference,
    pub(crate) target: &'a Window,
    pub(crate) settings: Settings,
    pub(crate) choice: ShapeChoice,
    /// Half the width and height of a subset.
    pub(crate) half_px: usize,
}

/// A match, and the shape function it was made with.
pub(crate) type Settled = (Result<Match, Lost>, Shape);

impl ImagePair<'_> {
    /// The side of a subset.
    pub(crate) fn side_px(&self) -> f64 {
        (2 * self.half_px + 1) as f64
    }

    /// What the noise of a match's gradient makes of a place so far from it, over the noise of its own: affine gradients are as certain as those
    /// of a line through the pixels of a side.
    pub(crate) fn gradient_noise_at(&self, [x, y]: [f64; 2]) -> f64 {
        12.0_f64.sqrt() * x.hypot(y) / self.side_px()
    }

    /// The same pictures, compared by larger subsets.
    pub(crate) fn enlarged(&self, factor: f64) -> Self {
        let half_px = (factor * self.half_px as f64).round() as usize;
        let Self { reference, target, settings, choice, .. } = self;
        Self { reference, target, settings: settings.clone(), choice: *choice, half_px }
    }

    /// The place nearest to another, by and large, whose subset lies in both pictures, as the match of the other has it, and reaches over
    /// `core_px` around that on all sides; one whose subset lies in the reference alone where there is none, and `None` where none does.
    pub(crate) fn nearest_inside(
        &self,
        place_px: [f64; 2],
        core_px: usize,
        found: &Warp,
    ) -> Option<[f64; 2]> {
        let inside = self.nearest_in_reference(place_px)?;
        let most_px = self.half_px.saturating_sub(core_px) as f64;
        let reaches = |moved: &[f64; 2]| (0..2).all(|axis| (moved[axis] - place_px[axis]).abs() <= most_px);
        Some(self.nearest_in_both(place_px, inside, found).filter(reaches).unwrap_or(inside))
    }

    /// A place inside the reference, moved farther by what the target lacks of its subset.
    fn nearest_in_both(&self, place_px: [f64; 2], inside: [f64; 2], found: &Warp) -> Option<[f64; 2]> {
        let at = |[x, y]: [f64; 2]| Warp {
            position_px: found.apply([x - place_px[0], y - place_px[1]]),
            ..*found
        };
        let half = self.half_px as f64 + SPARE_PX;
        let seen = at(inside);
        let [dx, dy] = self.target.move_inside(seen.bounds([-half; 2], [half; 2]))?;
        let [x, y] = seen.position_px;
        let [back_x, back_y] = seen.source([x + dx, y + dy])?;
        let moved = self.nearest_in_reference([inside[0] + back_x, inside[1] + back_y])?;
        self.is_well_inside(&at(moved)).then_some(moved)
    }

    fn nearest_in_reference(&self, place_px: [f64; 2]) -> Option<[f64; 2]> {
        let region = self.reference.image().region;
        let half = self.half_px as f64;
        let inside = |place: f64, first: usize, n: usize| {
            let (least, most) = (first as f64 + half, (first + n) as f64 - 1.0 - half);
            (least <= most).then(|| place.clamp(least, most))
        };
        let [x, y] = place_px;
        Some([inside(x, region.x, region.width)?, inside(y, region.y, region.height)?])
    }

    fn subset(&self, [x_px, y_px]: [f64; 2]) -> Subset {
        Subset::new("", x_px, y_px, self.half_px, self.half_px)
    }

    /// The subset around a place, with the shape function that is tried first.
    pub(crate) fn prepare(&self, place_px: [f64; 2]) -> Result<PreparedSubset, Lost> {
        self.prepare_with(place_px, self.first_shape())
    }

    /// The subset around a place, with a shape function.
    pub(crate) fn prepare_with(&self, place_px: [f64; 2], shape: Shape) -> Result<PreparedSubset, Lost> {
        let settings = Settings { shape, ..self.settings.clone() };
        let subset = PreparedSubset::new(self.reference, &self.subset(place_px), &settings)?;
        if shows_its_middle(&subset) { Ok(subset) } else { Err(Lost::NoTexture) }
    }

    pub(crate) fn first_shape(&self) -> Shape {
        match self.choice {
            ShapeChoice::Named(shape) => shape,
            ShapeChoice::ByEvidence => Shape::Affine,
        }
    }

    /// Matches the subset around a place, with the shape function that it needs.
    pub(crate) fn settle(&self, place_px: [f64; 2], start: Warp, workspace: &mut Workspace) -> Settled {
        let first = self.first_shape();
        let prepared = match self.prepare(place_px) {
            Ok(prepared) => prepared,
            Err(reason) => return (Err(reason), first),
        };
        let found = prepared.solve_visible(self.target, start, workspace).map_err(reason_of);
        match (self.choice, &found) {
            (ShapeChoice::ByEvidence, Ok(affine)) => self.simplify(place_px, &prepared, *affine, workspace),
            _ => (found, first),
        }
    }

    /// Whether a subset would be seen whole where it is expected, with some pixels to spare.
    pub(crate) fn is_well_inside(&self, expected: &Warp) -> bool {
        let half = self.half_px as f64 + SPARE_PX;
        expected.bounds([-half; 2], [half; 2]).into_iter().all(|corner| self.target.contains(corner))
    }

    fn simplify(
        &self,
        place_px: [f64; 2],
        affine: &PreparedSubset,
        found: Match,
        workspace: &mut Workspace,
    ) -> Settled {
        let mut test = ShapeTest::new(self.reference, &self.subset(place_px), &self.settings);
        test.add(affine, self.target, &found, workspace);
        let shape = test.evidence().shape;
        let start = match shape {
            Shape::Affine => return (Ok(found), shape),
            Shape::Translation => Warp::at(found.warp().position_px),
            _ => found.warp(),
        };
        let again = self.settle_with(place_px, shape, start, workspace);
        again.map_or((Ok(found), Shape::Affine), |again| (Ok(again), shape))
    }

    /// The match around a place with a shape function, if there is one.
    pub(crate) fn settle_with(
        &self,
        place_px: [f64; 2],
        shape: Shape,
        start: Warp,
        workspace: &mut Workspace,
    ) -> Option<Match> {
        self.prepare_with(place_px, shape).ok()?.solve_visible(self.target, start, workspace).ok()
    }
}

fn reason_of(stop: Stop) -> Lost {
    match stop {
        Stop::Escaped(_) => Lost::OutOfView,
        Stop::Lost(reason) => reason,
    }
}
