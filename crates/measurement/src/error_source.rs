//! Where an error that many samples share comes from.

use std::fmt;

/// Source of one of the [`ErrorModes`](crate::ErrorModes), by which it is found among the others.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorSource {
    /// The noise of readings, through the drives and trigger offsets that recordings were given: one principal direction of their
    /// covariance.
    Alignment {
        /// Number of the direction.
        direction: usize,
    },
    /// A delay of all bodies in proportion to the drive, which readings cannot tell from an offset of the trigger.
    DelayByDrive,
    /// Drives and offsets that still moved when the alignment ended.
    Unsettled,
    /// The place at rest of one body in one recording.
    Rest {
        /// Name of the recording.
        recording: String,
        /// Number of the body.
        body: usize,
    },
    /// What the drives leave open of how bodies respond to them, alike in all bodies that the same recordings saw.
    Response {
        /// Number of the first of these bodies.
        first_body: usize,
    },
    /// The mean drive of recordings that share no body with the others, with the delay that goes with it.
    MeanDrive {
        /// Number of the first body that they saw.
        first_body: usize,
    },
    /// The mean trigger of recordings that share no body with the others.
    MeanTrigger {
        /// Number of the first body that they saw.
        first_body: usize,
    },
    /// The length by which pictures are measured.
    CalibrationLength,
    /// The points by which pictures are measured.
    CalibrationPoints,
    /// The time from the exposure of one line of a picture to that of the next, of a shutter that rolls.
    LineTime,
    /// What is not known of the drives of a chain that is struck at both ends.
    FarStriker,
    /// A motion of the camera that all trials share, where no body at rest tells it.
    CameraMotion,
    /// Any other, by its name.
    Other(String),
}

impl fmt::Display for ErrorSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Alignment { direction } => write!(f, "alignment {direction}"),
            Self::DelayByDrive => write!(f, "delay by the drive"),
            Self::Unsettled => write!(f, "alignment that did not settle"),
            Self::Rest { recording, body } => write!(f, "rest of body {body} in {recording}"),
            Self::Response { first_body } => {
                write!(f, "response of body {first_body} and those seen with it")
            }
            Self::MeanDrive { first_body } => write!(f, "mean drive of body {first_body}'s recordings"),
            Self::MeanTrigger { first_body } => write!(f, "mean trigger of body {first_body}'s recordings"),
            Self::CalibrationLength => write!(f, "calibration: length"),
            Self::CalibrationPoints => write!(f, "calibration: points"),
            Self::LineTime => write!(f, "time between lines"),
            Self::FarStriker => write!(f, "drives of two strikers"),
            Self::CameraMotion => write!(f, "motion of the camera"),
            Self::Other(name) => write!(f, "{name}"),
        }
    }
}

impl From<&str> for ErrorSource {
    fn from(name: &str) -> Self {
        Self::Other(name.to_owned())
    }
}

impl From<String> for ErrorSource {
    fn from(name: String) -> Self {
        Self::Other(name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_is_found_by_what_it_is_and_printed_in_words() {
        let rest = ErrorSource::Rest { recording: "v1_t2".into(), body: 4 };
        assert_eq!(rest.to_string(), "rest of body 4 in v1_t2");
        assert_eq!(ErrorSource::from("stage").to_string(), "stage");
        assert_ne!(ErrorSource::from("calibration: length"), ErrorSource::CalibrationLength);
    }
}
