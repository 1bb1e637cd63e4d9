//! Recordings written byte by byte here, hostile variants of them, and other people's files against their reference
//! values.

#[cfg(test)]
mod cine;
#[cfg(test)]
mod hostile;
#[cfg(test)]
mod reference;
#[cfg(test)]
#[cfg(feature = "opencv")]
mod video;
#[cfg(test)]
mod writer;
