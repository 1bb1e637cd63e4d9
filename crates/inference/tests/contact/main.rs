//! The fit of the contact law against curves whose law is known.

// The attribute on each module tells the lints that helpers outside of `#[test]` functions are tests too.
#[cfg(test)]
mod common;
#[cfg(test)]
mod coverage;
#[cfg(test)]
mod curves;
#[cfg(test)]
mod reference;
#[cfg(test)]
mod refusals;
#[cfg(test)]
mod ring;
