//! The last decoded frames of a compressed recording, shared by threads.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

/// Frames that are kept at least, so that threads which are at neighbouring frames do not make each other decode again.
const LEAST_KEPT: usize = 4;

/// The last decoded frames of a compressed recording: all regions of a frame cost one decoding.
pub(crate) struct FrameCache<D, F> {
    state: Mutex<CacheState<D, F>>,
}

struct CacheState<D, F> {
    decoder: D,
    n_kept: usize,
    /// Frame numbers and frames, the oldest first.
    kept: VecDeque<(usize, Arc<F>)>,
}

impl<D, F> FrameCache<D, F> {
    /// An empty cache of few frames in front of a decoder.
    pub(crate) fn new(decoder: D) -> Self {
        Self::of_frames(decoder, LEAST_KEPT)
    }

    /// An empty cache of `n_kept` frames, or few if that is less.
    pub(crate) fn of_frames(decoder: D, n_kept: usize) -> Self {
        let n_kept = n_kept.max(LEAST_KEPT);
        Self { state: Mutex::new(CacheState { decoder, n_kept, kept: VecDeque::new() }) }
    }

    /// The frame, decoded unless it is kept. A failure is not kept.
    pub(crate) fn get(
        &self,
        frame: usize,
        decode: impl FnOnce(&mut D) -> Result<F, String>,
    ) -> Result<Arc<F>, String> {
        self.get_run(frame, |decoder, _| decode(decoder).map(|decoded| vec![decoded]))
    }

    /// As [`FrameCache::get`], for a decoder that passes other frames on its way: `decode` is told how many frames are kept,
    /// and gives the last of those that it passes, in their order, and then the frame.
    pub(crate) fn get_run(
        &self,
        frame: usize,
        decode: impl FnOnce(&mut D, usize) -> Result<Vec<F>, String>,
    ) -> Result<Arc<F>, String> {
        let mut state = self.state.lock().map_err(|_| "an earlier decoding was cut off".to_owned())?;
        if let Some((_, found)) = state.kept.iter().find(|(number, _)| *number == frame) {
            return Ok(Arc::clone(found));
        }
        let CacheState { decoder, n_kept, kept } = &mut *state;
        let run = decode(decoder, *n_kept)?;
        let first = frame + 1 - run.len().min(frame + 1);
        kept.extend(run.into_iter().enumerate().map(|(index, decoded)| (first + index, Arc::new(decoded))));
        kept.drain(..kept.len().saturating_sub(*n_kept));
        let decoded = kept.back().filter(|(number, _)| *number == frame);
        decoded.map(|(_, decoded)| Arc::clone(decoded)).ok_or_else(|| "the decoder gave no frame".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kept_frame_is_not_decoded_again() {
        let cache: FrameCache<Vec<usize>, usize> = FrameCache::new(Vec::new());
        let get = |frame| {
            *cache
                .get(frame, |decoded| {
                    decoded.push(frame);
                    Ok(10 * frame)
                })
                .unwrap()
        };
        for frame in [0, 0, 1, 0, 1, 2, 3, 0, 4, 4, 0] {
            assert_eq!(get(frame), 10 * frame);
        }
        let decoded = cache.state.into_inner().unwrap().decoder;
        assert_eq!(decoded, [0, 1, 2, 3, 4, 0]);
    }

    #[test]
    fn frames_that_were_passed_are_kept() {
        let cache: FrameCache<usize, usize> = FrameCache::of_frames(0, 5);
        let get = |frame| {
            let run = |n_decoded: &mut usize, n_kept: usize| {
                let run: Vec<usize> = (frame + 1 - n_kept.min(frame + 1)..=frame).collect();
                *n_decoded += run.len();
                Ok(run)
            };
            *cache.get_run(frame, run).unwrap()
        };
        for frame in (0..20).rev() {
            assert_eq!(get(frame), frame);
        }
        assert_eq!(cache.state.into_inner().unwrap().decoder, 20, "each frame is decoded once");
    }

    #[test]
    fn a_failure_is_tried_again() {
        let cache: FrameCache<(), u8> = FrameCache::new(());
        assert!(cache.get(0, |()| Err("broken".into())).is_err());
        assert_eq!(cache.get(0, |()| Ok(7)).map(|frame| *frame), Ok(7));
    }
}
