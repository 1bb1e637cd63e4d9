//! Recordings written byte by byte here, hostile variants of them, and other people's files against their reference
//! values.

#[cfg(test)]
mod allocation;
#[cfg(test)]
mod board_truth;
#[cfg(test)]
mod boards;
#[cfg(test)]
mod cine;
#[cfg(test)]
mod common;
#[cfg(test)]
mod counting;
#[cfg(test)]
mod folders;
#[cfg(test)]
mod hostile;
#[cfg(test)]
mod hostile_images;
#[cfg(test)]
mod images;
#[cfg(test)]
mod jpeg_writer;
#[cfg(test)]
mod moving_speckle;
#[cfg(test)]
mod mraw;
#[cfg(test)]
mod plain_avi;
#[cfg(test)]
mod property;
#[cfg(test)]
mod recordings;
#[cfg(test)]
mod reference;
#[cfg(test)]
mod sensor;
#[cfg(test)]
mod survey;
#[cfg(test)]
mod tiff_writer;
#[cfg(test)]
mod unicode;
#[cfg(test)]
mod without_library;
#[cfg(test)]
mod writer;
