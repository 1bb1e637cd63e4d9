//! The keys of `[contact]`, and how a contact is read from them and written.

use std::fmt;
use std::path::PathBuf;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error as _, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{Contact, ContactTable, Gaps, Law, TensionName};
use crate::input::numbers::{NotNegative, Positive};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
enum LawName {
    Power,
    Hertz,
    Linear,
    Table,
    Fitted,
}

/// Every key that a contact may have.
#[derive(Debug, Clone, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
struct Keys {
    #[serde(skip_serializing_if = "Option::is_none")]
    law: Option<LawName>,
    #[serde(skip_serializing_if = "Option::is_none")]
    a: Option<Positive>,
    #[serde(skip_serializing_if = "Option::is_none")]
    delta_0_m: Option<Positive>,
    #[serde(skip_serializing_if = "Option::is_none")]
    p: Option<Positive>,
    #[serde(skip_serializing_if = "Option::is_none")]
    a_sigma: Option<NotNegative>,
    #[serde(skip_serializing_if = "Option::is_none")]
    delta_0_sigma_m: Option<NotNegative>,
    #[serde(skip_serializing_if = "Option::is_none")]
    p_sigma: Option<NotNegative>,
    #[serde(skip_serializing_if = "Option::is_none")]
    radius_m: Option<Positive>,
    #[serde(skip_serializing_if = "Option::is_none")]
    young_pa: Option<Positive>,
    #[serde(skip_serializing_if = "Option::is_none")]
    poisson: Option<NotNegative>,
    #[serde(skip_serializing_if = "Option::is_none")]
    precompression_n: Option<Positive>,
    #[serde(skip_serializing_if = "Option::is_none")]
    k_n_per_m: Option<Positive>,
    #[serde(skip_serializing_if = "Option::is_none")]
    k_sigma_n_per_m: Option<NotNegative>,
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<PathBuf>,
    #[serde(skip_serializing_if = "Option::is_none")]
    overlap_m: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    force_n: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    tension: Option<TensionName>,
    #[serde(skip_serializing_if = "Option::is_none")]
    tension_limit: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    damping_kg_per_s: Option<NotNegative>,
    #[serde(skip_serializing_if = "Option::is_none")]
    stiffness_scatter: Option<NotNegative>,
    #[serde(skip_serializing_if = "Option::is_none")]
    repeat: Option<Vec<Keys>>,
}

impl Keys {
    /// The keys that are stated and belong to some laws alone.
    fn stated(&self) -> Vec<&'static str> {
        let keys = [
            ("a", self.a.is_some()),
            ("delta_0_m", self.delta_0_m.is_some()),
            ("p", self.p.is_some()),
            ("a_sigma", self.a_sigma.is_some()),
            ("delta_0_sigma_m", self.delta_0_sigma_m.is_some()),
            ("p_sigma", self.p_sigma.is_some()),
            ("radius_m", self.radius_m.is_some()),
            ("young_pa", self.young_pa.is_some()),
            ("poisson", self.poisson.is_some()),
            ("precompression_n", self.precompression_n.is_some()),
            ("k_n_per_m", self.k_n_per_m.is_some()),
            ("k_sigma_n_per_m", self.k_sigma_n_per_m.is_some()),
            ("file", self.file.is_some()),
            ("overlap_m", self.overlap_m.is_some()),
            ("force_n", self.force_n.is_some()),
            ("tension_limit", self.tension_limit.is_some()),
        ];
        keys.into_iter().filter(|(_, is_stated)| *is_stated).map(|(key, _)| key).collect()
    }

    /// Refuses keys that a law does not have.
    fn only(&self, law: &str, known: &[&str]) -> Result<(), String> {
        match self.stated().into_iter().find(|key| !known.contains(key)) {
            Some(other) => Err(format!("law = \"{law}\" takes {}, found {other}", known.join(", "))),
            None => Ok(()),
        }
    }

    fn law(&self) -> Result<Law, String> {
        let missing = |key: &str| format!("missing field `{key}`");
        Ok(match self.law.ok_or_else(|| missing("law"))? {
            LawName::Power => {
                let known = ["a", "delta_0_m", "p", "a_sigma", "delta_0_sigma_m", "p_sigma", "tension_limit"];
                self.only("power", &known)?;
                Law::Power {
                    a: self.a.ok_or_else(|| missing("a"))?,
                    delta_0_m: self.delta_0_m.ok_or_else(|| missing("delta_0_m"))?,
                    p: self.p.ok_or_else(|| missing("p"))?,
                    sigmas: [self.a_sigma, self.delta_0_sigma_m, self.p_sigma],
                }
            }
            LawName::Hertz => {
                self.only(
                    "hertz",
                    &["radius_m", "young_pa", "poisson", "precompression_n", "tension_limit"],
                )?;
                Law::Hertz {
                    radius_m: self.radius_m.ok_or_else(|| missing("radius_m"))?,
                    young_pa: self.young_pa.ok_or_else(|| missing("young_pa"))?,
                    poisson: self.poisson.ok_or_else(|| missing("poisson"))?,
                    precompression_n: self.precompression_n.ok_or_else(|| missing("precompression_n"))?,
                }
            }
            LawName::Linear => {
                self.only("linear", &["k_n_per_m", "k_sigma_n_per_m"])?;
                let k_n_per_m = self.k_n_per_m.ok_or_else(|| missing("k_n_per_m"))?;
                Law::Linear { k_n_per_m, sigma: self.k_sigma_n_per_m }
            }
            LawName::Fitted => {
                self.only("fitted", &["file", "tension_limit"])?;
                Law::Fitted { file: self.file.clone().ok_or_else(|| missing("file"))? }
            }
            LawName::Table => {
                self.only("table", &["file", "overlap_m", "force_n"])?;
                let (overlap_m, force_n) = (self.overlap_m.clone(), self.force_n.clone());
                match (&self.file, overlap_m, force_n) {
                    (Some(file), None, None) => {
                        Law::Table { file: Some(file.clone()), overlap_m: Vec::new(), force_n: Vec::new() }
                    }
                    (None, Some(overlap_m), Some(force_n)) => Law::Table { file: None, overlap_m, force_n },
                    _ => return Err("law = \"table\" takes file, or overlap_m and force_n".into()),
                }
            }
        })
    }

    fn table(&self) -> Result<ContactTable, String> {
        if self.repeat.is_some() {
            return Err("expected repeat at the top alone, found it within a list".into());
        }
        let law = self.law()?;
        let usual = match law {
            Law::Hertz { .. } => TensionName::Detach,
            _ => TensionName::Tangent,
        };
        let tension = self.tension.unwrap_or(usual);
        if self.tension_limit.is_some() && tension == TensionName::Detach {
            let message = "expected tension_limit with tension = \"tangent\" only, found it with \"detach\"";
            return Err(message.into());
        }
        let (tension_limit, damping_kg_per_s) = (self.tension_limit, self.damping_kg_per_s);
        Ok(ContactTable { law, tension, tension_limit, damping_kg_per_s })
    }

    fn tables(all: &[Self]) -> Result<Vec<ContactTable>, String> {
        match all.is_empty() {
            true => Err("expected at least one table, found none".into()),
            false => all.iter().map(Self::table).collect(),
        }
    }

    /// Of a table: one law for all gaps, or laws that take turns.
    fn contact(&self) -> Result<Contact, String> {
        let stiffness_scatter = self.stiffness_scatter;
        let gaps = match &self.repeat {
            None => Gaps::Same(self.table()?),
            Some(_) if self.law.is_some() || !self.stated().is_empty() => {
                return Err("expected a law or repeat = [..], found both".into());
            }
            Some(_) if self.tension.is_some() || self.damping_kg_per_s.is_some() => {
                return Err("expected tension and damping_kg_per_s in each table of repeat = [..], found them beside it".into());
            }
            Some(repeat) if repeat.iter().any(|keys| keys.stiffness_scatter.is_some()) => {
                return Err("expected stiffness_scatter beside repeat = [..], found it within".into());
            }
            Some(repeat) => Gaps::Repeat(Self::tables(repeat)?),
        };
        Ok(Contact { gaps, stiffness_scatter })
    }

    fn of(table: &ContactTable) -> Self {
        let mut keys = Self {
            tension: Some(table.tension),
            tension_limit: table.tension_limit,
            damping_kg_per_s: table.damping_kg_per_s,
            ..Self::default()
        };
        match &table.law {
            Law::Power { a, delta_0_m, p, sigmas } => {
                keys.law = Some(LawName::Power);
                (keys.a, keys.delta_0_m, keys.p) = (Some(*a), Some(*delta_0_m), Some(*p));
                [keys.a_sigma, keys.delta_0_sigma_m, keys.p_sigma] = *sigmas;
            }
            Law::Hertz { radius_m, young_pa, poisson, precompression_n } => {
                keys.law = Some(LawName::Hertz);
                (keys.radius_m, keys.young_pa) = (Some(*radius_m), Some(*young_pa));
                (keys.poisson, keys.precompression_n) = (Some(*poisson), Some(*precompression_n));
            }
            Law::Linear { k_n_per_m, sigma } => {
                keys.law = Some(LawName::Linear);
                (keys.k_n_per_m, keys.k_sigma_n_per_m) = (Some(*k_n_per_m), *sigma);
            }
            Law::Table { file: Some(file), .. } => {
                (keys.law, keys.file) = (Some(LawName::Table), Some(file.clone()));
            }
            Law::Table { file: None, overlap_m, force_n } => {
                keys.law = Some(LawName::Table);
                (keys.overlap_m, keys.force_n) = (Some(overlap_m.clone()), Some(force_n.clone()));
            }
            Law::Fitted { file } => (keys.law, keys.file) = (Some(LawName::Fitted), Some(file.clone())),
        }
        keys
    }
}

impl Serialize for Contact {
    fn serialize<S: Serializer>(&self, out: S) -> Result<S::Ok, S::Error> {
        let stiffness_scatter = self.stiffness_scatter;
        match &self.gaps {
            Gaps::Same(table) => Keys { stiffness_scatter, ..Keys::of(table) }.serialize(out),
            Gaps::Each(tables) => {
                let keys = |table| Keys { stiffness_scatter, ..Keys::of(table) };
                tables.iter().map(keys).collect::<Vec<_>>().serialize(out)
            }
            Gaps::Repeat(tables) => {
                let repeat = Some(tables.iter().map(Keys::of).collect());
                Keys { repeat, stiffness_scatter, ..Keys::default() }.serialize(out)
            }
        }
    }
}

impl<'de> Deserialize<'de> for Contact {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ContactVisitor)
    }
}

/// A table, or a list of tables. Unlike an untagged enum it passes on what is wrong inside.
struct ContactVisitor;

impl<'de> Visitor<'de> for ContactVisitor {
    type Value = Contact;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a table, a list of tables, or { repeat = [..] }")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Contact, A::Error> {
        Keys::deserialize(MapAccessDeserializer::new(map))?.contact().map_err(A::Error::custom)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Contact, A::Error> {
        let mut all: Vec<Keys> = Vec::new();
        while let Some(keys) = sequence.next_element()? {
            all.push(keys);
        }
        let mut scatters = all.iter().filter_map(|keys| keys.stiffness_scatter);
        let stiffness_scatter = scatters.next();
        if scatters.any(|other| Some(other) != stiffness_scatter) {
            return Err(A::Error::custom("expected one stiffness_scatter of all gaps, found several"));
        }
        let gaps = Gaps::Each(Keys::tables(&all).map_err(A::Error::custom)?);
        Ok(Contact { gaps, stiffness_scatter })
    }
}
