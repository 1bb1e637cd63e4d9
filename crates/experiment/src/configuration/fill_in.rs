//! What `init` left open and nobody filled in.

use std::path::Path;

use crate::error::Error;

/// What marks a place to fill in.
const MARK: &str = "FILL_IN";

/// Refuses a file in which places are still to be filled in, and names their lines. What stands behind a `#` is a comment.
///
/// # Errors
/// [`Error::Configuration`] with the lines.
pub(super) fn expect_filled_in(path: &Path, text: &str) -> Result<(), Error> {
    let is_open = |line: &str| line.split('#').next().is_some_and(|value| value.contains(MARK));
    let lines: Vec<String> = (1..)
        .zip(text.lines())
        .filter(|(_, line)| is_open(line))
        .map(|(n, _): (usize, _)| n.to_string())
        .collect();
    let places = match lines.as_slice() {
        [] => return Ok(()),
        [one] => format!("line {one}"),
        [others @ .., last] => format!("lines {} and {last}", others.join(", ")),
    };
    Err(Error::Configuration {
        path: path.to_owned(),
        message: format!("expected values, found {MARK} in {places} (hint: only you know what stands there)"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn open_places_are_named_and_comments_are_none() {
        let told =
            |text: &str| expect_filled_in(Path::new("e.toml"), text).map_err(|error| error.to_string());
        assert_eq!(told("# FILL_IN marks what is open\na = 1 # was FILL_IN\n"), Ok(()));
        assert!(told("a = FILL_IN\n").unwrap_err().contains("FILL_IN in line 1 ("));
        let several = told("b = 2\na = FILL_IN # c\nc = [FILL_IN, 1]\n").unwrap_err();
        assert!(several.contains("lines 2 and 3"), "{several}");
    }
}
