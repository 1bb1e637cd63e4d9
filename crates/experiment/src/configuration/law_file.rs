//! Laws that stand in files beside a configuration: points of a curve, and what `chainwave contact` fitted to one.

use std::path::Path;

use serde::Deserialize;

use super::contact::{Contact, Law};
use crate::error::Error;
use crate::input::numbers::{NotNegative, Positive};
use crate::input::table::Table;
use crate::input::text_file::read_toml;

/// What is read of CONTACT.toml; the rest of it is for people.
#[derive(Deserialize)]
struct Fit {
    a: Positive,
    delta_0_m: Positive,
    p: Positive,
    k_0_n_per_m: Positive,
    k_0_n_per_m_sigma: NotNegative,
}

impl Contact {
    /// Reads the laws that stand in files, which are looked for beside `path`; `read_table` reads tables, with columns `overlap_m` and
    /// `force_n`.
    ///
    /// # Errors
    /// Files that cannot be read, and those of `read_table`.
    pub fn read_files<E: From<Error>>(
        &mut self,
        path: &Path,
        mut read_table: impl FnMut(&Path) -> Result<Table, E>,
    ) -> Result<(), E> {
        for law in self.laws_mut() {
            match law {
                Law::Table { file, overlap_m, force_n } => {
                    let Some(file) = file.take() else { continue };
                    let table = read_table(&path.with_file_name(file))?;
                    *overlap_m = table.full_numbers("overlap_m")?;
                    *force_n = table.full_numbers("force_n")?;
                }
                Law::Fitted { file } => *law = Law::of_fit(&path.with_file_name(file))?,
                Law::Power { .. } | Law::Hertz { .. } | Law::Linear { .. } => {}
            }
        }
        Ok(())
    }
}

impl Law {
    /// The power law that `chainwave contact` wrote. Its prefactor takes the relative uncertainty of the stiffness k_0: those of a,
    /// `delta_0_m` and p are far larger and cancel, so that each by itself would say that the stiffness is unknown.
    fn of_fit(path: &Path) -> Result<Self, Error> {
        let fit: Fit = read_toml(path)?;
        let a_sigma = fit.a.get() * fit.k_0_n_per_m_sigma.get() / fit.k_0_n_per_m.get();
        Ok(Self::Power {
            a: fit.a,
            delta_0_m: fit.delta_0_m,
            p: fit.p,
            sigmas: [NotNegative::try_from(a_sigma).ok(), None, None],
        })
    }
}
