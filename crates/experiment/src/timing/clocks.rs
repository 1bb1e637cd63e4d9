//! Frame rates that are not what recordings state: told by bodies that other views show too, or by other trials of the view, and put right.

use std::collections::BTreeSet;
use std::num::NonZero;

use chainwave_analysis::probability::student;
use chainwave_measurement::{
    BodyTrack, Estimate, Observation, SharedReadingError, TrackDeviation, robust_sigma_about_zero,
};
use chainwave_stitching::{ClockOf, ClockShown};

use crate::finding::Finding;
use crate::timing::rough_clocks::rough_excesses;
use crate::wording::estimate;

/// The kind of the finding that says so.
const CLOCK: &str = "clock";

/// Standard deviations by which a clock is told to be off: of the readings' noise, and of how far what stretches of bodies say of it scatters. Other errors of the readings
/// look a little like a clock's, but not in all stretches alike.
const DETECTION_SIGMAS: f64 = 5.0;
const TOLD_BY_STRETCHES: f64 = 4.0;
/// The same of single recordings, of which orders of the response to the drive that are not fitted show something as well.
const TOLD_OF_RECORDING: f64 = 6.0;
/// No quartz is farther off, and what is stated otherwise than it is, is so by far more.
const LEAST: f64 = 1e-4;
/// Rates are misstated by more than this, by a rounded number or that of another film. What is less is rather orders of the response to the drive that are
/// not fitted, which make a clock of 4e-4 where views of few trials were struck otherwise...
const USUAL: f64 = 1e-3;
/// ...and asks for so many times the deviations.
const OF_UNUSUAL: f64 = 2.0;
/// Standard deviations by which one that was told changes for the last time.
const REFINED: f64 = 0.2;
/// Share of the gain from which on another view's clock explains the same: which of the two is right nobody tells.
const AS_GOOD: f64 = 0.9;
/// Share of a clock's error within which others are off as it is.
const ALIKE: f64 = 0.2;
/// Frames on each side between which a body's velocity is taken.
const REACH: usize = 2;

/// The clocks that are off.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Clocks {
    told: Vec<FrameRateError>,
}

/// A clock that is off.
#[derive(Debug, Clone, PartialEq)]
struct FrameRateError {
    of: ClockOf,
    /// By how much longer the time between frames is than stated, relative to that.
    excess: f64,
    /// Standard uncertainty of that; of one that is found roughly it is not known.
    sigma: Option<f64>,
    /// What else explains the same; half of it is put right then.
    or: Option<Otherwise>,
}

/// What explains the same as a clock that is off.
#[derive(Debug, Clone, PartialEq)]
enum Otherwise {
    /// The clock of another view, off by as much the other way; half of it is put right there.
    Clock(ClockOf),
    /// Errors of its pictures that are larger than noise, and stay where they are on the sensor: of a body that passes them they make a drift.
    Pictures,
}

impl Clocks {
    /// Views whose clocks are far off, from which a finer look goes on; of two, each may be the one.
    pub(crate) fn roughly(
        observations: &[Observation],
        rest_until_s: f64,
        n_threads: NonZero<usize>,
    ) -> Self {
        let views: BTreeSet<u32> = observations.iter().map(|one| one.view).collect();
        let clock = |(view, excess): (u32, f64)| {
            let other = views.iter().find(|other| **other != view).filter(|_| views.len() == 2);
            FrameRateError {
                of: ClockOf::View(view),
                excess,
                sigma: None,
                or: other.map(|other| Otherwise::Clock(ClockOf::View(*other))),
            }
        };
        Self { told: rough_excesses(observations, rest_until_s, n_threads).into_iter().map(clock).collect() }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.told.is_empty()
    }

    /// The clocks after another alignment says what is left of them; `None` where nothing is to be changed.
    pub(crate) fn after(&self, shown: &[ClockShown]) -> Option<Self> {
        let shown = as_recordings_scatter(shown);
        self.refined(&shown).or_else(|| self.with_another(&shown)).or_else(|| self.by_most_views(&shown))
    }

    /// The same where most views are right: of views that are all off alike, beside fewer that are not, it is these that are off the other way. `None` where
    /// most views are right already.
    fn by_most_views(&self, shown: &[ClockShown]) -> Option<Self> {
        let of_views = || self.told.iter().filter(|clock| clock.of.is_view() && clock.or.is_none());
        let like = |one: &FrameRateError| {
            let is_like =
                |other: &&FrameRateError| (other.excess - one.excess).abs() < ALIKE * one.excess.abs();
            of_views().filter(is_like).collect::<Vec<_>>()
        };
        let alike = of_views().map(like).max_by_key(Vec::len)?;
        let is_right =
            |one: &&ClockShown| one.of.is_view() && !self.told.iter().any(|clock| clock.of == one.of);
        let right: Vec<&ClockShown> = shown.iter().filter(is_right).collect();
        if alike.len() <= right.len() {
            return None;
        }
        let usual = alike.iter().map(|clock| clock.excess).sum::<f64>() / alike.len() as f64;
        let against = |excess: f64| (1.0 + excess) / (1.0 + usual) - 1.0;
        let others = self.told.iter().filter(|clock| !alike.iter().any(|like| like.of == clock.of));
        let moved = |clock: &FrameRateError| match clock.of.is_view() {
            true => FrameRateError { excess: against(clock.excess), sigma: None, ..clock.clone() },
            false => clock.clone(),
        };
        let off = |one: &&ClockShown| FrameRateError {
            of: one.of.clone(),
            excess: against(0.0),
            sigma: None,
            or: None,
        };
        Some(Self { told: others.map(moved).chain(right.iter().map(off)).collect() })
    }

    /// Those that were told, put right by what is left of them; `None` where that is next to nothing.
    fn refined(&self, shown: &[ClockShown]) -> Option<Self> {
        let mut refined = self.clone();
        let mut is_changed = false;
        for clock in &mut refined.told {
            let Some(left) = shown.iter().find(|one| one.of == clock.of) else { continue };
            is_changed |= clock.sigma.is_none() || left.excess.value.abs() > REFINED * left.excess.sigma;
            clock.excess += left.excess.value;
            clock.sigma = Some(left.excess.sigma);
        }
        // What was found roughly, and is refined to nothing, is none.
        let is_off = |clock: &FrameRateError| {
            let left = shown.iter().find(|one| one.of == clock.of);
            left.is_none_or(|left| is_beyond_chance(&clock.of, clock.excess, left))
        };
        let n_before = refined.told.len();
        refined.told.retain(is_off);
        (is_changed || refined.told.len() < n_before).then_some(refined)
    }

    /// The same with the one that explains most of those that are told besides; `None` where none is.
    fn with_another(&self, shown: &[ClockShown]) -> Option<Self> {
        let is_new = |one: &&ClockShown| {
            let is_known = self.told.iter().any(|clock| clock.of == one.of || clock.other() == Some(&one.of));
            is_told(one) && !is_known
        };
        let best = shown.iter().filter(is_new).max_by(|a, b| a.gain.total_cmp(&b.gain))?;
        let explains_the_same = |one: &&ClockShown| {
            let is_of_views = one.of.is_view() && best.of.is_view();
            let is_opposite = one.excess.value * best.excess.value < 0.0;
            is_of_views
                && is_opposite
                && one.gain > AS_GOOD * best.gain
                && !self.told.iter().any(|clock| clock.of == one.of)
        };
        let or = shown.iter().find(explains_the_same).map(|one| Otherwise::Clock(one.of.clone()));
        let Estimate { value, sigma } = best.excess;
        let mut clocks = self.clone();
        clocks.told.push(FrameRateError { of: best.of.clone(), excess: value, sigma: Some(sigma), or });
        Some(clocks)
    }

    /// Whether it is known how far each is off.
    pub(crate) fn are_known(&self) -> bool {
        self.told.iter().all(|clock| clock.sigma.is_some())
    }

    /// The same of views whose pictures err by more than noise: what they show may be that.
    pub(crate) fn or_pictures(mut self) -> Self {
        for clock in self.told.iter_mut().filter(|clock| clock.of.is_view()) {
            clock.or.get_or_insert(Otherwise::Pictures);
        }
        self
    }

    /// Whether that of a view is among them.
    pub(crate) fn are_of_views(&self) -> bool {
        self.told.iter().any(|clock| clock.of.is_view())
    }

    /// By how much longer the times of a recording are than stated.
    pub(crate) fn factor(&self, view: u32, recording: &str) -> f64 {
        let is_of = |of: &ClockOf| of.holds(view, recording);
        let excess = |clock: &FrameRateError| match &clock.or {
            None if is_of(&clock.of) => clock.excess,
            Some(_) if is_of(&clock.of) => 0.5 * clock.excess,
            Some(Otherwise::Clock(other)) if is_of(other) => -0.5 * clock.excess,
            _ => 0.0,
        };
        self.told.iter().map(|clock| 1.0 + excess(clock)).product()
    }

    /// What is not known of them, as errors of the readings.
    pub(crate) fn errors(&self, observations: &[Observation]) -> Vec<SharedReadingError> {
        let of_clock = |clock: &FrameRateError| {
            let own = |of: &ClockOf, excess: f64| tracks_of(observations, of, excess);
            let name = &clock.of;
            let known_to = clock.sigma.map(|sigma| SharedReadingError {
                source: format!("clock of {name}").into(),
                of_tracks: own(&clock.of, sigma),
            });
            let half = 0.5 * clock.excess;
            let either = clock.or.as_ref().map(|or| match or {
                Otherwise::Clock(other) => SharedReadingError {
                    source: format!("clock of {name} or of {other}").into(),
                    of_tracks: [own(&clock.of, half), own(other, half)].concat(),
                },
                Otherwise::Pictures => SharedReadingError {
                    source: format!("clock of {name} or its pictures").into(),
                    of_tracks: own(&clock.of, half),
                },
            });
            [known_to, either].into_iter().flatten()
        };
        self.told.iter().flat_map(of_clock).collect()
    }

    /// What the reader should know.
    pub(crate) fn findings(&self, observations: &[Observation]) -> Vec<Finding> {
        let finding = |clock: &FrameRateError| {
            let value = clock.excess;
            let percent = 100.0 * value.abs();
            let percent = match clock.sigma {
                Some(sigma) => estimate(Estimate::new(percent, 100.0 * sigma)),
                None => format!("about {percent:.0}"),
            };
            let later = if value > 0.0 { "later" } else { "sooner" };
            let by = match clock.of {
                ClockOf::View(_) => "bodies that other views show too",
                ClockOf::Recording(_) => "the other trials of its view",
            };
            let rates = observations.iter().find(|one| clock.of.holds(one.view, &one.recording)).map(|one| {
                // Its times are by what is believed of them, be that half of it.
                let stated_hz = self.factor(one.view, &one.recording) / one.frame_interval_s();
                format!("is its frame rate {:.0} Hz and not {stated_hz:.0}? ", stated_hz / (1.0 + value))
            });
            let put_right = match &clock.or {
                None => "Its times are put right".to_owned(),
                Some(Otherwise::Clock(other)) => format!(
                    "Or those of {other} as much the other way: half is put right in each, and half counted as an error"
                ),
                Some(Otherwise::Pictures) => "Or its pictures show that, whose own errors are larger than noise: half is put right, and half \
                                              counted as an error"
                    .to_owned(),
            };
            let stiffer = if value > 0.0 { "stiffer" } else { "softer" };
            Finding {
                code: CLOCK,
                subject: clock.of.to_string(),
                text: format!(
                    "frames follow each other {percent} % {later} than their times say, by {by}. {put_right} (hint: {}a chain that was {stiffer} by \
                     {:.2} % when it was filmed looks alike)",
                    rates.unwrap_or_default(),
                    200.0 * value.abs(),
                ),
            }
        };
        self.told.iter().map(finding).collect()
    }
}

impl FrameRateError {
    /// The other clock that explains the same.
    fn other(&self) -> Option<&ClockOf> {
        match &self.or {
            Some(Otherwise::Clock(other)) => Some(other),
            _ => None,
        }
    }
}

/// Whether one is off by more than chance and other errors make it seem.
fn is_told(one: &ClockShown) -> bool {
    one.gain > DETECTION_SIGMAS.powi(2) && is_beyond_chance(&one.of, one.excess.value, one)
}

/// Whether a clock that is off by so much is so by more than the scatter of what shows it, and by more than any quartz.
fn is_beyond_chance(of: &ClockOf, excess: f64, shown: &ClockShown) -> bool {
    let usually = if of.is_view() { TOLD_BY_STRETCHES } else { TOLD_OF_RECORDING };
    let times = if excess.abs() > USUAL { 1.0 } else { OF_UNUSUAL };
    let asked = times * student(usually, shown.degrees_of_freedom);
    excess.abs() > LEAST && excess.abs() / shown.excess.sigma > asked
}

/// The same with sigmas of recordings as large as these scatter; the few whose clocks are off hardly move a median.
fn as_recordings_scatter(shown: &[ClockShown]) -> Vec<ClockShown> {
    let is_recording = |one: &ClockShown| !one.of.is_view();
    let deviations =
        shown.iter().filter(|one| is_recording(one)).map(|one| one.excess.value / one.excess.sigma);
    let enlarged = robust_sigma_about_zero(deviations).unwrap_or(1.0).max(1.0);
    let widened = |one: &ClockShown| match is_recording(one) {
        true => ClockShown {
            excess: Estimate::new(one.excess.value, enlarged * one.excess.sigma),
            gain: one.gain / enlarged.powi(2),
            ..one.clone()
        },
        false => one.clone(),
    };
    shown.iter().map(widened).collect()
}

/// What times that are so much longer, relative to themselves, make of the readings of some recordings.
fn tracks_of(observations: &[Observation], of: &ClockOf, excess: f64) -> Vec<TrackDeviation> {
    let of_track = |one: &Observation, track: &BodyTrack| TrackDeviation {
        recording: one.recording.clone(),
        body: track.body,
        error_m: (0..one.times_s.len())
            .map(|k| excess * one.times_s[k].max(0.0) * velocity_m_per_s(one, track, k))
            .collect(),
    };
    let own = observations.iter().filter(|one| of.holds(one.view, &one.recording));
    own.flat_map(|one| one.bodies.iter().map(|track| of_track(one, track))).collect()
}

/// Velocity of a body about a frame; 0 where it was not seen.
fn velocity_m_per_s(observation: &Observation, track: &BodyTrack, frame: usize) -> f64 {
    let (from, to) = (frame.saturating_sub(REACH), (frame + REACH).min(track.position_m.len() - 1));
    match (track.position_m[from], track.position_m[to]) {
        (Some(before), Some(behind)) => {
            (behind.value - before.value) / (observation.times_s[to] - observation.times_s[from])
        }
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(of: ClockOf, excess: f64, sigma: f64) -> ClockShown {
        let excess = Estimate::new(excess, sigma);
        ClockShown { of, excess, degrees_of_freedom: 20.0, gain: (excess.value / sigma).powi(2) }
    }

    fn view(view: u32, excess: f64) -> ClockShown {
        shown(ClockOf::View(view), excess, 1e-4)
    }

    /// Four trials of each view, which bodies pass at 1 m/s.
    fn observations(n_views: u32) -> Vec<Observation> {
        let times_s: Vec<f64> = (-10..100).map(|k| f64::from(k) * 1e-4).collect();
        let place = |time_s: &f64| Some(Estimate::new(time_s.max(0.0), 1e-6));
        let track = BodyTrack { body: 1, position_m: times_s.iter().map(place).collect() };
        let of = |view: u32, trial: u32| Observation {
            recording: format!("view{view}_trial{trial}"),
            view,
            trial,
            times_s: times_s.clone(),
            bodies: vec![track.clone()],
        };
        (1..=n_views)
            .flat_map(|view| (1..=4).map(move |trial| (view, trial)))
            .map(|(v, t)| of(v, t))
            .collect()
    }

    #[test]
    fn chance_is_no_clock() {
        assert_eq!(Clocks::default().after(&[view(1, 3e-4), view(2, -2e-4)]), None);
        assert_eq!(Clocks::default().after(&[]), None);
        // What no rate is misstated by, and what one is.
        assert_eq!(Clocks::default().after(&[shown(ClockOf::View(1), 4e-4, 7e-5)]), None);
        assert!(Clocks::default().after(&[shown(ClockOf::View(1), 2e-3, 3.5e-4)]).is_some());
        assert!(Clocks::default().after(&[shown(ClockOf::View(1), 4e-4, 2e-5)]).is_some());
        // Many sigmas of noise, and few of what stretches of bodies scatter by.
        let scattered = ClockShown { gain: 1e4, ..shown(ClockOf::View(1), 3e-3, 1e-3) };
        assert_eq!(Clocks::default().after(&[scattered]), None);
    }

    #[test]
    fn the_view_that_explains_most_is_put_right_until_nothing_is_left() {
        let first = Clocks::default().after(&[view(1, -4e-4), view(2, 5e-3), view(3, -3e-3)]).unwrap();
        assert!((first.factor(2, "view2_trial1") - 1.005).abs() < 1e-12);
        assert!((first.factor(1, "view1_trial1") - 1.0).abs() < 1e-12);
        let second = first.after(&[view(1, 0.0), view(2, 1e-4), view(3, 0.0)]).unwrap();
        assert!((second.factor(2, "view2_trial1") - 1.0051).abs() < 1e-12);
        assert_eq!(second.after(&[view(1, 0.0), view(2, 1e-5), view(3, 0.0)]), None);
        let text = second.findings(&observations(3)).remove(0).to_string();
        assert!(text.starts_with("view 2: frames follow each other 0.510 +- 0.010 % later"), "{text}");
        assert!(text.contains("10000 Hz and not 10051?") && text.contains("stiffer by 1.02 %"), "{text}");
    }

    #[test]
    fn most_views_are_right_whichever_were_told_first() {
        // The first and the third of three, off by the same: it is the second one that is off.
        let first = Clocks::default().after(&[view(1, 1.5e-2), view(2, 0.0), view(3, 5e-3)]).unwrap();
        let second = first.after(&[view(1, 0.0), view(2, 0.0), view(3, 1.45e-2)]).unwrap();
        let left = [view(1, 0.0), view(2, 0.0), view(3, 0.0)];
        let turned = second.after(&left).unwrap();
        let [one, two, three] = [1, 2, 3].map(|view| turned.factor(view, ""));
        assert!((one - 1.0).abs() < 1e-12 && (three - 1.0).abs() < 1e-12, "{one} {three}");
        assert!((two - 1.01475_f64.recip()).abs() < 1e-12, "{two}");
        // How far it is off is then found anew, and stays.
        assert!(!turned.are_known());
        let settled = turned.after(&left).unwrap();
        assert!(settled.are_known() && settled.after(&left).is_none());
        // One of three that is off stays the one.
        let alone = Clocks::default().after(&[view(1, 1.5e-2), view(2, 0.0), view(3, 0.0)]).unwrap();
        assert_eq!(alone.after(&left), None);
    }

    #[test]
    fn of_two_views_nobody_tells_which_is_right() {
        let clocks = Clocks::default().after(&[view(1, -4e-3), view(2, 4e-3)]).unwrap();
        let [first, second] = [1, 2].map(|view| clocks.factor(view, ""));
        assert!(
            (second / first - 1.004).abs() < 1e-5 && (first * second - 1.0).abs() < 1e-5,
            "{first} {second}"
        );
        let errors = clocks.errors(&observations(2));
        assert_eq!(errors.len(), 2);
        // Half of it is an error of both views: at 5 ms, of a body at 1 m/s, 10 um.
        let either = errors.iter().max_by_key(|error| error.of_tracks.len()).unwrap();
        assert_eq!(either.of_tracks.len(), 8);
        for track in &either.of_tracks {
            assert!((track.error_m[60].abs() - 2e-3 * 5e-3).abs() < 1e-9, "{}", track.error_m[60]);
        }
        assert!(clocks.findings(&observations(2))[0].text.contains("half is put right in each"));
    }

    #[test]
    fn what_pictures_may_show_by_themselves_is_put_right_by_half() {
        let told = Clocks::default().after(&[view(1, -4e-4), view(2, 5e-3), view(3, -3e-3)]).unwrap();
        let clocks = told.or_pictures();
        assert!((clocks.factor(2, "view2_trial1") - 1.0025).abs() < 1e-12);
        assert!((clocks.factor(3, "view3_trial1") - 1.0).abs() < 1e-12);
        // The other half is an error of its four trials: at 5 ms, of a body at 1 m/s, 12.5 um.
        let errors = clocks.errors(&observations(3));
        let either = errors.iter().find(|error| error.source.to_string().contains("pictures")).unwrap();
        assert_eq!(either.of_tracks.len(), 4);
        for track in &either.of_tracks {
            assert!((track.error_m[60].abs() - 2.5e-3 * 5e-3).abs() < 1e-9, "{}", track.error_m[60]);
        }
        assert!(clocks.findings(&observations(3))[0].text.contains("larger than noise"));
    }

    #[test]
    fn recordings_are_measured_by_how_they_scatter() {
        let of =
            |trial: u32, excess: f64| shown(ClockOf::Recording(format!("view1_trial{trial}")), excess, 1e-4);
        // Five sigmas of noise are chance among recordings that scatter by three of it.
        let scattering = [of(1, 3e-4), of(2, -3e-4), of(3, 2.5e-4), of(4, -3.5e-4), of(5, 7e-4)];
        assert_eq!(Clocks::default().after(&scattering), None);
        // Nor is what a quartz may be off by a clock that is misstated.
        let small = [1, 2, 3, 4, 5].map(|trial| of(trial, if trial == 5 { 9e-5 } else { 0.0 }));
        let small =
            small.map(|one| ClockShown { excess: Estimate::new(one.excess.value, 1e-6), gain: 8e3, ..one });
        assert_eq!(Clocks::default().after(&small), None);
        let quiet = [of(1, 0.5e-4), of(2, -0.5e-4), of(3, 1e-4), of(4, -0.2e-4), of(5, 20e-4)];
        let clocks = Clocks::default().after(&quiet).unwrap();
        assert!((clocks.factor(1, "view1_trial5") - 1.002).abs() < 1e-12);
        assert!((clocks.factor(1, "view1_trial4") - 1.0).abs() < 1e-12);
        assert!(!clocks.are_of_views());
    }
}
