//! Pulses followed one by one: the way of each from gap to gap, what it looks like there, and what happens where two meet.
//!
//! A hump of a gap's strain counts where it stands out of the noise, by its height and by its prominence, at a threshold that as many
//! normal numbers as there are samples pass with a stated probability. Humps of neighbouring gaps are joined to ridges, the best first.
//! From ridges come speeds and meetings; what scatters over replicas of the motion is the uncertainty.

mod hump;
mod meeting;
mod path;
mod ridge;

use std::num::NonZero;

use chainwave_measurement::{ChainMotion, ErrorModes, Estimate, median};

pub use self::hump::Sense;
use self::hump::{Hump, SmoothedRows, humps};
use self::meeting::{Meeting, begins_at, meetings, phase_shift, reflected_from, rejoin, within_meetings};
use self::path::{CourseLine, PulsePath, common_speed};
pub use self::ridge::Direction;
use self::ridge::{MIN_GAPS, ridges};
use crate::check::{check_fraction, check_motion};
use crate::replicas::{Replicas, over_replicas};
use crate::spacing::Spacing;
use crate::strain::{strain_map, strain_sigma, strain_with_sigma};
use crate::{AnalysisError, StrainMap};

/// Passages on each side that a local speed is drawn from.
const BESIDE: usize = 2;

/// How many times the variance that noise gives to it, the square of what upper tops change is at least, to be told from that: chance makes more of one in
/// twenty.
const TOLD_BEND: f64 = 4.0;

/// How pulses are found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PulseSettings {
    /// Probability that noise alone makes a hump anywhere in the record. A pulse needs three, one after the other, so false pulses are
    /// rarer by far.
    pub false_rate: f64,
    /// Least prominent hump that counts, as a share of the most prominent one: what hides in the wake of others is left alone.
    pub least_share: f64,
}

impl Default for PulseSettings {
    fn default() -> Self {
        Self { false_rate: crate::SIGNIFICANCE_LEVEL, least_share: 0.05 }
    }
}

impl PulseSettings {
    fn check(&self) -> Result<(), AnalysisError> {
        check_fraction("false_rate", self.false_rate)?;
        check_fraction("least_share", self.least_share)
    }
}

/// The pulses of a record, in the order in which they are first seen, and where they meet.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pulses {
    /// Each pulse.
    pub pulses: Vec<Pulse>,
    /// Each meeting of two, in its order of time.
    pub collisions: Vec<Collision>,
}

/// One pulse.
#[derive(Debug, Clone, PartialEq)]
pub struct Pulse {
    /// Which way it runs.
    pub direction: Direction,
    /// Whether it closes the gaps or opens them.
    pub sense: Sense,
    /// Its passage of each gap in which it was told, in its order.
    pub passes: Vec<Pass>,
    /// Speed in metres of the chain at rest a second, along its way: the slope of the lines through its passages out of other pulses' reach, which
    /// meetings with those move along the way.
    pub speed_m_per_s: Option<Estimate>,
    /// Its strain, compression negative: the median over those passages.
    pub strain: Option<Estimate>,
    /// Its half width at half height in metres of the chain at rest: likewise.
    pub hwhm_m: Option<Estimate>,
    /// Velocity of the bodies as it passes, in metres per second: size of the strain times speed. For a pulse of steady shape that is the mean over the
    /// time from gap to gap.
    pub particle_velocity_m_per_s: Option<Estimate>,
    /// The pulse, by its number from 0, that came back from an end as this one.
    pub reflected_from: Option<usize>,
}

/// A pulse in one gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pass {
    /// Number of the gap, from 1.
    pub gap: usize,
    /// When the strain is greatest, in seconds.
    pub t_s: Estimate,
    /// The strain then, compression negative.
    pub strain: Estimate,
    /// Half width at half height in metres of the chain at rest: half the time above half height, times the speed here.
    pub hwhm_m: Option<Estimate>,
    /// Speed here in metres of the chain at rest a second, along its way, from the two passages on either side.
    pub speed_m_per_s: Option<Estimate>,
    /// Whether another pulse that it meets, or itself on its way back from an end, is so near that the hump is not its own.
    pub collides: bool,
}

/// Two pulses that meet and go on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Collision {
    /// Which, by their numbers from 0. Each goes on with its number.
    pub pulses: [usize; 2],
    /// When they are nearest to each other, in seconds.
    pub t_s: f64,
    /// Where that is, in gaps.
    pub gap: f64,
    /// Whether they run against each other; else one overtakes the other.
    pub is_head_on: bool,
    /// How far each is moved along its own way by the meeting, in gaps: forward above zero. None where it has too few passages before or
    /// behind it.
    pub shifts: [Option<Estimate>; 2],
}

/// Follows the pulses of a strain map. The sigmas of what is found are zero: they need the motion ([`measure_pulses`]).
///
/// # Errors
/// [`AnalysisError`] when a setting is out of range.
pub fn follow_pulses(map: &StrainMap, settings: &PulseSettings) -> Result<Pulses, AnalysisError> {
    settings.check()?;
    let found = PulseStructure::of(map, settings);
    Ok(found.assemble(&found.record(map), &[]))
}

/// Follows the pulses of a motion, with what they scatter over so many of its replicas ([`crate::replicate`]) as uncertainty.
///
/// # Errors
/// [`AnalysisError`] when a setting is out of range or the motion is inconsistent.
pub fn measure_pulses(
    motion: &ChainMotion,
    spacing: impl Into<Spacing>,
    settings: &PulseSettings,
    replicas: Replicas,
    n_threads: NonZero<usize>,
) -> Result<Pulses, AnalysisError> {
    settings.check()?;
    check_motion(motion)?;
    let map = strain_map(motion, spacing)?;
    let found = PulseStructure::of(&map, settings);
    let sigma = strain_sigma(motion, &map.spacing);
    let bare = ChainMotion { modes: ErrorModes::default(), ..motion.clone() };
    let replicas = if found.courses.is_empty() { Replicas { n: 0, ..replicas } } else { replicas };
    let replicas = over_replicas(motion, replicas, n_threads, |displacement_m| {
        let noisy = ChainMotion { displacement_m, ..bare.clone() };
        let noisy = strain_with_sigma(&noisy, &sigma, &map.spacing);
        found.record(&noisy)
    });
    Ok(found.assemble(&found.record(&map), &replicas))
}

/// What a record holds: the structure, which is found once and kept for replicas.
struct PulseStructure {
    courses: Vec<PulsePath>,
    meetings: Vec<Meeting>,
    /// Whether each passage lies within a meeting.
    is_within: Vec<Vec<bool>>,
    reflected_from: Vec<Option<usize>>,
}

/// What a map of the strain says of the structure.
struct Record {
    values: RecordValues,
    /// The same by tops of humps half as far down.
    by_upper: RecordValues,
}

/// Numbers of each pulse, and of each meeting.
struct RecordValues {
    pulses: Vec<PulseValues>,
    shifts: Vec<[Option<f64>; 2]>,
}

struct PulseValues {
    passes: Vec<PassValues>,
    speed_m_per_s: Option<f64>,
    strain: Option<f64>,
    hwhm_m: Option<f64>,
}

struct PassValues {
    /// Whether its hump is there.
    is_found: bool,
    t_s: f64,
    strain: f64,
    speed_m_per_s: Option<f64>,
    hwhm_m: Option<f64>,
}

impl PulseStructure {
    fn of(map: &StrainMap, settings: &PulseSettings) -> Self {
        let humps = humps(map, settings.false_rate, settings.least_share);
        let mut courses: Vec<PulsePath> =
            ridges(&humps).iter().map(|ridge| PulsePath::of(ridge, &humps)).collect();
        rejoin(&mut courses);
        let meetings = meetings(&mut courses);
        let of_all = 0..courses.len();
        let reflected_from: Vec<Option<usize>> =
            of_all.clone().map(|pulse| reflected_from(&courses, map.n_gaps(), pulse)).collect();
        let turned_at = |pulse: usize| {
            let came = reflected_from[pulse].map(|_| courses[pulse].direction);
            let goes = || (0..courses.len()).find(|other| reflected_from[*other] == Some(pulse));
            let direction = came.or_else(|| goes().map(|other| courses[other].direction));
            direction.map(|direction| begins_at(direction, map.n_gaps()))
        };
        let within = |pulse: usize| within_meetings(&courses, &meetings, turned_at(pulse), pulse);
        Self { is_within: of_all.map(within).collect(), reflected_from, courses, meetings }
    }

    /// The same passages in a map; a hump that is lost there stays as it was, and says nothing.
    fn record(&self, map: &StrainMap) -> Record {
        let mut rows = SmoothedRows::of_map(map);
        let values = |pass_again: &mut dyn FnMut(&Hump) -> Hump| {
            let again = |course: &PulsePath| PulsePath {
                passes: course.passes.iter().map(&mut *pass_again).collect(),
                ..course.clone()
            };
            let courses: Vec<PulsePath> = self.courses.iter().map(again).collect();
            self.values(&courses, &map.spacing)
        };
        let again = |pass: &Hump, rows: &mut SmoothedRows<'_>| pass.again(rows).unwrap_or(pass.lost());
        Record {
            values: values(&mut |pass| again(pass, &mut rows)),
            by_upper: values(&mut |pass| pass.upper(&mut rows).unwrap_or_else(|| again(pass, &mut rows))),
        }
    }

    fn values(&self, courses: &[PulsePath], spacing: &Spacing) -> RecordValues {
        let of_pulse =
            |pulse: usize| pulse_values(&courses[pulse], &self.is_within[pulse], &self.met_s(pulse), spacing);
        let shifts = self.meetings.iter().map(|meeting| {
            meeting.pulses.map(|pulse| {
                phase_shift(&courses[pulse], &self.is_within[pulse], meeting, &self.met_s(pulse))
            })
        });
        RecordValues { pulses: (0..courses.len()).map(of_pulse).collect(), shifts: shifts.collect() }
    }

    /// When a pulse meets others, in time.
    fn met_s(&self, pulse: usize) -> Vec<f64> {
        let own = self.meetings.iter().filter(|meeting| meeting.pulses.contains(&pulse));
        let mut met_s: Vec<f64> = own.map(|meeting| meeting.t_s).collect();
        met_s.sort_by(f64::total_cmp);
        met_s
    }

    fn assemble(&self, record: &Record, replicas: &[Record]) -> Pulses {
        let pulse = |(index, course): (usize, &PulsePath)| {
            let estimate = |value: fn(&PulseValues) -> Option<f64>| {
                estimate(record, replicas, |values| value(&values.pulses[index]))
            };
            Pulse {
                direction: course.direction,
                sense: course.passes[0].sense,
                passes: (0..course.passes.len())
                    .map(|place| self.pass(record, replicas, index, place))
                    .collect(),
                speed_m_per_s: estimate(|pulse| pulse.speed_m_per_s),
                strain: estimate(|pulse| pulse.strain),
                hwhm_m: estimate(|pulse| pulse.hwhm_m),
                particle_velocity_m_per_s: estimate(|pulse| Some(pulse.strain?.abs() * pulse.speed_m_per_s?)),
                reflected_from: self.reflected_from[index],
            }
        };
        let collision = |(index, meeting): (usize, &Meeting)| Collision {
            pulses: meeting.pulses,
            t_s: meeting.t_s,
            gap: meeting.place,
            is_head_on: meeting.is_head_on,
            shifts: [0, 1].map(|side| estimate(record, replicas, |values| values.shifts[index][side])),
        };
        Pulses {
            pulses: self.courses.iter().enumerate().map(pulse).collect(),
            collisions: self.meetings.iter().enumerate().map(collision).collect(),
        }
    }

    fn pass(&self, record: &Record, replicas: &[Record], pulse: usize, place: usize) -> Pass {
        let perhaps = |value: &dyn Fn(&PassValues) -> Option<f64>| {
            estimate(record, replicas, |values| value(&values.pulses[pulse].passes[place]))
        };
        let surely = |value: fn(&PassValues) -> f64| {
            // Where most replicas lose the hump, nothing tells how far it may lie off.
            let unclear = Estimate::new(value(&record.values.pulses[pulse].passes[place]), f64::INFINITY);
            perhaps(&|pass| pass.is_found.then(|| value(pass))).unwrap_or(unclear)
        };
        Pass {
            gap: self.courses[pulse].passes[place].gap,
            t_s: surely(|pass| pass.t_s),
            strain: surely(|pass| pass.strain),
            hwhm_m: perhaps(&|pass| pass.hwhm_m),
            speed_m_per_s: perhaps(&|pass| pass.speed_m_per_s),
            collides: self.is_within[pulse][place],
        }
    }
}

/// A value with its scatter over replicas; none where most replicas lost it. Where upper tops change it by more than noise does, it is theirs, and may
/// change by half as much again.
fn estimate(
    record: &Record,
    replicas: &[Record],
    value: impl Fn(&RecordValues) -> Option<f64>,
) -> Option<Estimate> {
    let by_all = |record: &Record| value(&record.values);
    let by_upper = |record: &Record| value(&record.by_upper);
    let own = by_all(record)?;
    if replicas.is_empty() {
        return Some(Estimate::new(own, 0.0));
    }
    let bend = |record: &Record| Some(by_upper(record)? - by_all(record)?);
    let bent = bend(record).filter(|bent| bent.powi(2) > TOLD_BEND * variance(&over(replicas, bend)));
    let (own, found) = match bent {
        Some(bent) => (own + bent, over(replicas, by_upper)),
        None => (own, over(replicas, by_all)),
    };
    let is_told = 2 * found.len() > replicas.len() && found.len() > 1;
    is_told.then(|| Estimate::new(own, variance(&found).sqrt().hypot(0.5 * bent.unwrap_or(0.0))))
}

/// What those replicas say that say it.
fn over(replicas: &[Record], value: impl Fn(&Record) -> Option<f64>) -> Vec<f64> {
    replicas.iter().filter_map(value).collect()
}

/// The variance of values about their mean.
fn variance(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0)
}

fn pulse_values(course: &PulsePath, is_within: &[bool], met_s: &[f64], spacing: &Spacing) -> PulseValues {
    let point = |place: usize| {
        let pass = &course.passes[place];
        (pass.t_s, spacing.place_m(pass.gap as f64))
    };
    let is_found = |place: &usize| course.passes[*place].is_found;
    let along = course.direction.sign();
    let speed_at = |place: usize| {
        let beside = place.saturating_sub(BESIDE)..=(place + BESIDE).min(course.passes.len() - 1);
        let points: Vec<(f64, f64)> = beside.filter(is_found).map(point).collect();
        Some(along * CourseLine::through(&points, MIN_GAPS)?.speed()).filter(|speed| *speed > 0.0)
    };
    let of_pass = |place: usize| {
        let pass = &course.passes[place];
        let speed_m_per_s = speed_at(place).filter(|_| pass.is_found);
        PassValues {
            is_found: pass.is_found,
            t_s: pass.t_s,
            strain: pass.sense.sign() * pass.size,
            speed_m_per_s,
            hwhm_m: pass.half_width_s.zip(speed_m_per_s).map(|(half_s, speed)| half_s * speed),
        }
    };
    let passes: Vec<PassValues> = (0..course.passes.len()).map(of_pass).collect();
    let free: Vec<usize> = (0..passes.len()).filter(|place| !is_within[*place]).filter(is_found).collect();
    let n_met = |place: usize| met_s.partition_point(|met_s| *met_s < course.passes[place].t_s);
    let of_stretch = |before: usize| free.iter().filter(move |place| n_met(**place) == before);
    let stretches: Vec<Vec<(f64, f64)>> =
        (0..=met_s.len()).map(|n| of_stretch(n).map(|place| point(*place)).collect()).collect();
    let speed_m_per_s = common_speed(&stretches, MIN_GAPS).map(|speed| along * speed);
    PulseValues {
        speed_m_per_s,
        strain: median(free.iter().map(|place| passes[*place].strain).collect()),
        hwhm_m: median(free.iter().filter_map(|place| passes[*place].hwhm_m).collect()),
        passes,
    }
}

/// The exponent of a power law through points of two quantities above zero, such as the speed of pulses over the velocity of the bodies:
/// the slope of a straight line through their logarithms by least squares, weighted by the relative sigmas of the second where all are known,
/// with the sigma that those give, or the distances from the line where these are larger or the sigmas are unknown: points that follow no power law are not
/// known better for being measured well. None for fewer than three points, or where the first does not change.
pub fn power_exponent(points: &[(f64, Estimate)]) -> Option<Estimate> {
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.value.ln())).collect();
    let is_known = points.iter().all(|(_, y)| y.sigma > 0.0);
    let weight =
        |index: usize| if is_known { (points[index].1.value / points[index].1.sigma).powi(2) } else { 1.0 };
    let total: f64 = (0..logs.len()).map(weight).sum();
    let mean = |value: fn(&(f64, f64)) -> f64| {
        logs.iter().enumerate().map(|(index, log)| weight(index) * value(log)).sum::<f64>() / total
    };
    let (x, y) = (mean(|log| log.0), mean(|log| log.1));
    let square: f64 = logs.iter().enumerate().map(|(i, log)| weight(i) * (log.0 - x).powi(2)).sum();
    let product: f64 = logs.iter().enumerate().map(|(i, log)| weight(i) * (log.0 - x) * (log.1 - y)).sum();
    let slope = product / square;
    let squares =
        logs.iter().enumerate().map(|(i, log)| weight(i) * (log.1 - y - slope * (log.0 - x)).powi(2));
    let scatter = squares.sum::<f64>() / (logs.len() as f64 - 2.0);
    let sigma = (if is_known { scatter.max(1.0) } else { scatter } / square).sqrt();
    (logs.len() >= 3 && slope.is_finite() && sigma.is_finite()).then(|| Estimate::new(slope, sigma))
}
