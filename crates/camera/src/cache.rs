use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

/// Frames that are kept, so that threads which are at neighbouring frames do not make each other decode again.
const N_KEPT: usize = 4;

/// The last decoded frames of a compressed recording: all regions of a frame cost one decoding.
pub(crate) struct FrameCache<D, F> {
    state: Mutex<State<D, F>>,
}

struct State<D, F> {
    decoder: D,
    /// Frame numbers and frames, the oldest first.
    kept: VecDeque<(usize, Arc<F>)>,
}

impl<D, F> FrameCache<D, F> {
    /// An empty cache in front of a decoder.
    pub(crate) fn new(decoder: D) -> Self {
        Self { state: Mutex::new(State { decoder, kept: VecDeque::new() }) }
    }

    /// The frame, decoded unless it is kept. A failure is not kept.
    pub(crate) fn get(
        &self,
        frame: usize,
        decode: impl FnOnce(&mut D) -> Result<F, String>,
    ) -> Result<Arc<F>, String> {
        let mut state = self.state.lock().map_err(|_| "an earlier decoding was cut off".to_owned())?;
        if let Some((_, found)) = state.kept.iter().find(|(number, _)| *number == frame) {
            return Ok(Arc::clone(found));
        }
        let decoded = Arc::new(decode(&mut state.decoder)?);
        if state.kept.len() == N_KEPT {
            state.kept.pop_front();
        }
        state.kept.push_back((frame, Arc::clone(&decoded)));
        Ok(decoded)
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
    fn a_failure_is_tried_again() {
        let cache: FrameCache<(), u8> = FrameCache::new(());
        assert!(cache.get(0, |()| Err("broken".into())).is_err());
        assert_eq!(cache.get(0, |()| Ok(7)).map(|frame| *frame), Ok(7));
    }
}
