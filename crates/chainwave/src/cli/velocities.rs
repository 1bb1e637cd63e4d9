//! Striker velocities of a scan, as the command line names them.

use std::str::FromStr;

/// Striker velocities: `0.5,1,2.73`, or `FROM:TO:COUNT` evenly spaced with both ends.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Velocities(pub(crate) Vec<f64>);

impl FromStr for Velocities {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |part: &str| {
            let found = part.trim().parse::<f64>().ok().filter(|v| *v > 0.0 && v.is_finite());
            found.ok_or_else(|| format!("expected a velocity above 0 in m/s, found {part:?}"))
        };
        if let [from, to, count] = text.split(':').collect::<Vec<_>>()[..] {
            let (from, to) = (number(from)?, number(to)?);
            let count = count.trim().parse::<usize>().ok().filter(|count| (2..=1_000_000).contains(count));
            let count = count.ok_or("expected FROM:TO:COUNT with a count from 2 to 1000000")?;
            let velocity = |i: usize| from + (to - from) * i as f64 / (count - 1) as f64;
            return Ok(Self((0..count).map(velocity).collect()));
        }
        if text.contains(':') {
            return Err(format!("expected FROM:TO:COUNT, found {text:?}"));
        }
        text.split(',').map(number).collect::<Result<_, _>>().map(Self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocities_are_a_list_or_a_range() {
        assert_eq!("0.5, 1,2.73".parse(), Ok(Velocities(vec![0.5, 1.0, 2.73])));
        assert_eq!("1:2:5".parse(), Ok(Velocities(vec![1.0, 1.25, 1.5, 1.75, 2.0])));
        for wrong in ["", "0", "1,-2", "1:2", "1:2:1", "1:2:x", "nan"] {
            assert!(wrong.parse::<Velocities>().is_err(), "{wrong}");
        }
    }
}
