//! Tests of the workspace as a whole, in one binary: `cargo test --release -p chainwave-tests`. What each file tests stands at its head.
//!
//! A test that runs the command starts it with [`support::command::chainwave`], and films in a [`support::laboratory::Laboratory`]. One that
//! films lives in a module named `slow`, which `cargo xtask test --fast` leaves out; those that kill a run or time methods have the
//! machine for themselves under nextest (`.config/nextest.toml`).

// The attribute on each module tells the lints that helpers outside of `#[test]` functions are tests too.
#[cfg(test)]
mod accuracy;
#[cfg(test)]
mod architecture;
#[cfg(test)]
mod archive;
#[cfg(test)]
mod bad_inputs;
#[cfg(all(test, feature = "opencv"))]
mod board;
#[cfg(test)]
mod book;
#[cfg(test)]
mod calibration;
#[cfg(test)]
mod camera;
#[cfg(test)]
mod check;
#[cfg(test)]
mod chosen_sizes;
#[cfg(test)]
mod clocks;
#[cfg(test)]
mod cluster;
#[cfg(test)]
mod contact;
#[cfg(test)]
mod corrections;
#[cfg(test)]
mod dataset;
#[cfg(test)]
mod decisions;
#[cfg(test)]
mod determinism;
#[cfg(test)]
mod dic;
#[cfg(test)]
mod drives;
#[cfg(test)]
mod durable;
#[cfg(test)]
mod export;
#[cfg(test)]
mod extremes;
#[cfg(test)]
mod failures;
#[cfg(test)]
mod far_striker;
#[cfg(test)]
mod faults;
#[cfg(test)]
mod figures;
#[cfg(test)]
mod film;
#[cfg(test)]
mod golden;
#[cfg(test)]
mod import;
#[cfg(test)]
mod init;
#[cfg(test)]
mod ladders;
#[cfg(test)]
mod lens;
#[cfg(test)]
mod non_uniform_chains;
#[cfg(test)]
mod on_demand;
#[cfg(test)]
mod output_modes;
#[cfg(test)]
mod paper;
#[cfg(test)]
mod pipelines;
#[cfg(test)]
mod plan;
#[cfg(test)]
mod raw_and_truncated;
#[cfg(test)]
mod reference;
#[cfg(test)]
mod resume;
#[cfg(test)]
mod ring;
#[cfg(test)]
mod samples;
#[cfg(test)]
mod sanity;
#[cfg(test)]
mod stages;
#[cfg(test)]
mod stated_uncertainties;
#[cfg(test)]
mod strikers;
#[cfg(test)]
mod support;
#[cfg(test)]
mod truth;
#[cfg(test)]
mod user_files;
#[cfg(test)]
mod view;
#[cfg(test)]
mod watch;
mod workflow;
