//! What merging takes to be so where the recordings do not tell it: each number, what it decides, and where it comes from.

use crate::assembly::BENT_SHARE;
use crate::response_sizes::ResponseSizes;
use crate::settings::{FirstBody, Settings};
use crate::stated_response::{DEPARTURE, DEPARTURE_OF_SCALE, ONSET_SHARE, OnsetDeparture, StatedResponse};

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
const SOLVED_ON: &str = "chain model of 12 and 26 hollow elliptical cylinders, strikes of 0.83 to 2.73 m/s";

impl Settings {
    /// What is assumed of drives and of how bodies respond to them, of whatever chain.
    pub fn assumptions(&self) -> Vec<Assumption> {
        let share = |value: f64, of: &str| format!("{} % of {of}", 100.0 * value);
        let usual = self.response_sizes;
        let sized = |of: fn(ResponseSizes) -> f64| {
            let largest = (0..self.n_bodies).map(|row| of(self.sizes_of(row))).fold(of(usual), f64::max);
            let by_the_chain = match largest > of(usual) {
                true => format!(", up to {:.0} % by the stated chain", 100.0 * largest),
                false => String::new(),
            };
            (largest, share(of(usual), "a body's rms motion") + &by_the_chain)
        };
        let [slope, curvature, non_linearity, third_order] = [
            sized(|sizes| sizes.slope),
            sized(|sizes| sizes.curvature),
            sized(|sizes| sizes.non_linearity),
            sized(|sizes| sizes.third_order),
        ];
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
                value: slope.0,
                in_words: slope.1,
                decides: "the response where trials' drives are too alike to tell it; what it leaves open is an error mode of the motion",
                reason: "0.01 to 0.45, and some tenths for the drives' scale, which is found within that (see below)",
            },
            Assumption {
                of: "assumed: how far a response curves with the drive",
                value: curvature.0,
                in_words: curvature.1,
                decides: "the curvature where four trials or more do not tell it; of fewer it is none",
                reason: "up to 0.45",
            },
            Assumption {
                of: "assumed: how far a curvature differs from a weak non-linearity's",
                value: non_linearity.0,
                in_words: non_linearity.1,
                decides: "the error mode of the responses of bodies that the same recordings saw",
                reason: "0.001 to 0.13, one sign over a whole pulse",
            },
            Assumption {
                of: "assumed: how large responses of third order are",
                value: third_order.0,
                in_words: third_order.1,
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
            all.push(length_of_onset());
            match self.stated_responses.first().and_then(StatedResponse::usual_departure) {
                Some(stated) => all.extend(by_the_chain(&stated)),
                None => all.extend(by_no_chain()),
            }
        }
        all
    }

    /// On which chain the numbers of [`Settings::assumptions`] were looked at.
    pub fn assumed_from() -> &'static str {
        SOLVED_ON
    }
}

/// How long an onset is.
fn length_of_onset() -> Assumption {
    Assumption {
        of: "assumed: how long body 1 moves in proportion to the drive",
        value: ONSET_SHARE,
        in_words: format!("until it has gone {} % of its way", 100.0 * ONSET_SHARE),
        decides: "from which frames the drives' scale and the delay by the drive are read",
        reason: "a shorter onset tells them worse, a longer one departs farther",
    }
}

/// How far the onset departs from proportion by the stated chain.
fn by_the_chain(departure: &OnsetDeparture) -> [Assumption; 2] {
    let [scale, delay_s] = departure.estimates();
    [
        Assumption {
            of: DELAY,
            value: delay_s.value,
            in_words: format!(
                "by the stated chain {:.1} +- {:.1} us",
                1e6 * delay_s.value,
                1e6 * delay_s.sigma
            ),
            decides: DECIDES_DELAY,
            reason: BY_THE_CHAIN,
        },
        Assumption {
            of: SCALE,
            value: scale.value,
            in_words: format!("by the stated chain to {:.3} +- {:.3} of it", scale.value, scale.sigma),
            decides: DECIDES_SCALE,
            reason: BY_THE_CHAIN,
        },
    ]
}

/// The same where no chain is stated.
fn by_no_chain() -> [Assumption; 2] {
    [
        Assumption {
            of: DELAY,
            value: DEPARTURE,
            in_words: format!("{} % of the onset's length (standard deviation)", 100.0 * DEPARTURE),
            decides: DECIDES_DELAY,
            reason: "9 us of 0.7 ms at 2.73 m/s",
        },
        Assumption {
            of: SCALE,
            value: DEPARTURE_OF_SCALE,
            in_words: format!(
                "{} % of the drives' deviations (standard deviation)",
                100.0 * DEPARTURE_OF_SCALE
            ),
            decides: DECIDES_SCALE,
            reason: "0.087 at 2.73 m/s and 0.033 at 0.83 m/s",
        },
    ]
}

const DELAY: &str = "assumed: how far the onset departs from proportion, as a delay";
const SCALE: &str = "assumed: how far the onset departs from proportion, as a scale";
const DECIDES_DELAY: &str = "the delay by the drive with its uncertainty, an error mode of the motion and part of each trigger offset's";
const DECIDES_SCALE: &str = "the scale of all drive deviations with its uncertainty";
const BY_THE_CHAIN: &str = "what the chain does with usual damping, with four times that, three times the striker's, or a drive off by its scatter, and three tenths of it";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_assumption_is_stated_once_and_as_it_is_used() {
        let response_sizes = ResponseSizes { slope: 0.8, ..ResponseSizes::USUAL };
        let settings = Settings { response_sizes, ..Settings::new(12, 0.0) };
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
        let shaken = Settings { first_body: FirstBody::Imposed, ..settings };
        assert_eq!(shaken.assumptions().len() + 3, stated.len());
    }
}
