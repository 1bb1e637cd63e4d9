//! Tests of the workspace as a whole, in one binary: `cargo test --release -p chainwave-tests`.
//!
//! - `architecture`: what `Cargo.toml`s and sources must keep to;
//! - `book`: its pages say what their commands print;
//! - `pipelines`: the small experiment all the way, held against the truth behind its recordings;
//! - `determinism`, `resume`: the same bytes for any number of threads, and after a kill; `durable`: kept tables that are torn, full disks;
//! - `any_chain`: chains that are not alike throughout; `far_striker`: chains that are struck at both ends, or shaken;
//! - `check`: whether a run makes sense, before it; `plan`: what it will tell;
//! - `golden`: numbers that change only with a version;
//! - `bad_inputs`: what the command refuses, and how; `failures`: how it goes on without a bad recording;
//! - `possessions`: what belongs to the user, and stays; `faults`: what goes wrong in a laboratory; `strikers`: several striker velocities; `ladders`: `tradeoff` and `prove`;
//! - `reading`: recordings without a header, cut short, with what the sensor adds; `sanity`: mistakes in an experiment's numbers;
//! - `on_demand`: what takes OpenCV, with the program that has it and without;
//! - `extremes`: cases at the ends of what the program takes;
//! - `board`, `calibration`: from pictures of a board to the uncertainties of the results; `lens`, `stages`: a distorting lens and a stage
//!   that stands off, undone;
//! - `camera`: what a camera does of its own, found in a run;
//! - `uncertain`: quantities known within an uncertainty; `decisions`: what is chosen to be modelled;
//! - `cluster`: shares of an experiment that several machines track; `workflow`: the paper's, under Snakemake;
//! - `dataset`: tracks as other people's programs query them; `python`: those programs, where pip finds them;
//! - `ring`: motion, compression, modes and bands of rings; `film`: rings that bend in the picture;
//! - `figures`: figures of results in another style; `archive`: results as a package; `import`: tracks that another program wrote; `init`: from a folder of recordings to an experiment;
//! - `corrections`: readings that were doubted, corrected and come back; `watch`: shots looked at as they are saved; `view`: the page;
//! - `samples`, `reference`: the project's own recordings, and other people's where they are at hand.
//!
//! A test that runs the command starts it with [`command::chainwave`], and films in a [`laboratory::Laboratory`]. One that
//! films lives in a module named `slow`, which `cargo xtask test --fast` leaves out and which has the machine for itself
//! under nextest.

// The attribute on each module tells the lints that helpers outside of `#[test]` functions are tests too.
#[cfg(test)]
mod accuracy;
#[cfg(test)]
mod any_chain;
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
mod command;
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
mod folder;
#[cfg(test)]
mod golden;
#[cfg(test)]
mod import;
#[cfg(test)]
mod init;
#[cfg(test)]
mod laboratory;
#[cfg(test)]
mod ladders;
#[cfg(test)]
mod lens;
#[cfg(test)]
mod motion;
#[cfg(test)]
mod on_demand;
#[cfg(test)]
mod paper;
#[cfg(test)]
mod pipelines;
#[cfg(test)]
mod plan;
#[cfg(test)]
mod possessions;
#[cfg(test)]
mod python;
#[cfg(test)]
mod reading;
#[cfg(test)]
mod reference;
#[cfg(test)]
mod repository;
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
mod strikers;
#[cfg(test)]
mod table;
#[cfg(test)]
mod truth;
#[cfg(test)]
mod uncertain;
#[cfg(test)]
mod view;
#[cfg(test)]
mod watch;
#[cfg(test)]
mod words;
mod workflow;
