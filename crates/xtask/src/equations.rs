//! `cargo xtask equations`: the equations of the book's pages as MathML, which browsers draw by themselves, so that a page asks nothing of
//! the net. mdBook runs it as a preprocessor (`docs/book.toml`): it gets the book as JSON and gives it back.
//!
//! Pages write TeX between `\\(` and `\\)`, or `\\[` and `\\]` for a line of its own. Markdown's own escapes within may stay (`\\,`, `\_`),
//! so that other programs that show the pages leave the TeX whole.

mod atoms;
mod json;
mod mathml;
mod tex;

use std::io::{self, Read, Write};
use std::path::Path;

use crate::failure::Failure;
use mathml::{Place, mathml};

const FENCE: &str = "```";

/// Reads the book from standard input and writes it to standard output, equations replaced.
pub(crate) fn run() -> Result<(), Failure> {
    let mut given = String::new();
    let at = Failure::at(Path::new("the book as mdBook gives it"));
    io::stdin().read_to_string(&mut given).map_err(&at)?;
    let invalid = |reason| at(io::Error::new(io::ErrorKind::InvalidData, reason));
    let book = json::second_of_list(&given).ok_or_else(|| invalid("expected a list of two".to_owned()))?;
    let replaced = json::map_strings(book, page).map_err(invalid)?;
    io::stdout().write_all(replaced.as_bytes()).map_err(&at)
}

/// A page with its equations as MathML; blocks of code stay. What is not understood is named with the equation.
fn page(text: &str) -> Result<String, String> {
    let mut made = String::new();
    let mut prose = String::new();
    let mut in_code = false;
    for line in text.split_inclusive('\n') {
        if line.trim_start().starts_with(FENCE) {
            in_code = !in_code;
            made += &of_prose(&std::mem::take(&mut prose))?;
            made += line;
        } else if in_code {
            made += line;
        } else {
            prose += line;
        }
    }
    Ok(made + &of_prose(&prose)?)
}

fn of_prose(text: &str) -> Result<String, String> {
    let mut made = String::new();
    let mut rest = text;
    while let Some(at) = rest.find("\\\\(").into_iter().chain(rest.find("\\\\[")).min() {
        let (before, from) = rest.split_at(at);
        let (place, close) = match from.starts_with("\\\\(") {
            true => (Place::InLine, "\\\\)"),
            false => (Place::Alone, "\\\\]"),
        };
        let (equation, behind) =
            from[3..].split_once(close).ok_or_else(|| format!("expected {close} behind {from:.40}"))?;
        let tex = equation.replace("\\_", "_").replace("\\\\", "\\");
        let set = mathml(&tex, place).map_err(|reason| format!("the equation {}: {reason}", tex.trim()))?;
        made += before;
        made += &set;
        rest = behind;
    }
    Ok(made + rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_of_a_page_are_set_and_nothing_else() {
        let text = "The \\\\(c\\_d\\\\) of a body, `\\(`:\n\n\\\\[ a\\\\,b \\\\]\n\n```sh\nsed '\\\\(x\\\\)'\n```\nend\n";
        let set = page(text).unwrap();
        assert!(
            set.starts_with("The <math><msub><mi>c</mi><mi>d</mi></msub></math> of a body, `\\(`:"),
            "{set}"
        );
        assert!(
            set.contains("<math display=\"block\"><mi>a</mi><mspace width=\"0.17em\"/><mi>b</mi></math>"),
            "{set}"
        );
        assert!(set.ends_with("```sh\nsed '\\\\(x\\\\)'\n```\nend\n"), "{set}");
    }

    #[test]
    fn what_is_not_closed_or_not_known_is_named() {
        assert!(page("a \\\\(b").unwrap_err().contains("expected \\\\)"));
        assert!(
            page("a \\\\(\\nosuch\\\\)")
                .unwrap_err()
                .contains("the equation \\nosuch: \\nosuch is not known")
        );
    }

    /// Every page of the book, so that `mdbook build` finds nothing that it cannot set.
    #[test]
    fn every_equation_of_the_book_is_understood() {
        let mut n = 0;
        for path in crate::book::markdown_below(Path::new(crate::book::BOOK)).unwrap() {
            let text = std::fs::read_to_string(crate::command_line::workspace().join(&path)).unwrap();
            let set = page(&text).unwrap_or_else(|reason| panic!("{}: {reason}", path.display()));
            n += set.matches("<math").count();
        }
        assert!(n > 500, "{n}");
    }
}
