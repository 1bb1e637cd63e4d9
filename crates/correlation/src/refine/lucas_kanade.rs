//! Tracking by OpenCV's pyramidal Lucas-Kanade method: the peer that this crate's own rungs are measured against.

use std::collections::BTreeMap;
use std::ops::Range;

use chainwave_measurement::{Lost, Position, Recording, Region, Subset, Track};

use crate::acceptance::Standard;
use crate::foreign::{FlowSettings, library};
use crate::refine::calibration::{Calibration, Judgement, judge};
use crate::search::rivals::PlaceMatch;
use crate::track::find::{FrameSearch, Locate};
use crate::track::predict::History;
use crate::track::together::without_collisions;
use crate::track::tracker::{Found, Tracker, track_both_ways};
use crate::warp::Warp;
use crate::{
    CorrelationError, Interpolation, PreparedSubset, Reference, ReferenceFrames, Settings, Shape, Window,
    Workspace,
};

/// Follows subsets as [`crate::track`] does, by `calcOpticalFlowPyrLK` (J.-Y. Bouguet, Pyramidal implementation of the
/// Lucas Kanade feature tracker, 2000): translation, bilinear interpolation, each frame directly against the reference.
///
/// The method takes 8-bit images: the reference's least count becomes 0 and its largest 255, in every frame. Of
/// `settings`, the convergence, the iterations, the search and what counts as a match are taken. `Position::iterations` is 0, for
/// OpenCV does not tell.
///
/// The bias of bilinear interpolation is taken off and sigma stated as they are found on shifted pictures of each subset, by
/// the residual of the 8-bit images, so that their rounding is in it.
///
/// # Errors
/// As [`crate::track`], and [`CorrelationError::OpenCv`].
pub(crate) fn track_lucas_kanade(
    recording: &dyn Recording,
    subsets: &[Subset],
    reference: &ReferenceFrames,
    settings: &Settings,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Vec<Track>, CorrelationError> {
    settings.check()?;
    let mut flow = Flow::new(recording, subsets, reference, settings)?;
    let (first, n_frames) = (reference.range().start, recording.info().n_frames);
    let tracks = track_both_ways(&mut flow, first, n_frames, subsets, progress);
    let tracks = without_collisions(tracks, subsets, first, settings);
    flow.failure.map_or(Ok(tracks), |failure| Err(CorrelationError::OpenCv(failure)))
}

/// All subsets on their way.
struct Flow<'a> {
    recording: &'a dyn Recording,
    reference_frames: Range<usize>,
    eight_bit: EightBit,
    reference: Vec<u8>,
    settings: Settings,
    points: Vec<FlowPoint>,
    workspace: Workspace,
    /// OpenCV's first refusal, which ends the run.
    failure: Option<String>,
}

struct FlowPoint {
    target: Result<FlowTarget, Lost>,
    history: History,
    /// Why it was lost in the last frame that it was searched in.
    reason: Lost,
    size: [usize; 2],
}

struct FlowTarget {
    subset: PreparedSubset,
    calibration: Calibration,
    standard: Standard,
}

impl<'a> Flow<'a> {
    fn new(
        recording: &'a dyn Recording,
        subsets: &[Subset],
        frames: &ReferenceFrames,
        settings: &Settings,
    ) -> Result<Self, CorrelationError> {
        let info = recording.info();
        let whole = Region::whole(info.width_px, info.height_px);
        let settings =
            Settings { shape: Shape::Translation, interpolation: Interpolation::Linear, ..settings.clone() };
        let image = Reference::read_region(recording, whole, frames)?;
        let eight_bit = EightBit::of(image.pixels());
        let bytes = eight_bit.convert(image.pixels());
        let reference = eight_bit.reference(&image)?;
        let point = |subset: &Subset| {
            Reference::check_inside(recording, subset)?;
            let size = [subset.half_width_px, subset.half_height_px].map(|half| 2 * half + 1);
            let around = eight_bit.reference(&Reference::read(recording, subset, frames)?)?;
            let prepared = PreparedSubset::new(&reference, subset, &settings);
            let target = prepared.and_then(|subset| {
                let calibration = calibrate(&around, &subset, size)?;
                let standard = Standard::new(recording, frames, &subset);
                Ok(FlowTarget { subset, calibration, standard })
            });
            Ok(FlowPoint { target, history: History::of(subset), reason: Lost::LowCorrelation, size })
        };
        let points = subsets.iter().map(point).collect::<Result<_, CorrelationError>>()?;
        Ok(Self {
            recording,
            reference_frames: frames.range(),
            eight_bit,
            reference: bytes,
            settings,
            points,
            workspace: Workspace::default(),
            failure: None,
        })
    }

    /// Where each subset's flow starts in a frame, if the past leads to expect it somewhere.
    fn starts(&self) -> Vec<Option<[f64; 2]>> {
        let start = |point: &FlowPoint| {
            (point.target.is_ok() && point.history.n_lost == 0).then(|| point.history.predict().position_px)
        };
        self.points.iter().map(start).collect()
    }

    /// The flow of all subsets from the reference to a frame; `None` where OpenCV found none. Subsets of the same size go together.
    fn flow(
        &self,
        images: &Images<'_>,
        starts: &[Option<[f64; 2]>],
    ) -> Result<Vec<Option<[f64; 2]>>, String> {
        let mut by_size: BTreeMap<[usize; 2], Vec<usize>> = BTreeMap::new();
        for (i, (point, _)) in
            self.points.iter().zip(starts).enumerate().filter(|(_, (_, start))| start.is_some())
        {
            by_size.entry(point.size).or_default().push(i);
        }
        let mut places = vec![None; self.points.len()];
        for (size, members) in by_size {
            let targets = members.iter().filter_map(|&i| self.points[i].target.as_ref().ok());
            let from: Vec<[f64; 2]> = targets.map(|target| target.subset.centre_px).collect();
            let to: Vec<[f64; 2]> = members.iter().filter_map(|&i| starts[i]).collect();
            let found = images.flow(size, &self.settings, &from, &to)?;
            members.into_iter().zip(found).for_each(|(i, place)| places[i] = place);
        }
        Ok(places)
    }

    fn locate_all(&mut self, frame: usize) -> Result<Vec<Found>, String> {
        let info = self.recording.info();
        let whole = Region::whole(info.width_px, info.height_px);
        let mut pixels = vec![0.0; whole.n_pixels()];
        if self.recording.read_region(frame, whole, &mut pixels).is_err() {
            return Ok(vec![Err(Lost::Unreadable); self.points.len()]);
        }
        let bytes = self.eight_bit.convert(&pixels);
        let mut window = Window::empty(Interpolation::Linear);
        window
            .start(whole, [0; 2])
            .iter_mut()
            .zip(&bytes)
            .for_each(|(value, &byte)| *value = f32::from(byte));
        window.finish();
        let reference = std::mem::take(&mut self.reference);
        let images = Images { size_px: [info.width_px, info.height_px], still: &reference, moved: &bytes };
        let starts = self.starts();
        let places = self.flow(&images, &starts);
        let found = places.map(|places| {
            let first = starts.iter().zip(places).map(|(start, place)| start.map(|_| place));
            first.enumerate().map(|(i, first)| self.find(i, frame, first, &images, &window)).collect()
        });
        self.reference = reference;
        found
    }

    /// The position of one subset, whose flow from where it was expected leads to a place.
    fn find(
        &mut self,
        i: usize,
        frame: usize,
        first: Option<Option<[f64; 2]>>,
        images: &Images<'_>,
        window: &Window,
    ) -> Found {
        let FlowPoint { target, history, reason, size } = &mut self.points[i];
        let FlowTarget { subset, calibration, standard } = target.as_mut().map_err(|reason| *reason)?;
        let is_certain = self.reference_frames.contains(&frame);
        let recording = self.recording;
        let search = FrameSearch { recording, subset, standard, history, reason: *reason, is_certain };
        let (settings, workspace, failure) = (&self.settings, &mut self.workspace, &mut self.failure);
        let mut single = SingleFlow { images, window, subset, size: *size, settings, workspace, failure };
        let first = first.map(|place| single.judged(place.ok_or(Lost::NotConverged)?));
        let (place, found) = search.find_after(frame, first, &mut single)?;
        // The whole reference resembles itself more than any frame does.
        if self.reference_frames != (frame..frame + 1) {
            standard.note(&SingleFlow::seen(&(place, found)));
        }
        let follow =
            |following: &PreparedSubset| following.solve(window, Warp::at(place), single.workspace).ok();
        let [x_px, y_px] = calibration.correct(place, &found, follow);
        Ok(Position { x_px, y_px, theta_rad: None, zncc: found.zncc, iterations: 0 })
    }
}

/// The flow of one subset.
struct SingleFlow<'a> {
    images: &'a Images<'a>,
    window: &'a Window,
    subset: &'a PreparedSubset,
    size: [usize; 2],
    settings: &'a Settings,
    workspace: &'a mut Workspace,
    failure: &'a mut Option<String>,
}

impl SingleFlow<'_> {
    /// A place, if the frame resembles the reference there.
    fn judged(&mut self, place: [f64; 2]) -> Result<([f64; 2], Judgement), Lost> {
        if !self.subset.fits(self.window, &Warp::at(place)) {
            return Err(Lost::OutOfView);
        }
        let found = judge(self.subset, self.window, place, self.workspace).ok_or(Lost::LowCorrelation)?;
        let resembles = found.zncc >= self.settings.acceptance.least_zncc();
        if resembles { Ok((place, found)) } else { Err(Lost::LowCorrelation) }
    }
}

impl Locate for SingleFlow<'_> {
    type Found = ([f64; 2], Judgement);

    fn deforms(&self) -> bool {
        false
    }

    fn locate(&mut self, _: usize, start: Warp) -> Result<Self::Found, Lost> {
        let (from, to) = (self.subset.centre_px, start.position_px);
        match self.images.flow(self.size, self.settings, &[from], &[to]) {
            Ok(places) => self.judged(places.into_iter().next().flatten().ok_or(Lost::NotConverged)?),
            Err(error) => {
                self.failure.get_or_insert(error);
                Err(Lost::NotConverged)
            }
        }
    }

    fn seen((place, found): &Self::Found) -> PlaceMatch {
        PlaceMatch { warp: Warp::at(*place), zncc: found.zncc, share_seen: 1.0, light: None }
    }
}

impl Tracker for Flow<'_> {
    fn locate(&mut self, frame: usize) -> Vec<Found> {
        let found = self.locate_all(frame).unwrap_or_else(|error| {
            self.failure.get_or_insert(error);
            vec![Err(Lost::NotConverged); self.points.len()]
        });
        for (point, found) in self.points.iter_mut().zip(&found) {
            point.history.note(found);
            point.reason = found.err().unwrap_or(point.reason);
        }
        found
    }

    fn restart(&mut self, found: &[Found]) {
        for (point, found) in self.points.iter_mut().zip(found) {
            if let Ok(target) = &mut point.target {
                point.history = History::restarted(found, target.subset.centre_px);
                target.standard.restart(&target.subset);
            }
        }
    }
}

/// The bias and precision of the method on pictures of a subset of an 8-bit reference.
fn calibrate(reference: &Reference, subset: &PreparedSubset, size: [usize; 2]) -> Result<Calibration, Lost> {
    let region = reference.region();
    let corner = [region.x as f64, region.y as f64];
    let here = [0, 1].map(|axis| subset.centre_px[axis] - corner[axis]);
    let bytes = |pixels: &[f32]| -> Vec<u8> { pixels.iter().map(|pixel| (pixel + 0.5) as u8).collect() };
    Calibration::new(reference, subset, 1.0 / 12.0, |still, picture| {
        let (still, moved) = (bytes(still), bytes(picture));
        let images = Images { size_px: [region.width, region.height], still: &still, moved: &moved };
        let found = images.flow(size, &subset.settings, &[here], &[here]).ok()?.pop()??;
        Some([0, 1].map(|axis| found[axis] + corner[axis]))
    })
}

/// Two 8-bit images of the same size.
struct Images<'a> {
    size_px: [usize; 2],
    still: &'a [u8],
    moved: &'a [u8],
}

impl Images<'_> {
    /// The flow of windows of a size around points; `None` where OpenCV found none.
    fn flow(
        &self,
        window_px: [usize; 2],
        settings: &Settings,
        from: &[[f64; 2]],
        starts: &[[f64; 2]],
    ) -> Result<Vec<Option<[f64; 2]>>, String> {
        let &Settings { max_iterations, convergence_px, .. } = settings;
        let library = library().ok_or("the program has none")?;
        let settings = FlowSettings { window_px, max_iterations, convergence_px };
        library.optical_flow(self.size_px, [self.still, self.moved], from, starts, &settings)
    }
}

/// The scale from counts to 8 bits.
struct EightBit {
    low: f32,
    per_count: f32,
}

impl EightBit {
    /// The range of a reference; counts beyond it in other frames are clipped.
    fn of(pixels: &[f32]) -> Self {
        let low = pixels.iter().copied().fold(f32::INFINITY, f32::min);
        let high = pixels.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        Self { low, per_count: 255.0 / (high - low).max(f32::MIN_POSITIVE) }
    }

    /// A reference in 8 bits.
    fn reference(&self, counts: &Reference) -> Result<Reference, CorrelationError> {
        let bytes = self.convert(counts.pixels()).into_iter().map(f32::from).collect();
        Reference::new(counts.region(), bytes, counts.n_averaged())
    }

    fn convert(&self, pixels: &[f32]) -> Vec<u8> {
        let mut bytes = vec![0; pixels.len()];
        chainwave_vectors::dispatch_loop(
            #[inline(always)]
            || {
                for (byte, pixel) in bytes.iter_mut().zip(pixels) {
                    // `as` clips to 0..=255, and makes 0 of a pixel that is no number
                    *byte = ((pixel - self.low) * self.per_count + 0.5) as u8;
                }
            },
        );
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eight_bits_span_the_reference() {
        let scale = EightBit::of(&[100.0, 2100.0, 300.0]);
        assert_eq!(scale.convert(&[100.0, 2100.0, 1100.0, 0.0, 4000.0, f32::NAN]), [0, 255, 128, 0, 255, 0]);
        assert_eq!(EightBit::of(&[5.0; 4]).convert(&[5.0, 6.0]), [0, 255]);
    }
}
