//! A choice by its name, as keys hold it; refused here, an unknown one is shown with its line.

use std::fmt::Display;
use std::str::FromStr;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serializer};

pub(super) fn serialize<S: Serializer>(choice: &impl Display, out: S) -> Result<S::Ok, S::Error> {
    out.collect_str(choice)
}

pub(super) fn deserialize<'de, D, Choice>(name: D) -> Result<Choice, D::Error>
where
    D: Deserializer<'de>,
    Choice: FromStr<Err: Display>,
{
    String::deserialize(name)?.parse().map_err(D::Error::custom)
}

/// The same, where nothing may be chosen.
pub(super) mod optional {
    use super::{Deserializer, Display, FromStr, Serializer};

    pub(in crate::configuration) fn serialize<S: Serializer>(
        choice: &Option<impl Display>,
        out: S,
    ) -> Result<S::Ok, S::Error> {
        match choice {
            Some(choice) => super::serialize(choice, out),
            None => out.serialize_none(),
        }
    }

    pub(in crate::configuration) fn deserialize<'de, D, Choice>(name: D) -> Result<Option<Choice>, D::Error>
    where
        D: Deserializer<'de>,
        Choice: FromStr<Err: Display>,
    {
        super::deserialize(name).map(Some)
    }
}
