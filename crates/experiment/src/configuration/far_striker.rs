//! `[far_striker]`: a second body, which strikes the far end of the chain.

use std::path::Path;

use chainwave_mechanics::{FarEnd, FarStriker, Striker};
use serde::{Deserialize, Serialize};

use super::contact::Contact;
use super::far_end::FarEndTable;
use crate::error::Error;
use crate::input::numbers::{NotNegative, Positive};
use crate::input::table::Table;

/// A body that comes towards the chain from behind its last body, and pushes only.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FarStrikerTable {
    /// Mass.
    pub mass_kg: Positive,
    /// Velocity towards the chain, so against x; 0 for a body that waits there.
    pub velocity_m_per_s: NotNegative,
    /// Damping of its contact.
    pub damping_kg_per_s: NotNegative,
    /// How far it is from the last body when the striker in front touches body 1.
    #[serde(default)]
    pub distance_m: NotNegative,
    /// Its contact with the last body; that of the last gap where none is stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact: Option<Contact>,
}

impl FarStrikerTable {
    /// Reads the law of its contact, where that stands in a file; see [`Contact::read_files`].
    pub(crate) fn read_files<E: From<Error>>(
        &mut self,
        path: &Path,
        read_table: impl FnMut(&Path) -> Result<Table, E>,
    ) -> Result<(), E> {
        self.contact.as_mut().map_or(Ok(()), |contact| contact.read_files(path, read_table))
    }

    fn far_striker(&self) -> Result<FarStriker, Error> {
        const BODIES_OF_ONE_GAP: usize = 2;
        let contacts = self.contact.as_ref().map(|contact| contact.contacts(BODIES_OF_ONE_GAP));
        Ok(FarStriker {
            striker: Striker {
                mass_kg: self.mass_kg.get(),
                velocity_m_per_s: self.velocity_m_per_s.get(),
                damping_kg_per_s: self.damping_kg_per_s.get(),
                ground_damping_kg_per_s: 0.0,
            },
            distance_m: self.distance_m.get(),
            contact: contacts.transpose()?.map(|contacts| contacts.first().clone()),
        })
    }
}

/// What stands behind the last body, by both keys that say so.
///
/// # Errors
/// A striker behind a wall, and a contact that makes no sense.
pub(crate) fn far_end(kind: FarEndTable, striker: Option<&FarStrikerTable>) -> Result<FarEnd, Error> {
    match (kind, striker) {
        (kind, None) => Ok(kind.into()),
        (FarEndTable::Free, Some(striker)) => Ok(FarEnd::Struck(striker.far_striker()?)),
        (FarEndTable::Fixed, Some(_)) => Err(Error::Value(
            "far_striker: expected [far_end] kind = \"free\" or none, as it must reach the last body, found kind = \"fixed\""
                .into(),
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> FarStrikerTable {
        toml::from_str(text).unwrap()
    }

    const PLAIN: &str = "mass_kg = 4.3e-3\nvelocity_m_per_s = 1.5\ndamping_kg_per_s = 0.2\n";

    #[test]
    fn the_keys_are_those_of_a_striker_with_distance_and_contact() {
        let FarEnd::Struck(plain) = far_end(FarEndTable::Free, Some(&table(PLAIN))).unwrap() else {
            panic!("expected a striker")
        };
        let striker = Striker { velocity_m_per_s: 1.5, ..Striker::OF_RINGS };
        assert_eq!(plain, FarStriker { striker, distance_m: 0.0, contact: None });
        let full = format!("{PLAIN}distance_m = 2e-3\ncontact = {{ law = \"linear\", k_n_per_m = 3e3 }}\n");
        let FarEnd::Struck(full) = far_end(FarEndTable::Free, Some(&table(&full))).unwrap() else {
            panic!("expected a striker")
        };
        assert!((full.distance_m - 2e-3).abs() < 1e-15);
        assert!((full.contact.unwrap().stiffness_n_per_m(0.0) - 3e3).abs() < 1e-9);
    }

    #[test]
    fn a_striker_behind_a_wall_is_refused_with_both_keys() {
        let said = far_end(FarEndTable::Fixed, Some(&table(PLAIN))).unwrap_err().to_string();
        assert!(said.contains("far_striker") && said.contains("fixed"), "{said}");
        assert!(toml::from_str::<FarStrikerTable>(&format!("{PLAIN}speed = 1\n")).is_err());
    }
}
