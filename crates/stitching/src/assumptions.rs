//! What merging takes to be so where the recordings do not tell it: each number, what it decides, and where it comes from.

use crate::assembly::BENT_SHARE;
use crate::gauge::{DEPARTURE, DEPARTURE_OF_SCALE, ONSET_SHARE};
use crate::settings::{FirstBody, Settings};

/// A number that is taken to be so where the recordings do not tell it.
#[derive(Debug, Clone, PartialEq)]
pub struct Assumption {
    /// What is assumed.
    pub of: &'static str,
    /// How much.
    pub value: f64,
    /// In words.
    pub in_words: String,
    /// What it decides.
    pub decides: &'static str,
    /// Where the number comes from.
    pub reason: &'static str,
}

/// On which chain the responses to the drive were looked at.
const SOLVED: &str = "chain model of 12 and 26 hollow elliptical cylinders, strikes of 0.83 to 2.73 m/s";

impl Settings {
    /// What is assumed of drives and of how bodies respond to them, of whatever chain.
    pub fn assumptions(&self) -> Vec<Assumption> {
        let share = |value: f64, of: &str| format!("{} % of {of}", 100.0 * value);
        let motion = "a body's rms motion";
        let mut all = vec![
            Assumption {
                of: "assumed: how far drives differ from trial to trial",
                value: self.drive_prior,
                in_words: share(self.drive_prior, "their mean (standard deviation)"),
                decides: "drives where the bodies that recordings share tell none",
                reason: "repeated strikes of a laboratory differ by less",
            },
            Assumption {
                of: "assumed: how far a response departs from scaling with the drive",
                value: self.slope_prior,
                in_words: share(self.slope_prior, motion),
                decides: "the response where trials' drives are too alike to tell it; what it leaves open is an error mode of the motion",
                reason: "0.01 to 0.45, and some tenths for the drives' scale, which is found within that (see below)",
            },
            Assumption {
                of: "assumed: how far a response curves with the drive",
                value: self.curvature_prior,
                in_words: share(self.curvature_prior, motion),
                decides: "the curvature where four trials or more do not tell it; of fewer it is none",
                reason: "up to 0.45",
            },
            Assumption {
                of: "assumed: how far a curvature differs from a weak non-linearity's",
                value: self.non_linearity,
                in_words: share(self.non_linearity, motion),
                decides: "the error mode of the responses of bodies that the same recordings saw",
                reason: "0.001 to 0.13, one sign over a whole pulse",
            },
            Assumption {
                of: "assumed: how large responses of third order are",
                value: self.third_order_prior,
                in_words: share(self.third_order_prior, motion),
                decides: "the error that a response of second order leaves in the motion",
                reason: "up to 0.35 in the last bodies",
            },
            Assumption {
                of: "assumed: how the delay with the square of the drive stands to that with the drive",
                value: BENT_SHARE,
                in_words: share(BENT_SHARE, "it (standard deviation)"),
                decides: "the part of each trigger offset's uncertainty that grows with the square of its drive",
                reason: "0.02 to 0.09 in all bodies, and 0.5 where the delay goes with the drive's logarithm",
            },
        ];
        if self.first_body == FirstBody::Free {
            all.extend(of_onset());
        }
        all
    }

    /// On which chain the numbers of [`Settings::assumptions`] were looked at.
    pub fn assumed_from() -> &'static str {
        SOLVED
    }
}

/// What is assumed of the onset of a body that forces move.
fn of_onset() -> [Assumption; 3] {
    let share = |value: f64, of: &str| format!("{} % of {of}", 100.0 * value);
    [
        Assumption {
            of: "assumed: how long body 1 moves in proportion to the drive",
            value: ONSET_SHARE,
            in_words: format!("until it has gone {}", share(ONSET_SHARE, "its way")),
            decides: "from which frames the drives' scale and the delay by the drive are read",
            reason: "a shorter onset tells them worse, a longer one departs farther",
        },
        Assumption {
            of: "assumed: how far the onset departs from proportion, as a delay",
            value: DEPARTURE,
            in_words: share(DEPARTURE, "the onset's length (standard deviation)"),
            decides: "the uncertainty of the delay by the drive, an error mode of the motion and part of each trigger offset's",
            reason: "9 us of 0.7 ms at 2.73 m/s",
        },
        Assumption {
            of: "assumed: how far the onset departs from proportion, as a scale",
            value: DEPARTURE_OF_SCALE,
            in_words: share(DEPARTURE_OF_SCALE, "the drives' deviations (standard deviation)"),
            decides: "the uncertainty of the scale of all drive deviations",
            reason: "0.087 at 2.73 m/s and 0.033 at 0.83 m/s",
        },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_assumption_is_stated_once_and_as_it_is_used() {
        let settings = Settings { slope_prior: 0.8, ..Settings::new(12, 0.0) };
        let stated = settings.assumptions();
        let mut names: Vec<&str> = stated.iter().map(|one| one.of).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), stated.len());
        assert!(
            stated
                .iter()
                .any(|one| one.value.to_bits() == 0.8_f64.to_bits() && one.in_words.starts_with("80 %"))
        );
        for value in [ONSET_SHARE, DEPARTURE, DEPARTURE_OF_SCALE, BENT_SHARE] {
            assert!(stated.iter().any(|one| one.value.to_bits() == value.to_bits()), "{value}");
        }
        // What a shaker prescribes is in proportion to its end.
        let shaken = Settings { first_body: FirstBody::Prescribed, ..settings };
        assert_eq!(shaken.assumptions().len() + 3, stated.len());
    }
}
