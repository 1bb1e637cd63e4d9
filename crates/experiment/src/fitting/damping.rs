//! The damping that stands for the experiment: of three fits the one that holds and says most, or the reason why none does.

use chainwave_analysis::{Rule, SIGNIFICANCE_LEVEL};
use chainwave_inference::{
    Damping, EnergyFit, FitError, Hypothesis, ImposedFit, ReleasedFit, TrackFit, refusal,
};
use chainwave_measurement::Estimate;

use crate::fitting::drive_off::DriveOff;
use crate::wording::probability;

/// The damping that stands for the experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct StatedDamping {
    /// c_d in kilograms per second, or why there is none.
    pub chain_damping_kg_per_s: Result<Estimate, String>,
    /// c_s in kilograms per second, or why there is none.
    pub striker_damping_kg_per_s: Result<Estimate, String>,
    /// Correlation of their errors, where both are there.
    pub correlation: Option<f64>,
    /// The fit that they are taken from; `None` where every fit was refused.
    pub source: Option<&'static str>,
    /// Critical damping of the first body on the first contact, in kilograms per second: a damping whose sigma is larger is not told.
    pub critical_kg_per_s: f64,
    /// Fits that were refused, each with its reason.
    pub refused: Vec<(&'static str, String)>,
    /// What the reader should know of the choice.
    pub warnings: Vec<String>,
}

/// The fit to the tracks of all recordings.
pub const TRACKS: &str = "tracks";
/// The fit to the motion behind body 1, which drives the chain as it was measured.
pub const BEHIND_BODY_1: &str = "behind body 1";
/// The motion of a chain that is let go.
pub const RELEASE: &str = "motion since the release";
/// The fit to the peak potential energies.
pub const PEAK_ENERGIES: &str = "peak energies";
/// What the reason begins with where a whole fit is refused for its c_d.
pub const ITS_C_D: &str = "its c_d is ";

/// Two fits to the same tracks contradict each other where their c_d differ by more than this many standard uncertainties: one sound
/// experiment in 2000.
const CONTRADICTION: f64 = 3.5;
/// Reduced chi squared up to which the fit behind body 1 holds. Its samples share the errors of the merged motion, and are smoother than
/// their noise, so that no exact level can be given; a friction, a stiffness or a scale that is off by what the tracks just tell
/// leaves 3.7 and more.
const LARGEST_BEHIND_BODY_1: f64 = 1.5;

impl StatedDamping {
    /// Of the fits to an experiment, whose tracks may contradict the stated drive; `critical_kg_per_s` is critical damping, beyond which a damping is
    /// not told.
    pub(crate) fn of(
        tracks: &Result<TrackFit, FitError>,
        behind_body_1: &Result<ImposedFit, FitError>,
        energies: &Result<EnergyFit, FitError>,
        drive_off: Option<&DriveOff>,
        critical_kg_per_s: f64,
    ) -> Self {
        if let Err(why @ FitError::NotAsked) = tracks {
            return Self::not_asked(&why.to_string(), critical_kg_per_s);
        }
        let reasons = reasons(tracks, behind_body_1, energies, drive_off, critical_kg_per_s);
        let [holds_tracks, holds_behind, holds_energies] = reasons.each_ref().map(|(_, why)| why.is_none());
        let mut refused: Vec<(&'static str, String)> =
            reasons.into_iter().filter_map(|(source, why)| Some((source, why?))).collect();
        let tracks_as_fitted = tracks;
        let tracks = tracks.as_ref().ok().filter(|_| holds_tracks);
        let behind = behind_body_1.as_ref().ok().filter(|_| holds_behind);
        let energies = energies.as_ref().ok().filter(|_| holds_energies);
        let mut warnings = Vec::new();
        let by_tracks = tracks.map(|fit| fit.damping.chain_damping_kg_per_s);
        let contradiction = by_tracks
            .zip(behind)
            .and_then(|(c_d, fit)| contradiction((TRACKS, c_d), (BEHIND_BODY_1, fit.chain_damping_kg_per_s)));
        let tracks = tracks.filter(|_| contradiction.is_none());
        if let (Some(fit), Some(energies)) = (tracks, energies) {
            let (c_d, of_energies) =
                (fit.damping.chain_damping_kg_per_s, energies.damping.chain_damping_kg_per_s);
            let said = contradiction_of_energies(c_d, of_energies);
            warnings.extend(said);
        }
        let mut stated = match (tracks, behind, energies) {
            (Some(fit), ..) => Self::of_both(TRACKS, fit.damping, critical_kg_per_s),
            (None, Some(fit), _) => {
                let no_striker = no_striker(tracks_as_fitted);
                if no_striker.is_none() {
                    warnings.push(contradiction.clone().unwrap_or_else(|| {
                        format!("c_d is taken from the motion {BEHIND_BODY_1}, which needs no striker: the fit to the tracks is refused")
                    }));
                }
                Self::of_chain_alone(fit, no_striker, critical_kg_per_s)
            }
            (None, None, Some(fit)) => {
                warnings.push(format!(
                    "c_d and c_s are taken from the {PEAK_ENERGIES}, a few numbers that feel less of what the model leaves out: the fits to \
                     the tracks and {BEHIND_BODY_1} are refused"
                ));
                Self::of_both(PEAK_ENERGIES, fit.damping, critical_kg_per_s)
            }
            (None, None, None) => Self::of_nothing(&refused, critical_kg_per_s),
        };
        if let Some(reason) = contradiction {
            refused.insert(0, (TRACKS, reason));
        }
        (stated.refused, stated.warnings) = (refused, warnings);
        stated
    }

    /// No damping, as nobody asks for one.
    fn not_asked(reason: &str, critical_kg_per_s: f64) -> Self {
        let refused = [TRACKS, BEHIND_BODY_1, PEAK_ENERGIES].map(|source| (source, reason.to_owned()));
        Self {
            chain_damping_kg_per_s: Err(reason.to_owned()),
            striker_damping_kg_per_s: Err(reason.to_owned()),
            correlation: None,
            source: None,
            critical_kg_per_s,
            refused: refused.into(),
            warnings: Vec::new(),
        }
    }

    /// Of the fits to a chain that is let go: to its tracks, and to its motion where the tracks have none.
    pub(crate) fn of_release(
        tracks: &Result<TrackFit, FitError>,
        motion: &Result<ReleasedFit, FitError>,
        critical_kg_per_s: f64,
    ) -> Self {
        let of_c_d = |c_d: Estimate| refusal_by_c_d(c_d, critical_kg_per_s);
        let of_tracks =
            |fit: &TrackFit| unexplained(fit).or_else(|| of_c_d(fit.damping.chain_damping_kg_per_s));
        let of_motion = |fit: &ReleasedFit| {
            let by_tracks = tracks.as_ref().ok().and_then(unexplained);
            by_tracks
                .or_else(|| rejected_model(tracks, false))
                .or_else(|| misfit(fit.reduced_chi_squared, LARGEST_BEHIND_BODY_1))
                .or_else(|| of_c_d(fit.chain_damping_kg_per_s))
        };
        let reasons = [(TRACKS, reason(tracks, of_tracks)), (RELEASE, reason(motion, of_motion))];
        let found = [
            tracks.as_ref().ok().map(|fit| fit.damping.chain_damping_kg_per_s),
            motion.as_ref().ok().map(|fit| fit.chain_damping_kg_per_s),
        ];
        let held = reasons.iter().zip(found).find(|((_, why), _)| why.is_none());
        let told = held.and_then(|((source, _), c_d)| Some((*source, c_d?)));
        let refused: Vec<(&'static str, String)> =
            reasons.iter().filter_map(|(source, why)| Some((*source, why.clone()?))).collect();
        Self {
            chain_damping_kg_per_s: told.map(|(_, c_d)| c_d).ok_or_else(|| no_fit_holds(&refused)),
            striker_damping_kg_per_s: Err(ReleasedFit::NO_STRIKER_DAMPING.into()),
            correlation: None,
            source: told.map(|(source, _)| source),
            critical_kg_per_s,
            refused,
            warnings: Vec::new(),
        }
    }

    /// Both dampings of a fit, each unless it is not told.
    fn of_both(source: &'static str, damping: Damping, critical_kg_per_s: f64) -> Self {
        let told = |found: Estimate| refusal(found, critical_kg_per_s).map_or(Ok(found), Err);
        Self {
            chain_damping_kg_per_s: told(damping.chain_damping_kg_per_s),
            striker_damping_kg_per_s: told(damping.striker_damping_kg_per_s),
            correlation: Some(damping.correlation),
            source: Some(source),
            critical_kg_per_s,
            refused: Vec::new(),
            warnings: Vec::new(),
        }
    }

    /// The chain's damping by the fit behind body 1, which does not know the striker's.
    fn of_chain_alone(fit: &ImposedFit, no_striker: Option<String>, critical_kg_per_s: f64) -> Self {
        Self {
            chain_damping_kg_per_s: Ok(fit.chain_damping_kg_per_s),
            striker_damping_kg_per_s: Err(no_striker.unwrap_or_else(|| {
                format!(
                    "the fit to the tracks is refused, and {BEHIND_BODY_1} it is {}",
                    ImposedFit::NO_STRIKER_DAMPING
                )
            })),
            correlation: None,
            source: Some(BEHIND_BODY_1),
            critical_kg_per_s,
            refused: Vec::new(),
            warnings: Vec::new(),
        }
    }

    /// No damping, as every fit was refused.
    fn of_nothing(refused: &[(&'static str, String)], critical_kg_per_s: f64) -> Self {
        let reason = no_fit_holds(refused);
        Self {
            chain_damping_kg_per_s: Err(reason.clone()),
            striker_damping_kg_per_s: Err(reason),
            correlation: None,
            source: None,
            critical_kg_per_s,
            refused: Vec::new(),
            warnings: Vec::new(),
        }
    }

    /// Why a fit was refused, where it was.
    pub fn reason(&self, source: &str) -> Option<&str> {
        self.refused.iter().find(|(name, _)| *name == source).map(|(_, reason)| reason.as_str())
    }

    /// Every result that was refused, by its name: what a run's note says.
    pub fn refusals(&self) -> Vec<(&'static str, &str)> {
        [("c_d", &self.chain_damping_kg_per_s), ("c_s", &self.striker_damping_kg_per_s)]
            .into_iter()
            .filter_map(|(name, found)| Some((name, found.as_ref().err()?.as_str())))
            .collect()
    }

    /// The rule by which the source is chosen.
    pub fn rule() -> Rule {
        Rule {
            question: "what the damping is taken from",
            text: format!(
                "the tracks, while the chain model (with what they ask for beyond the stated one) leaves noise alone, or so little more that \
                 c_d is told from zero with all that this may do to it; else the motion {BEHIND_BODY_1} (reduced chi squared up to \
                 {LARGEST_BEHIND_BODY_1}), which needs no striker and stands as well where the two contradict by {CONTRADICTION} sigma; else \
                 the peak energies, unless they leave more than chance does ({} % level); else nothing. Of a chain that is let go the tracks; else, where they \
                 tell nothing of the model, the {RELEASE} (up to {LARGEST_BEHIND_BODY_1})",
                100.0 * SIGNIFICANCE_LEVEL
            ),
            level: None,
            rates: Vec::new(),
        }
    }
}

/// Why there is no damping, where every fit was refused.
fn no_fit_holds(refused: &[(&'static str, String)]) -> String {
    let reasons: Vec<String> = refused.iter().map(|(source, reason)| format!("{source}: {reason}")).collect();
    format!("no fit holds ({})", reasons.join("; "))
}

/// Why there is no c_s, where no striker drives the chain.
fn no_striker(tracks: &Result<TrackFit, FitError>) -> Option<String> {
    match tracks {
        Err(FitError::DrivenOtherwise { found }) => Some(format!(
            "there is none: it is the damping of a striker's contact, and {found} drives the chain"
        )),
        _ => None,
    }
}

/// Why each of the three fits is refused, where it is.
fn reasons(
    tracks: &Result<TrackFit, FitError>,
    behind_body_1: &Result<ImposedFit, FitError>,
    energies: &Result<EnergyFit, FitError>,
    drive_off: Option<&DriveOff>,
    critical_kg_per_s: f64,
) -> [(&'static str, Option<String>); 3] {
    let of_behind = |fit: &ImposedFit| {
        rejected_model(tracks, false)
            .or_else(|| misfit(fit.reduced_chi_squared, LARGEST_BEHIND_BODY_1))
            .or_else(|| refusal_by_c_d(fit.chain_damping_kg_per_s, critical_kg_per_s))
    };
    let of_energies = |fit: &EnergyFit| {
        rejected_model(tracks, true)
            .or_else(|| drive_off.map(DriveOff::refusal))
            .or_else(|| unlikely(fit.reduced_chi_squared, fit.p_value))
            .or_else(|| refusal_by_c_d(fit.damping.chain_damping_kg_per_s, critical_kg_per_s))
    };
    [
        (TRACKS, reason(tracks, unexplained)),
        (BEHIND_BODY_1, reason(behind_body_1, of_behind)),
        (PEAK_ENERGIES, reason(energies, of_energies)),
    ]
}

/// Why a fit is refused: it failed, or what is asked of it.
fn reason<F>(fit: &Result<F, FitError>, asked: impl Fn(&F) -> Option<String>) -> Option<String> {
    match fit {
        Ok(fit) => asked(fit),
        Err(why) => Some(why.to_string()),
    }
}

/// Why a whole fit is refused where its c_d is none: what else it found is refused for that, and not for what it is itself.
fn refusal_by_c_d(c_d: Estimate, critical_kg_per_s: f64) -> Option<String> {
    refusal(c_d, critical_kg_per_s).map(|why| format!("{ITS_C_D}{why}"))
}

/// Why a fit that assumes the model as stated does not hold, where the tracks ask for another; one that needs no striker does not mind what
/// they ask of the striker's contact.
fn rejected_model(tracks: &Result<TrackFit, FitError>, needs_striker: bool) -> Option<String> {
    let fit = tracks.as_ref().ok()?;
    let is_felt = |one: &&Hypothesis| needs_striker || **one != Hypothesis::StrikerContact;
    let felt: Vec<&str> = fit.beyond.iter().filter(is_felt).map(|one| one.in_words()).collect();
    (!felt.is_empty()).then(|| {
        format!("it assumes the chain model as stated, and the tracks move as if {}", felt.join(", and "))
    })
}

/// Why the fit to the tracks is not to be believed, where it is not.
fn unexplained(fit: &TrackFit) -> Option<String> {
    (!fit.is_believed()).then(|| {
        format!(
            "the chain model does not explain the tracks: reduced chi squared {:.3}, {}; what it misses could make all of c_d",
            fit.reduced_chi_squared,
            fit.structure.in_words()
        )
    })
}

fn misfit(reduced_chi_squared: f64, largest: f64) -> Option<String> {
    let holds = reduced_chi_squared <= largest;
    (!holds).then(|| format!("reduced chi squared {reduced_chi_squared:.2}, expected at most {largest}"))
}

/// Why the fit to the peak energies does not hold, where chance hardly leaves so much: they are so few that no one bound of reduced chi squared
/// is as likely for all numbers of gaps.
fn unlikely(reduced_chi_squared: f64, p_value: f64) -> Option<String> {
    (p_value < SIGNIFICANCE_LEVEL).then(|| {
        format!(
            "the chain model does not explain the peak energies: reduced chi squared {reduced_chi_squared:.3}, expected about 1; with a model \
             that is right chance leaves as much or more with {}, and a fit is refused where p < {SIGNIFICANCE_LEVEL}",
            probability(p_value)
        )
    })
}

/// What is said of two fits whose c_d differ by more than their uncertainties explain.
fn contradiction(
    (source, c_d): (&'static str, Estimate),
    (other, of_other): (&'static str, Estimate),
) -> Option<String> {
    let off = (c_d.value - of_other.value).abs() / c_d.sigma.hypot(of_other.sigma);
    (off > CONTRADICTION).then(|| {
        format!(
            "the {source} say c_d = {:.3e} +- {:.1e} kg/s, the motion {other} {:.3e} +- {:.1e}, {off:.1} sigma apart: the latter stands, as it \
             needs neither striker nor its contact; look at striker.mass_kg and at the striker's contact",
            c_d.value, c_d.sigma, of_other.value, of_other.sigma
        )
    })
}

/// What is said where the peak energies contradict the tracks, which stand: energies have a law more to assume, and a merged motion.
fn contradiction_of_energies(c_d: Estimate, of_energies: Estimate) -> Option<String> {
    let off = (c_d.value - of_energies.value).abs() / c_d.sigma.hypot(of_energies.sigma);
    (off > CONTRADICTION).then(|| {
        format!(
            "the peak energies say c_d = {:.3e} +- {:.1e} kg/s, {off:.1} sigma from the tracks, which stand: energies assume the law, the scale \
             and a merged motion beside",
            of_energies.value, of_energies.sigma
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_tells_the_sum_of_squares_from_its_probability() {
        let said = unlikely(439_456.01, 0.0).unwrap();
        assert!(said.contains("reduced chi squared 439456.010, expected about 1;"), "{said}");
        assert!(said.contains("with p < 1e-300, and a fit is refused where p < 0.01"), "{said}");
        assert!(unlikely(1.1, 0.3).is_none());
    }
}
