//! What several tests share: the command, folders to work in, a laboratory that films, and tables and texts as their users read them.

pub(crate) mod command;
pub(crate) mod folder;
pub(crate) mod laboratory;
pub(crate) mod motion;
pub(crate) mod python;
pub(crate) mod repository;
pub(crate) mod table;
pub(crate) mod written;
