//! Damping and what else a fit finds of the chain, with the models beside the stated one.

pub(crate) mod assumptions;
pub(crate) mod contacts_asked;
pub(crate) mod damping;
pub(crate) mod drive_off;
pub(crate) mod first_impact;
pub(crate) mod fits;
pub(crate) mod model_beside;
