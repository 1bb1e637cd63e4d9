//! How well a result shall be known.

use std::fmt;
use std::str::FromStr;

use chainwave_measurement::Estimate;

use super::precision::PlannedResult;

/// A result and the largest standard uncertainty that it may have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aim {
    /// The result.
    pub result: PlannedResult,
    /// Its largest uncertainty.
    pub largest: LargestSigma,
}

/// A standard uncertainty by itself, or as a part of the value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LargestSigma {
    /// In the unit of [`PlannedResult::unit`].
    Absolute(f64),
    /// As a part of the value.
    Relative(f64),
}

/// What is written behind a number, with the unit that it stands for and its size in that.
const UNITS: [(&str, &str, f64); 11] = [
    ("m", "m", 1.0),
    ("mm", "m", 1e-3),
    ("um", "m", 1e-6),
    ("µm", "m", 1e-6),
    ("nm", "m", 1e-9),
    ("m/s", "m/s", 1.0),
    ("kg/s", "kg/s", 1.0),
    ("g/s", "kg/s", 1e-3),
    ("J", "J", 1.0),
    ("mJ", "J", 1e-3),
    ("uJ", "J", 1e-6),
];

impl Aim {
    /// Its largest uncertainty where the result has this value, in the result's unit.
    pub fn sigma(&self, value: f64) -> f64 {
        match self.largest {
            LargestSigma::Absolute(sigma) => sigma,
            LargestSigma::Relative(part) => part * value.abs(),
        }
    }

    /// Whether an estimate is known so well.
    pub fn is_met_by(&self, found: &Estimate) -> bool {
        found.sigma <= self.sigma(found.value)
    }
}

impl fmt::Display for Aim {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.result.symbol();
        match self.largest {
            LargestSigma::Relative(part) => write!(f, "{name} to {} %", significant(100.0 * part)),
            LargestSigma::Absolute(sigma) => {
                write!(f, "{name} to {} {}", significant(sigma), self.result.unit())
            }
        }
    }
}

/// As many digits as tell it from what rounding makes of it.
fn significant(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap_or(value)
}

impl FromStr for Aim {
    type Err = String;

    /// Reads `c_g=0.1%`, `HWHM=0.2mm`, `x_n=2um`, `c_d=0.001kg/s`.
    fn from_str(text: &str) -> Result<Self, String> {
        let names = || PlannedResult::ALL.map(PlannedResult::symbol).join(", ");
        let (name, sigma) = text.split_once('=').ok_or_else(|| {
            format!("expected a result and its uncertainty, such as c_g=0.1% or HWHM=0.2mm, found {text:?}")
        })?;
        let result = PlannedResult::ALL.into_iter().find(|one| one.symbol() == name.trim());
        let result = result.ok_or_else(|| format!("expected one of {}, found {name:?}", names()))?;
        let sigma = sigma.trim();
        let end = sigma.find(|c: char| !c.is_ascii_digit() && !matches!(c, '.' | 'e' | 'E' | '-' | '+'));
        let (number, unit) = sigma.split_at(end.unwrap_or(sigma.len()));
        let value = number.parse::<f64>().ok().filter(|value| *value > 0.0 && value.is_finite());
        let value = value.ok_or_else(|| format!("{name}: expected a number above 0, found {number:?}"))?;
        let unit = unit.trim();
        if unit == "%" {
            return Ok(Self { result, largest: LargestSigma::Relative(0.01 * value) });
        }
        let own = result.unit();
        let size = match unit {
            "" if own == "1" => Some(1.0),
            _ => UNITS.iter().find(|(name, of, _)| *name == unit && *of == own).map(|(_, _, size)| *size),
        };
        let size = size.ok_or_else(|| format!("{name}: expected % or a unit of {own}, found {unit:?}"))?;
        Ok(Self { result, largest: LargestSigma::Absolute(size * value) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn aims_are_read_as_they_are_written() {
        let read = |text: &str| text.parse::<Aim>().unwrap();
        let speed = read("c_g=0.1%");
        assert_eq!(speed.result, PlannedResult::GroupVelocity);
        assert!(
            speed.is_met_by(&Estimate::new(40.0, 0.0399)) && !speed.is_met_by(&Estimate::new(40.0, 0.0401))
        );
        let width = read("HWHM = 0.2 mm");
        assert_eq!(width.largest, LargestSigma::Absolute(0.2e-3));
        assert_eq!(read("x_n=2e-6m").largest, LargestSigma::Absolute(2e-6));
        assert_eq!(read("peak_strain=0.001").largest, LargestSigma::Absolute(0.001));
        assert_eq!([speed, width].map(|aim| aim.to_string()), ["c_g to 0.1 %", "HWHM to 0.0002 m"]);
    }

    #[test]
    fn what_is_no_aim_is_refused() {
        for (text, said) in [
            ("c_g", "such as"),
            ("speed=1%", "expected one of"),
            ("c_g=0%", "above 0"),
            ("c_g=-1%", "above 0"),
            ("c_g=fast", "above 0"),
            ("c_g=1mm", "unit of m/s"),
            ("c_d=1", "unit of kg/s"),
        ] {
            let refused = text.parse::<Aim>().unwrap_err();
            assert!(refused.contains(said), "{text}: {refused}");
        }
    }
}
