//! Times of frames that have no time stamps: from a stated rate, or counted in frames.

use chainwave_measurement::RecordingInfo;

use crate::options::OpenOptions;

/// When the frames of a recording without any clock were taken.
pub(crate) struct Timing {
    pub(crate) rate_hz: Option<f64>,
    /// Time after the first frame: in seconds, or in frames when no rate is known.
    pub(crate) times_s: Vec<f64>,
    pub(crate) warning: String,
}

impl Timing {
    /// Times of frames that were taken `steps` intervals after the first, at the caller's rate, else at the file's own.
    pub(crate) fn of(
        steps: impl Iterator<Item = u64>,
        options: &OpenOptions,
        stated_hz: Option<f64>,
    ) -> Self {
        let rate_hz = options.rate_hz.or(stated_hz);
        let interval = rate_hz.map_or(1.0, f64::recip);
        let times_s = steps.map(|step| step as f64 * interval).collect();
        let warning = match rate_hz {
            Some(rate_hz) => {
                format!("the recording holds no time stamps: t = 0 is its first frame, at {rate_hz} Hz")
            }
            None => {
                "the recording states no frame rate: its times count frames, not seconds, until one is given \
                     (`rate_hz`)"
                    .into()
            }
        };
        Self { rate_hz, times_s, warning }
    }
}

/// Whether a recording says how many of its bits are significant.
pub(crate) fn states_depth(info: &RecordingInfo) -> bool {
    unstated_depth(info.bit_depth).is_none_or(|warning| !info.warnings.contains(&warning))
}

/// What a file of 16 bits leaves open.
pub(crate) fn unstated_depth(bit_depth: u32) -> Option<String> {
    (bit_depth == 16)
        .then(|| "the file does not say how many of its 16 bits are significant; all are assumed".into())
}
