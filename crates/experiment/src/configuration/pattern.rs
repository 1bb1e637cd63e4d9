//! A number of every body or every gap: the same for all, a list, a pattern that repeats, or a grade.

use std::fmt;
use std::marker::PhantomData;

use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeOwned, Error as _, IntoDeserializer, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

/// Numbers along a chain: `x`, `[x, y, ..]` with one for each, `{ repeat = [x, y] }` from the first on, or `{ grade = [first, last] }` in
/// equal steps.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Pattern<T> {
    /// The same for all.
    All(T),
    /// One for each.
    Each(Vec<T>),
    /// Again and again from the first on.
    Repeat {
        /// What is repeated; one number at least.
        repeat: Vec<T>,
    },
    /// In equal steps from the first to the last.
    Grade {
        /// Both.
        grade: [T; 2],
    },
}

impl<T: Copy + Into<f64>> Pattern<T> {
    /// The numbers of `n` bodies or gaps; `key` names them in a refusal.
    ///
    /// # Errors
    /// A list of another length.
    pub fn values(&self, n: usize, key: &str) -> Result<Vec<f64>, String> {
        let value = |number: &T| -> f64 { (*number).into() };
        match self {
            Self::All(number) => Ok(vec![value(number); n]),
            Self::Each(numbers) if numbers.len() == n => Ok(numbers.iter().map(value).collect()),
            Self::Each(numbers) => {
                Err(format!("{key}: expected a number or {n} numbers (n_bodies), found {}", numbers.len()))
            }
            Self::Repeat { repeat } => Ok(repeat.iter().cycle().take(n).map(value).collect()),
            Self::Grade { grade: [first, last] } => {
                let (first, last) = (value(first), value(last));
                let share = |k: usize| k as f64 / (n.max(2) - 1) as f64;
                Ok((0..n).map(|k| first + share(k) * (last - first)).collect())
            }
        }
    }

    /// Mean of the numbers of `n` bodies or gaps; of a list, of what it holds.
    pub fn mean(&self, n: usize) -> f64 {
        match self {
            Self::All(number) => (*number).into(),
            Self::Each(numbers) => {
                mean_of(&numbers.iter().map(|number| (*number).into()).collect::<Vec<_>>())
            }
            _ => mean_of(&self.values(n, "").unwrap_or_default()),
        }
    }

    /// The number that all share, where it was stated so.
    pub fn same(&self) -> Option<f64> {
        match self {
            Self::All(number) => Some((*number).into()),
            _ => None,
        }
    }
}

fn mean_of(numbers: &[f64]) -> f64 {
    numbers.iter().sum::<f64>() / numbers.len().max(1) as f64
}

/// The forms of a pattern that are tables.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PatternTable<T> {
    repeat: Option<Vec<T>>,
    grade: Option<Vec<T>>,
}

impl<'de, T: DeserializeOwned> Deserialize<'de> for Pattern<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(PatternVisitor(PhantomData))
    }
}

/// Unlike an untagged enum it passes on what is wrong inside.
struct PatternVisitor<T>(PhantomData<T>);

impl<'de, T: DeserializeOwned> Visitor<'de> for PatternVisitor<T> {
    type Value = Pattern<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, a list of numbers, { repeat = [..] } or { grade = [first, last] }")
    }

    fn visit_f64<E: serde::de::Error>(self, number: f64) -> Result<Self::Value, E> {
        T::deserialize(number.into_deserializer()).map(Pattern::All)
    }

    fn visit_i64<E: serde::de::Error>(self, number: i64) -> Result<Self::Value, E> {
        self.visit_f64(number as f64)
    }

    fn visit_u64<E: serde::de::Error>(self, number: u64) -> Result<Self::Value, E> {
        self.visit_f64(number as f64)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Self::Value, A::Error> {
        let mut numbers = Vec::new();
        while let Some(number) = sequence.next_element()? {
            numbers.push(number);
        }
        Ok(Pattern::Each(numbers))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
        let table = PatternTable::deserialize(MapAccessDeserializer::new(map))?;
        match (table.repeat, table.grade) {
            (Some(repeat), None) if !repeat.is_empty() => Ok(Pattern::Repeat { repeat }),
            (None, Some(grade)) => match <[T; 2]>::try_from(grade) {
                Ok(grade) => Ok(Pattern::Grade { grade }),
                Err(grade) => Err(A::Error::custom(format!(
                    "expected {{ grade = [first, last] }}, found a grade of {} numbers",
                    grade.len()
                ))),
            },
            _ => Err(A::Error::custom(
                "expected { repeat = [..] } with a number, or { grade = [first, last] }",
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::numbers::Positive;

    #[derive(Deserialize)]
    struct Table {
        x: Pattern<Positive>,
    }

    fn read(text: &str) -> Result<Pattern<Positive>, String> {
        toml::from_str::<Table>(&format!("x = {text}"))
            .map(|table| table.x)
            .map_err(|wrong| wrong.to_string())
    }

    #[test]
    fn numbers_along_a_chain_in_every_form() {
        let values = |text: &str| read(text).unwrap().values(4, "x").unwrap();
        assert_eq!(values("2"), [2.0; 4]);
        assert_eq!(values("2.5"), [2.5; 4]);
        assert_eq!(values("[1, 2.0, 3, 4]"), [1.0, 2.0, 3.0, 4.0]);
        assert_eq!(values("{ repeat = [1, 3] }"), [1.0, 3.0, 1.0, 3.0]);
        assert_eq!(values("{ grade = [1, 4] }"), [1.0, 2.0, 3.0, 4.0]);
        for text in ["2.5", "[1.0, 2.0]", "{ repeat = [1.0, 3.0] }", "{ grade = [1.0, 4.0] }"] {
            let pattern = read(text).unwrap();
            let written = toml::to_string(&std::collections::BTreeMap::from([("x", &pattern)])).unwrap();
            assert_eq!(toml::from_str::<Table>(&written).unwrap().x, pattern, "{written}");
        }
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place() {
        assert!(read("[1, -2]").unwrap_err().contains("above 0, found -2"));
        assert!(read("\"heavy\"").unwrap_err().contains("a number, a list of numbers"));
        assert!(read("{ repeat = [] }").unwrap_err().contains("repeat = [..]"));
        assert!(read("{ grade = [1, 2, 3] }").unwrap_err().contains("a grade of 3 numbers"));
        assert!(read("{ repeat = [1], grade = [1, 2] }").unwrap_err().contains("or { grade"));
        assert!(read("{ step = 1 }").unwrap_err().contains("unknown field `step`"));
        let refused = read("[1, 2]").unwrap().values(3, "chain.mass_kg").unwrap_err();
        assert_eq!(refused, "chain.mass_kg: expected a number or 3 numbers (n_bodies), found 2");
    }
}
