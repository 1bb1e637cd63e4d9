//! What lies in the gaps, as a configuration states it: for a table, a list of tables, or a pattern that repeats.

mod keys;

use std::path::PathBuf;

use chainwave_mechanics::{
    Contact as GapContact, Contacts, Law as ForceLaw, LinearLaw, MechanicsError, PowerLaw, TableLaw, Tension,
};
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::input::numbers::{NotNegative, Positive};

/// The contacts of a chain.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// What they are, gap by gap.
    pub gaps: Gaps,
    /// Standard deviation of the stiffness from gap to gap, relative to it.
    pub stiffness_scatter: Option<NotNegative>,
}

/// What lies in the gaps from the first one on.
#[derive(Debug, Clone, PartialEq)]
pub enum Gaps {
    /// The same in all.
    Same(ContactTable),
    /// One table for each.
    Each(Vec<ContactTable>),
    /// Tables that take turns; one at least.
    Repeat(Vec<ContactTable>),
}

/// What lies in one gap.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactTable {
    /// Force over overlap.
    pub law: Law,
    /// Whether neighbours that part stay bonded, along the law's tangent, or come apart.
    tension: TensionName,
    /// Overlap over delta_0 where the tangent takes over.
    tension_limit: Option<f64>,
    /// Dashpot between the neighbours.
    damping_kg_per_s: Option<NotNegative>,
}

/// Force over overlap, with what is known of its parameters.
#[derive(Debug, Clone, PartialEq)]
pub enum Law {
    /// F(overlap) = a ((overlap + delta_0)^p - delta_0^p).
    Power {
        /// Prefactor in N/m^p.
        a: Positive,
        /// Effective precompression.
        delta_0_m: Positive,
        /// Exponent.
        p: Positive,
        /// Standard uncertainties of these three.
        sigmas: [Option<NotNegative>; 3],
    },
    /// Two like spheres, precompressed (H. Hertz): the power law of p = 3/2.
    Hertz {
        /// Radius of a sphere.
        radius_m: Positive,
        /// Young's modulus of both.
        young_pa: Positive,
        /// Their Poisson number.
        poisson: NotNegative,
        /// Force that presses the chain together at rest.
        precompression_n: Positive,
    },
    /// A spring.
    Linear {
        /// Its stiffness.
        k_n_per_m: Positive,
        /// Standard uncertainty of that.
        sigma: Option<NotNegative>,
    },
    /// A curve through points.
    Table {
        /// Where the points stand, while they were not read.
        file: Option<PathBuf>,
        /// Overlaps in metres.
        overlap_m: Vec<f64>,
        /// Forces in newtons.
        force_n: Vec<f64>,
    },
    /// A power law that `chainwave contact` fitted to a curve, until it is read.
    Fitted {
        /// CONTACT.toml.
        file: PathBuf,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
enum TensionName {
    Tangent,
    Detach,
}

impl Contact {
    /// The same law in every gap.
    pub fn same(law: Law) -> Self {
        let table =
            ContactTable { law, tension: TensionName::Tangent, tension_limit: None, damping_kg_per_s: None };
        Self { gaps: Gaps::Same(table), stiffness_scatter: None }
    }

    /// The tables, in their order; one at least.
    fn tables(&self) -> &[ContactTable] {
        match &self.gaps {
            Gaps::Same(table) => std::slice::from_ref(table),
            Gaps::Each(tables) | Gaps::Repeat(tables) => tables,
        }
    }

    /// The laws, in the order in which they are stated.
    pub fn laws(&self) -> impl Iterator<Item = &Law> {
        self.tables().iter().map(|table| &table.law)
    }

    /// The laws, to be changed.
    pub(super) fn laws_mut(&mut self) -> impl Iterator<Item = &mut Law> {
        let tables = match &mut self.gaps {
            Gaps::Same(table) => std::slice::from_mut(table),
            Gaps::Each(tables) | Gaps::Repeat(tables) => tables,
        };
        tables.iter_mut().map(|table| &mut table.law)
    }

    /// The contacts of a chain of so many bodies.
    ///
    /// # Errors
    /// A law that makes no sense, or a list of another length than there are gaps.
    pub fn contacts(&self, n_bodies: usize) -> Result<Contacts, Error> {
        let n_gaps = n_bodies.saturating_sub(1);
        let contact = |table: &ContactTable| table.contact();
        Ok(match &self.gaps {
            Gaps::Same(table) => Contacts::Same(table.contact()?),
            Gaps::Each(tables) if tables.len() == n_gaps => {
                Contacts::Each(tables.iter().map(contact).collect::<Result<_, _>>()?)
            }
            Gaps::Each(tables) => {
                let found = tables.len();
                return Err(Error::Value(format!(
                    "contact: expected a table or {n_gaps} tables, one for each gap, found {found}"
                )));
            }
            Gaps::Repeat(tables) => {
                let gaps = tables.iter().cycle().take(n_gaps.max(1));
                Contacts::Each(gaps.map(contact).collect::<Result<_, _>>()?)
            }
        })
    }

    /// States relative standard uncertainties of stiffness, offset and exponent of the laws that have them.
    pub(crate) fn state_sigmas(&mut self, relative: [f64; 3]) {
        for law in self.laws_mut() {
            if let Law::Power { a, delta_0_m, p, sigmas } = law {
                let values = [a.get(), delta_0_m.get(), p.get()];
                *sigmas = std::array::from_fn(|i| NotNegative::try_from(relative[i] * values[i]).ok());
            }
            if let Law::Linear { k_n_per_m, sigma } = law {
                *sigma = NotNegative::try_from(relative[0] * k_n_per_m.get()).ok();
            }
        }
    }

    /// Relative standard uncertainties of stiffness, offset and exponent, each the largest that a law states; 0 where none does.
    pub fn relative_sigmas(&self) -> [f64; 3] {
        let relative =
            |sigma: &Option<NotNegative>, value: &Positive| sigma.map_or(0.0, NotNegative::get) / value.get();
        let of = |law: &Law| match law {
            Law::Power { a, delta_0_m, p, sigmas } => {
                [relative(&sigmas[0], a), relative(&sigmas[1], delta_0_m), relative(&sigmas[2], p)]
            }
            Law::Linear { k_n_per_m, sigma } => [relative(sigma, k_n_per_m), 0.0, 0.0],
            _ => [0.0; 3],
        };
        self.laws().map(of).fold([0.0; 3], |most, own| std::array::from_fn(|i| f64::max(most[i], own[i])))
    }
}

impl Law {
    /// The law as the chain model uses it.
    ///
    /// # Errors
    /// Parameters that make no sense.
    pub fn force_law(&self) -> Result<ForceLaw, MechanicsError> {
        Ok(match self {
            Self::Power { a, delta_0_m, p, .. } => {
                ForceLaw::Power(PowerLaw::new(a.get(), delta_0_m.get(), p.get())?)
            }
            Self::Hertz { radius_m, young_pa, poisson, precompression_n } => {
                // K. L. Johnson, Contact Mechanics (1985), eq. 4.23, for two like spheres.
                let prefactor =
                    young_pa.get() * (2.0 * radius_m.get()).sqrt() / (3.0 * (1.0 - poisson.get().powi(2)));
                let delta_0_m = (precompression_n.get() / prefactor).powf(2.0 / 3.0);
                ForceLaw::Power(PowerLaw::new(prefactor, delta_0_m, 1.5)?)
            }
            Self::Linear { k_n_per_m, .. } => ForceLaw::Linear(LinearLaw::new(k_n_per_m.get())?),
            Self::Table { overlap_m, force_n, .. } => ForceLaw::Table(TableLaw::new(overlap_m, force_n)?),
            Self::Fitted { .. } => {
                return Err(MechanicsError::Length {
                    quantity: "a fitted law's file",
                    expected: 1,
                    found: 0,
                });
            }
        })
    }

    /// Its name in words.
    pub fn in_words(&self) -> &'static str {
        match self {
            Self::Power { .. } => "power law",
            Self::Hertz { .. } => "Hertz's law",
            Self::Linear { .. } => "spring",
            Self::Table { .. } => "measured curve",
            Self::Fitted { .. } => "fitted power law",
        }
    }
}

impl ContactTable {
    fn contact(&self) -> Result<GapContact, MechanicsError> {
        let tension = match (self.tension, self.tension_limit) {
            (TensionName::Detach, _) => Tension::Detach,
            (TensionName::Tangent, Some(limit)) => Tension::Tangent { limit },
            (TensionName::Tangent, None) => Tension::default(),
        };
        let damping_kg_per_s = self.damping_kg_per_s.map_or(0.0, NotNegative::get);
        Ok(GapContact { law: self.law.force_law()?, tension, damping_kg_per_s })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Deserialize, Serialize)]
    struct Table {
        contact: Contact,
    }

    fn read(text: &str) -> Result<Contact, String> {
        toml::from_str::<Table>(text).map(|table| table.contact).map_err(|wrong| wrong.to_string())
    }

    const POWER: &str = "law = \"power\"\na = 60.1\ndelta_0_m = 2.27e-3\np = 0.114\n";

    #[test]
    fn contacts_in_every_form_are_read_and_written() {
        let lists = [
            format!("[contact]\n{POWER}stiffness_scatter = 0.05\n"),
            format!("[[contact]]\n{POWER}[[contact]]\nlaw = \"linear\"\nk_n_per_m = 1500\nk_sigma_n_per_m = 15.0\n"),
            format!("[[contact]]\n{POWER}stiffness_scatter = 0.05\n[[contact]]\n{POWER}"),
            "[contact]\nrepeat = [{ law = \"linear\", k_n_per_m = 1e3 }, { law = \"table\", overlap_m = [-1e-3, 0.0, 1e-3], \
             force_n = [-1.0, 0.0, 2.0] }]\n"
                .to_owned(),
            "[contact]\nlaw = \"hertz\"\nradius_m = 4.76e-3\nyoung_pa = 193e9\npoisson = 0.3\nprecompression_n = 2.0\n".to_owned(),
        ];
        for text in lists {
            let contact = read(&text).unwrap();
            let written = toml::to_string(&Table { contact: contact.clone() }).unwrap();
            assert_eq!(read(&written).unwrap(), contact, "{written}");
            let contacts = contact.contacts(3).unwrap();
            assert!(contacts.k_0_n_per_m() > 0.0);
        }
    }

    #[test]
    fn a_hertzian_contact_bears_its_precompression() {
        let text = "[contact]\nlaw = \"hertz\"\nradius_m = 4.76e-3\nyoung_pa = 193e9\npoisson = 0.3\nprecompression_n = 2.0\n";
        let contacts = read(text).unwrap().contacts(2).unwrap();
        let ForceLaw::Power(law) = contacts.first().law else { panic!("expected a power law") };
        // Steel spheres of 3/8 inch: A = 6.9e9 N/m^1.5 (C. Coste, E. Falcon, S. Fauve, Phys. Rev. E 56 (1997) 6104, for their steel).
        assert!((law.a / 6.89e9 - 1.0).abs() < 0.01, "{law:?}");
        assert!((law.f_0_n() - 2.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_wrong_is_said() {
        let said = |text: &str| read(text).unwrap_err();
        assert!(said("[contact]\nlaw = \"power\"\na = 1.0\np = 0.5\n").contains("missing field `delta_0_m`"));
        assert!(said("[contact]\nlaw = \"linear\"\nk_n_per_m = 1.0\np = 0.5\n").contains("found p"));
        assert!(said(&format!("[contact]\n{POWER}repeat = []\n")).contains("found both"));
        let repeated = |beside: &str, within: &str| {
            said(&format!("[contact]\n{beside}repeat = [{{ law = \"linear\", k_n_per_m = 1e3{within} }}]\n"))
        };
        assert!(repeated("damping_kg_per_s = 0.1\n", "").contains("in each table of repeat"));
        assert!(repeated("", ", stiffness_scatter = 0.05").contains("beside repeat"));
        let scattered = |scatter: &str| format!("[[contact]]\n{POWER}stiffness_scatter = {scatter}\n");
        assert!(said(&(scattered("0.05") + &scattered("0.1"))).contains("found several"));
        assert!(said("contact = []").contains("at least one table"));
        assert!(said("[contact]\nlaw = \"rubber\"\n").contains("unknown variant `rubber`"));
        let two = read(&format!("[[contact]]\n{POWER}[[contact]]\n{POWER}")).unwrap();
        assert!(two.contacts(4).unwrap_err().to_string().contains("expected a table or 3 tables"));
    }
}
