//! What the design promises of the workspace's shape, held against its manifests and sources.

mod dependencies;
mod documents;
mod files;
mod imports;
mod sources;
