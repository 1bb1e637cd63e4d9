//! Which readings of the tracks deserve a look, the most doubtful first.
//!
//! Four questions are asked of a reading, each answered in standard deviations of what the like of it show, so that no scale has to be
//! stated: does it stand where the same body stands in the other trials (`others`), where its own neighbours in time have it (`spikes`), does
//! the subset resemble its reference as well as in the other trials at that time, and is its uncertainty as small (`quality`)? The like of it
//! are the readings of the same body in all trials of the view, within some frames: there the wave does the same to all. Medians judge, so
//! that what is wrong in fewer than half of them does not set the scale. The answers add up as independent ones do, by their squares.
//!
//! A reading that was lost in view has no place that could be wrong; it stands between what is surely wrong and what may be.

mod blocks;
mod others;
mod quality;
mod reviewed;
mod series;
mod spikes;
mod trial;

use chainwave_measurement::Lost;

pub use self::reviewed::ReviewedRecording;
use self::series::Series;
pub(crate) use self::trial::TrialBesideOthers;

/// Why a reading is doubtful.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Doubt {
    /// The other trials have the body elsewhere.
    OtherTrials,
    /// The readings before and after have it elsewhere.
    Neighbours,
    /// It resembles the reference less than elsewhere.
    Residual,
    /// It is less certain than elsewhere.
    Sigma,
}

impl Doubt {
    /// Its name in tables.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::OtherTrials => "other_trials",
            Self::Neighbours => "neighbours",
            Self::Residual => "residual",
            Self::Sigma => "sigma",
        }
    }
}

/// A reading in the queue.
#[derive(Debug, Clone, PartialEq)]
pub struct DoubtfulReading {
    /// Its recording's place in the list that was asked about.
    pub recording: usize,
    /// Number of the body, from 1.
    pub body: usize,
    /// Number of the frame, from 0.
    pub frame: usize,
    /// How doubtful, in standard deviations of its like.
    pub doubt: f64,
    /// What that consists of, each in standard deviations; what could not be asked is left out.
    pub of_each: Vec<(Doubt, f64)>,
    /// Why there is no reading, where there is none.
    pub lost: Option<Lost>,
    /// First and last frame of the doubtful ones around it, without a break.
    pub stretch: [usize; 2],
}

/// From how many standard deviations on a reading counts as doubtful: one sound one in 10^6 is, if readings err by a normal law and four
/// questions are asked (chi squared of four degrees of freedom above 36 has probability 3e-7).
const DOUBTFUL: f64 = 6.0;
/// Where a reading that was lost in view stands: behind what no chance explains, before what one sound reading in 10^6 shows.
const LOST_IN_VIEW: f64 = 8.0;

/// All readings of some recordings, the most doubtful first; those that left the view, or were taken out, are none. Where two are equally
/// doubtful, the earlier recording, body and frame comes first.
///
/// The recordings are those that can be compared: one striker velocity.
pub fn review_queue(recordings: &[ReviewedRecording<'_>]) -> Vec<DoubtfulReading> {
    let series: Vec<Series<'_>> =
        recordings.iter().enumerate().flat_map(|(index, one)| Series::all_of(index, one)).collect();
    let mut queue = Vec::new();
    for group in groups(&series) {
        let answers = [
            (Doubt::OtherTrials, others::departures(&group)),
            (Doubt::Neighbours, spikes::departures(&group)),
            (Doubt::Residual, quality::departures(&group, quality::dissimilarity)),
            (Doubt::Sigma, quality::departures(&group, quality::uncertainty)),
        ];
        for (member, series) in group.iter().enumerate() {
            queue.extend(of_series(series, |frame| {
                let of_each = answers.iter().filter_map(|(doubt, all)| Some((*doubt, all[member][frame]?)));
                of_each.collect()
            }));
        }
    }
    queue.sort_by(|a, b| {
        let place = |one: &DoubtfulReading| (one.recording, one.body, one.frame);
        b.doubt.total_cmp(&a.doubt).then_with(|| place(a).cmp(&place(b)))
    });
    queue
}

/// Readings of one body that can be compared: those of all recordings of a view.
fn groups<'a>(series: &'a [Series<'a>]) -> Vec<Vec<&'a Series<'a>>> {
    let mut groups: Vec<Vec<&Series<'_>>> = Vec::new();
    for one in series {
        let is_like = |group: &&mut Vec<&Series<'_>>| {
            group.first().is_some_and(|first| (first.view, first.body) == (one.view, one.body))
        };
        match groups.iter_mut().find(is_like) {
            Some(group) => group.push(one),
            None => groups.push(vec![one]),
        }
    }
    groups
}

/// The readings of one body in one recording, with what is doubtful around each.
fn of_series<'a>(
    series: &'a Series<'_>,
    of_each: impl Fn(usize) -> Vec<(Doubt, f64)> + 'a,
) -> Vec<DoubtfulReading> {
    let reading = |frame: usize| {
        let lost = series.positions[frame].as_ref().err().copied();
        let of_each = of_each(frame);
        let doubt = match lost {
            None => of_each.iter().map(|(_, doubt)| doubt.powi(2)).sum::<f64>().sqrt(),
            Some(Lost::OutOfView | Lost::Excluded) => return None,
            Some(_) => LOST_IN_VIEW,
        };
        let (recording, body, stretch) = (series.recording, series.body, [frame; 2]);
        Some(DoubtfulReading { recording, body, frame, doubt, of_each, lost, stretch })
    };
    let mut readings: Vec<DoubtfulReading> = (0..series.n_frames()).filter_map(reading).collect();
    for stretch in
        readings.chunk_by_mut(|a, b| a.frame + 1 == b.frame && (a.doubt >= DOUBTFUL) == (b.doubt >= DOUBTFUL))
    {
        let (Some(first), Some(last)) = (stretch.first(), stretch.last()) else { continue };
        let frames = [first.frame, last.frame];
        stretch.iter_mut().filter(|one| one.doubt >= DOUBTFUL).for_each(|one| one.stretch = frames);
    }
    readings
}
