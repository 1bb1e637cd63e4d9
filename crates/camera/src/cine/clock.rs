//! Times of a .cine's frames after the trigger, from time stamps or from image numbers, and the frame rate.

use super::blocks::Blocks;
use super::header::{CineHeader, TICKS_PER_SECOND};
use super::setup::Setup;
use crate::bytes::Bytes;
use crate::error::CameraError;
use crate::name_list::first_names;
use crate::options::OpenOptions;

/// The two lowest bits of a time stamp say how the clock was synchronised.
const STAMP_FLAGS: u64 = 0b11;
/// A frame is in step when its interval lies within this fraction of the usual one.
const STEP_TOLERANCE: f64 = 0.5;
/// Rates of header and time stamps that differ by more than this are worth a warning.
const RATE_TOLERANCE: f64 = 0.01;
const SECONDS_PER_DAY: f64 = 86_400.0;

/// When each frame was taken.
pub(super) struct Clock {
    /// Time after the trigger, in seconds, one for each frame.
    pub(super) times_s: Vec<f64>,
    /// Frames per second.
    pub(super) rate_hz: Option<f64>,
    pub(super) warnings: Vec<String>,
}

impl Clock {
    /// Times from the time stamps where they exist and increase, else from image numbers and the header's rate.
    pub(super) fn of(
        bytes: Bytes,
        header: &CineHeader,
        setup: &Setup,
        blocks: &Blocks,
    ) -> Result<Self, CameraError> {
        let times_s = blocks.stamps.as_ref().map(|stamps| since_trigger_s(stamps, header.trigger));
        match (times_s, setup.rate_hz) {
            (Some(times_s), stated_hz) => Ok(Self::from_stamps(times_s, header, stated_hz)),
            (None, Some(rate_hz)) => {
                Ok(Self::from_numbers(header, rate_hz, "the file holds no time stamps of its images"))
            }
            (None, None) => Err(bytes.malformed(
                "frame times",
                header.setup_offset,
                "time stamps or a frame rate",
                "neither",
            )),
        }
    }

    fn from_stamps(mut times_s: Vec<f64>, header: &CineHeader, stated_hz: Option<f64>) -> Self {
        let mended = usual_interval_s(&times_s).and_then(|usual_s| mend_isolated(&mut times_s, usual_s));
        let mut clock = Self::from_mended(times_s, header, stated_hz);
        clock.warnings.extend(mended);
        clock
    }

    fn from_mended(times_s: Vec<f64>, header: &CineHeader, stated_hz: Option<f64>) -> Self {
        match (usual_interval_s(&times_s), stated_hz) {
            (Some(interval_s), _) => Self::in_step(times_s, header, interval_s, stated_hz),
            (None, Some(rate_hz)) if times_s.len() > 1 => {
                Self::from_numbers(header, rate_hz, "the time stamps do not increase")
            }
            (None, _) => {
                let mut warnings = far_from_trigger(&times_s);
                warnings.push("no rate can be told from the time stamps; it is the header's".into());
                Self { times_s, rate_hz: stated_hz, warnings }
            }
        }
    }

    fn in_step(times_s: Vec<f64>, header: &CineHeader, interval_s: f64, stated_hz: Option<f64>) -> Self {
        let rate_hz = interval_s.recip();
        let mut warnings = far_from_trigger(&times_s);
        warnings.extend(out_of_step(&times_s, interval_s));
        warnings.extend(stated_hz.and_then(|stated_hz| other_rate(stated_hz, rate_hz)));
        warnings.extend(other_number(header.first_image, &times_s, rate_hz));
        Self { times_s, rate_hz: Some(rate_hz), warnings }
    }

    fn from_numbers(header: &CineHeader, rate_hz: f64, reason: &str) -> Self {
        let first = f64::from(header.first_image);
        let times_s = (0..header.n_images).map(|index| (first + f64::from(index)) / rate_hz).collect();
        let warning =
            format!("{reason}: times are image number / {rate_hz} Hz, the rate that the header states");
        Self { times_s, rate_hz: Some(rate_hz), warnings: vec![warning] }
    }
}

impl Clock {
    /// What is to be said of a rate that the caller gave, and that the file contradicts: its own clock wins.
    pub(super) fn unused_rate(&self, options: &OpenOptions) -> Option<String> {
        let (given_hz, own_hz) = (options.rate_hz?, self.rate_hz?);
        ((given_hz / own_hz - 1.0).abs() > RATE_TOLERANCE).then(|| {
            format!("the given rate of {given_hz} Hz is not used: the file's own clock says {own_hz:.3} Hz")
        })
    }
}

/// Time stamps relative to the trigger, subtracted as integers: seconds since 1970 in floating point would cost 0.24
/// microseconds.
fn since_trigger_s(stamps: &[u64], trigger: u64) -> Vec<f64> {
    let ticks = |stamp: u64| i128::from(stamp & !STAMP_FLAGS);
    stamps.iter().map(|&stamp| (ticks(stamp) - ticks(trigger)) as f64 / TICKS_PER_SECOND).collect()
}

/// Mean interval of the frames in step, in seconds; `None` when most stamps do not increase.
///
/// The median finds the frames in step, whatever dummy or dropped frames there are; the mean over them undoes the rounding of
/// stamps, which some cameras write in whole microseconds.
fn usual_interval_s(times_s: &[f64]) -> Option<f64> {
    let mut intervals_s: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    intervals_s.sort_by(f64::total_cmp);
    let median_s = intervals_s.get(intervals_s.len() / 2).copied().filter(|&median_s| median_s > 0.0)?;
    intervals_s.retain(|&interval_s| in_step(interval_s, median_s));
    Some(intervals_s.iter().sum::<f64>() / intervals_s.len() as f64)
}

fn in_step(interval_s: f64, usual_s: f64) -> bool {
    (interval_s - usual_s).abs() <= STEP_TOLERANCE * usual_s
}

/// Puts a time that does not lie between its neighbours into their middle, where they are two usual intervals apart: there its frame was taken, whatever
/// its stamp says. One such stamp would spoil the order of all frames. Gives a warning that names the frames.
fn mend_isolated(times_s: &mut [f64], usual_s: f64) -> Option<String> {
    let mut mended: Vec<String> = Vec::new();
    for frame in 1..times_s.len().saturating_sub(1) {
        let (before_s, stated_s, after_s) = (times_s[frame - 1], times_s[frame], times_s[frame + 1]);
        let is_between = before_s < stated_s && stated_s < after_s;
        if !is_between && in_step(after_s - before_s - usual_s, usual_s) {
            times_s[frame] = before_s + 0.5 * (after_s - before_s);
            mended.push(format!("frame {frame} ({stated_s} s after the trigger)"));
        }
    }
    let named = first_names(&mended);
    (!mended.is_empty()).then(|| {
        format!(
            "{} time stamps do not lie between those of the frames before and after, which are two frame intervals apart: {named}; the \
             middle of the two is taken",
            mended.len()
        )
    })
}

/// Names the first frame that does not follow its predecessor by the usual interval.
fn out_of_step(times_s: &[f64], usual_s: f64) -> Option<String> {
    let intervals_s: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let late = |interval_s: &f64| !in_step(*interval_s, usual_s);
    let first = intervals_s.iter().position(late)?;
    let n_late = intervals_s.iter().filter(|interval_s| late(interval_s)).count();
    Some(format!(
        "frame {} lies {} s after its predecessor where {usual_s:.6e} s is usual ({n_late} such steps in all)",
        first + 1,
        intervals_s[first],
    ))
}

fn far_from_trigger(times_s: &[f64]) -> Vec<String> {
    let first_s = times_s.first().copied().filter(|first_s| first_s.abs() > SECONDS_PER_DAY);
    first_s
        .map(|first_s| format!("frame 0 lies {first_s} s from the trigger, more than a day"))
        .into_iter()
        .collect()
}

fn other_rate(stated_hz: f64, rate_hz: f64) -> Option<String> {
    ((stated_hz / rate_hz - 1.0).abs() > RATE_TOLERANCE).then(|| {
        format!("the header states {stated_hz} Hz; the time stamps, which are used, say {rate_hz:.3} Hz")
    })
}

/// Image numbers count from the trigger, but not in every camera's files.
fn other_number(first_image: i32, times_s: &[f64], rate_hz: f64) -> Option<String> {
    let stated = f64::from(first_image);
    let from_time = times_s.first()? * rate_hz;
    ((stated - from_time).abs() > 2.0 + RATE_TOLERANCE * stated.abs()).then(|| {
        format!("the first image is number {first_image}, but its time stamp, which is used, makes it {from_time:.1}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2023-11-14, with both flags set.
    const TRIGGER: u64 = (1_700_000_000 << 32) | 0x8000_0003;

    fn stamps(n: u64, interval_ticks: u64) -> Vec<u64> {
        (0..n).map(|index| (TRIGGER + (index + 1) * interval_ticks) | STAMP_FLAGS).collect()
    }

    #[test]
    fn stamps_keep_every_tick_and_lose_their_flags() {
        let times_s = since_trigger_s(&[TRIGGER + 4, TRIGGER & !STAMP_FLAGS, TRIGGER - (1 << 32)], TRIGGER);
        // Exact: multiples of 2^-32 below 2^21 s fit into 53 bits.
        assert_eq!(times_s, [4.0 / TICKS_PER_SECOND, 0.0, -1.0]);
    }

    #[test]
    fn the_rate_ignores_dummy_and_dropped_frames() {
        let mut stamps = stamps(100, 42_949_672);
        stamps.remove(40);
        stamps.push(TRIGGER + (25_280_568 << 32));
        let interval_s = usual_interval_s(&since_trigger_s(&stamps, TRIGGER)).unwrap();
        // Stamps are rounded to 4 ticks (0.93 ns) by their flags.
        assert!((interval_s - 0.01).abs() < 1e-9, "{interval_s}");
        let warning = out_of_step(&since_trigger_s(&stamps, TRIGGER), interval_s).unwrap();
        assert!(warning.starts_with("frame 40 ") && warning.contains("2 such steps"), "{warning}");
    }

    #[test]
    fn stamps_in_whole_microseconds_still_give_the_rate() {
        let times_s: Vec<f64> = (0..97).map(|index| (f64::from(index) * 28.5).floor() * 1e-6).collect();
        // The first and last stamps are each rounded by less than 1 us over 96 intervals.
        assert!((usual_interval_s(&times_s).unwrap() - 28.5e-6).abs() < 1e-6 / 96.0);
    }

    #[test]
    fn a_stamp_that_is_out_of_order_alone_is_put_between_its_neighbours() {
        let right_s: Vec<f64> = (0..100).map(|frame| f64::from(frame) * 0.01).collect();
        let mut times_s = right_s.clone();
        // A stamp of zero, one an hour late, and one before its predecessor.
        (times_s[40], times_s[42], times_s[98]) = (-1.7e9, 3600.42, 0.965);
        let usual_s = usual_interval_s(&times_s).unwrap();
        let warning = mend_isolated(&mut times_s, usual_s).unwrap();
        for part in ["3 time stamps", "frame 40 (-1700000000 s", "frame 42 (3600.42 s", "frame 98 ("] {
            assert!(warning.contains(part), "{part}: {warning}");
        }
        // Half the sum of two neighbours has their rounding.
        assert!(times_s.iter().zip(&right_s).all(|(found, right)| (found - right).abs() < 1e-15));
        assert_eq!(mend_isolated(&mut times_s, usual_s), None);
    }

    #[test]
    fn stamps_that_no_neighbours_vouch_for_stay_as_they_are() {
        let right_s: Vec<f64> = (0..100).map(|frame| f64::from(frame) * 0.01).collect();
        let changed = |change: fn(&mut Vec<f64>)| {
            let mut times_s = right_s.clone();
            change(&mut times_s);
            times_s
        };
        for times_s in [
            // The last one; two in a row; one beside dropped frames; one within the order of the others.
            changed(|times_s| times_s[99] = 1e6),
            changed(|times_s| times_s[40..42].copy_from_slice(&[-1e9, -1e9])),
            changed(|times_s| {
                times_s.drain(41..45);
                times_s[40] = 1e6;
            }),
            changed(|times_s| times_s[40] += 0.004),
        ] {
            let mut kept = times_s.clone();
            assert_eq!(mend_isolated(&mut kept, 0.01), None);
            assert_eq!(kept, times_s);
        }
    }

    #[test]
    fn stamps_that_do_not_increase_give_no_rate() {
        assert_eq!(usual_interval_s(&[1.0, 1.0, 1.0]), None);
        assert_eq!(usual_interval_s(&[3.0, 2.0, 1.0]), None);
        assert_eq!(usual_interval_s(&[1.0]), None);
        assert_eq!(usual_interval_s(&[]), None);
    }
}
