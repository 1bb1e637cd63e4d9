//! Pairs of numbers, such as a column and a row: neither fewer nor more, which a TOML reader would pass over.

use serde::{Deserialize, Deserializer};

/// Two values.
pub(crate) fn two<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f64; 2], D::Error> {
    exactly_two(Vec::deserialize(deserializer)?)
}

/// Two pairs.
pub(crate) fn two_of_two<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[[f64; 2]; 2], D::Error> {
    exactly_two(each_of_two(deserializer)?)
}

/// Pairs.
pub(crate) fn each_of_two<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<[f64; 2]>, D::Error> {
    let all: Vec<Vec<f64>> = Vec::deserialize(deserializer)?;
    all.into_iter().map(exactly_two).collect()
}

fn exactly_two<T, E: serde::de::Error>(values: Vec<T>) -> Result<[T; 2], E> {
    <[T; 2]>::try_from(values)
        .map_err(|values| E::custom(format!("expected 2 of them, found {}", values.len())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Deserialize)]
    struct Keys {
        #[serde(deserialize_with = "two")]
        at_px: [f64; 2],
        #[serde(deserialize_with = "two_of_two")]
        ends_px: [[f64; 2]; 2],
    }

    #[test]
    fn a_third_number_is_no_pair() {
        let read = |text: &str| toml::from_str::<Keys>(text).map_err(|why| why.to_string());
        let keys = read("at_px = [1, 2.5]\nends_px = [[1, 2], [3, 4]]").unwrap();
        assert_eq!((keys.at_px, keys.ends_px), ([1.0, 2.5], [[1.0, 2.0], [3.0, 4.0]]));
        for text in [
            "at_px = [1]\nends_px = [[1, 2], [3, 4]]",
            "at_px = [1, 2, 3]\nends_px = [[1, 2], [3, 4]]",
            "at_px = [1, 2]\nends_px = [[1, 2], [3, 4, 5]]",
        ] {
            assert!(read(text).unwrap_err().contains("expected 2 of them"), "{text}");
        }
    }
}
