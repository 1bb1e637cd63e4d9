//! TeX to MathML, as much of it as the book uses; what is not known is named.
//!
//! Classes of signs and the room between them are those of TeX (D. Knuth, *The TeXbook*, chapters 17 and 18), where MathML's own differ: a
//! minus behind a bracket is a sign, signs in scripts have no room around them, brackets grow where TeX is told so.

use super::atoms::{Atom, Class, Set, escaped, grouped, joined, sign, symbol, upright};
use super::tex::{Token, Tokens};

/// Where an equation stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// Within a line of text.
    InLine,
    /// On a line of its own.
    Alone,
}

/// An equation as an element of HTML on one line, without a sign that Markdown would take for its own.
///
/// # Errors
/// What is not understood, in words.
pub(super) fn mathml(tex: &str, place: Place) -> Result<String, String> {
    let mut reader = Reader { tokens: Tokens::new(tex), in_script: false };
    let atoms = reader.row()?;
    if let Some(left) = reader.tokens.peek() {
        return Err(format!("{left:?} closes nothing"));
    }
    let opening = match place {
        Place::InLine => "<math>",
        Place::Alone => "<math display=\"block\">",
    };
    Ok(format!("{opening}{}</math>", joined(&atoms, false)))
}

struct Reader<'a> {
    tokens: Tokens<'a>,
    in_script: bool,
}

impl Reader<'_> {
    /// Parts up to what closes them, which stays.
    fn row(&mut self) -> Result<Vec<Atom>, String> {
        let mut atoms = Vec::new();
        while let Some(token) = self.tokens.peek() {
            match token {
                Token::Character('}' | '&') | Token::Command("right" | "end" | "\\") => break,
                Token::Command("textstyle") => {
                    self.tokens.next();
                    let rest = self.row()?;
                    let style =
                        format!("<mstyle displaystyle=\"false\">{}</mstyle>", joined(&rest, self.in_script));
                    atoms.push(Atom::ordinary(style));
                }
                _ => {
                    // A script without a base has nothing before it.
                    let base = match token {
                        Token::Character('^' | '_') => Atom::ordinary("<mrow></mrow>"),
                        _ => self.atom()?,
                    };
                    atoms.push(self.with_scripts(base)?);
                }
            }
        }
        Ok(atoms)
    }

    /// One part: a sign, a letter, a group, or a command with what it takes.
    fn atom(&mut self) -> Result<Atom, String> {
        match self.tokens.next() {
            None => Err("it ends where something should stand".to_owned()),
            Some(Token::Character('{')) => {
                let row = self.row()?;
                self.expect('}')?;
                Ok(Atom::ordinary(grouped(&row, self.in_script)))
            }
            Some(Token::Character(digit @ '0'..='9')) => {
                Ok(Atom::ordinary(format!("<mn>{digit}{}</mn>", self.tokens.rest_of_number())))
            }
            Some(Token::Character(letter)) if letter.is_alphabetic() => {
                Ok(Atom::ordinary(format!("<mi>{letter}</mi>")))
            }
            Some(Token::Character(other)) => sign(other).ok_or_else(|| format!("{other} is not known")),
            Some(Token::Command(name)) => match symbol(name) {
                Some(atom) => Ok(atom),
                None => self.command(name),
            },
        }
    }

    fn command(&mut self, name: &str) -> Result<Atom, String> {
        match name {
            "frac" | "tfrac" | "dfrac" => {
                let fraction = format!("<mfrac>{}{}</mfrac>", self.argument()?, self.argument()?);
                Ok(Atom::ordinary(match name {
                    "tfrac" => format!("<mstyle displaystyle=\"false\">{fraction}</mstyle>"),
                    "dfrac" => format!("<mstyle displaystyle=\"true\">{fraction}</mstyle>"),
                    _ => fraction,
                }))
            }
            "sqrt" => Ok(Atom::ordinary(format!("<msqrt>{}</msqrt>", self.argument()?))),
            "dot" => self.accented("˙"),
            "ddot" => self.accented("¨"),
            "hat" => self.accented("^"),
            "bar" => self.accented("¯"),
            "tilde" => self.accented("~"),
            "overline" => {
                Ok(Atom::ordinary(format!("<mover>{}<mo stretchy=\"true\">¯</mo></mover>", self.argument()?)))
            }
            "mathrm" => Ok(Atom::ordinary(upright(self.words()?))),
            "operatorname" => Ok(Atom::element(Class::Function, upright(self.words()?))),
            "text" => {
                let words = escaped(self.words()?).replace(' ', "\u{a0}");
                Ok(Atom::ordinary(format!("<mtext>{words}</mtext>")))
            }
            "left" => self.fenced(),
            "begin" => self.matrix(),
            "bigl" | "big" | "bigr" | "Bigl" | "Big" | "Bigr" => self.large(name),
            other => Err(format!("\\{other} is not known")),
        }
    }

    /// What a command takes: a group, or one part of one character.
    fn argument(&mut self) -> Result<String, String> {
        match self.tokens.peek() {
            Some(Token::Character(digit @ '0'..='9')) => {
                self.tokens.next();
                Ok(format!("<mn>{digit}</mn>"))
            }
            _ => Ok(self.atom()?.written(None, self.in_script)),
        }
    }

    fn words(&mut self) -> Result<&str, String> {
        self.tokens.words().ok_or_else(|| "expected words in braces".to_owned())
    }

    fn accented(&mut self, mark: &str) -> Result<Atom, String> {
        let base = self.argument()?;
        Ok(Atom::ordinary(format!("<mover accent=\"true\">{base}<mo stretchy=\"false\">{mark}</mo></mover>")))
    }

    /// A part with what stands below and above behind it.
    fn with_scripts(&mut self, base: Atom) -> Result<Atom, String> {
        let (mut below, mut above) = (None, String::new());
        loop {
            if self.tokens.takes('_') {
                below = Some(self.script()?);
            } else if self.tokens.takes('^') {
                above += &self.script()?;
            } else if self.tokens.takes('\'') {
                above += "<mo mathsize=\"130%\" lspace=\"0\" rspace=\"0\">′</mo>";
            } else {
                break;
            }
        }
        let around = base.class == Class::Sum || (base.class == Class::Function && below.is_some());
        let (name, scripts) = match (below, above.as_str()) {
            (None, "") => return Ok(base),
            (None, above) => (if around { "mover" } else { "msup" }, format!("<mrow>{above}</mrow>")),
            (Some(below), "") => (if around { "munder" } else { "msub" }, below),
            (Some(below), above) => {
                (if around { "munderover" } else { "msubsup" }, format!("{below}<mrow>{above}</mrow>"))
            }
        };
        let base_written = match (around, base.class, &base.set) {
            (true, Class::Function, Set::Element(name)) => {
                let name = name.replace("<mi>", "").replace("</mi>", "");
                format!("<mo movablelimits=\"true\" lspace=\"0\" rspace=\"0\">{name}</mo>")
            }
            _ => base.written(None, self.in_script),
        };
        Ok(Atom::element(base.class, format!("<{name}>{base_written}{scripts}</{name}>")))
    }

    fn script(&mut self) -> Result<String, String> {
        let outside = std::mem::replace(&mut self.in_script, true);
        let script = self.argument();
        self.in_script = outside;
        script
    }

    /// Brackets that grow with what they hold, behind `\left`.
    fn fenced(&mut self) -> Result<Atom, String> {
        let opening = self.delimiter()?;
        let within = self.row()?;
        match self.tokens.next() {
            Some(Token::Command("right")) => {}
            other => return Err(format!("expected \\right, found {other:?}")),
        }
        let (closing, within) = (self.delimiter()?, joined(&within, self.in_script));
        Ok(Atom::ordinary(format!("<mrow><mo>{opening}</mo>{within}<mo>{closing}</mo></mrow>")))
    }

    /// A bracket of a size that is told.
    fn large(&mut self, name: &str) -> Result<Atom, String> {
        let delimiter = self.delimiter()?;
        let class = match (name.ends_with('r'), name.ends_with('l'), delimiter) {
            (true, _, _) | (false, false, ")" | "&#93;") => Class::Closing,
            _ => Class::Opening,
        };
        let size = if name.starts_with('B') { "1.8em" } else { "1.2em" };
        Ok(Atom::element(class, format!("<mo minsize=\"{size}\" maxsize=\"{size}\">{delimiter}</mo>")))
    }

    fn delimiter(&mut self) -> Result<&'static str, String> {
        let found = self.tokens.next();
        let known = match found {
            Some(Token::Character(character @ ('(' | ')' | '[' | ']' | '|'))) => sign(character),
            _ => None,
        };
        match known {
            Some(Atom { set: Set::Sign(sign), .. }) => Ok(sign),
            _ => Err(format!("expected a bracket, found {found:?}")),
        }
    }

    fn matrix(&mut self) -> Result<Atom, String> {
        let name = self.words()?.to_owned();
        if name != "pmatrix" {
            return Err(format!("\\begin{{{name}}} is not known"));
        }
        let mut table = String::from("<mtr>");
        loop {
            let cell = self.row()?;
            table += &format!("<mtd>{}</mtd>", joined(&cell, self.in_script));
            match self.tokens.next() {
                Some(Token::Character('&')) => {}
                Some(Token::Command("\\")) => table += "</mtr><mtr>",
                Some(Token::Command("end")) if self.words()? == name => break,
                other => return Err(format!("expected \\end{{{name}}}, found {other:?}")),
            }
        }
        Ok(Atom::ordinary(format!("<mrow><mo>(</mo><mtable>{table}</mtr></mtable><mo>)</mo></mrow>")))
    }

    fn expect(&mut self, character: char) -> Result<(), String> {
        match self.tokens.takes(character) {
            true => Ok(()),
            false => Err(format!("expected {character}, found {:?}", self.tokens.peek())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::atoms::THIN;
    use super::*;

    /// In a line, without the element around it.
    fn set(tex: &str) -> String {
        let set = mathml(tex, Place::InLine).unwrap();
        set.strip_prefix("<math>").and_then(|set| set.strip_suffix("</math>")).unwrap().to_owned()
    }

    #[test]
    fn scripts_stand_where_tex_puts_them() {
        assert_eq!(set("c_d"), "<msub><mi>c</mi><mi>d</mi></msub>");
        assert_eq!(set("x^2"), "<msup><mi>x</mi><mrow><mn>2</mn></mrow></msup>");
        let primed = "<msubsup><mi>Z</mi><mn>0</mn><mrow><mo mathsize=\"130%\" lspace=\"0\" rspace=\"0\">′</mo><mi>T</mi></mrow></msubsup>";
        assert_eq!(set("Z_0'^T"), primed);
        assert_eq!(set(r"\int g"), "<mo>∫</mo><mi>g</mi>");
        assert_eq!(set(r"\sum_k c"), "<munder><mo>∑</mo><mi>k</mi></munder><mi>c</mi>");
        assert!(set(r"\min_{a,b}").contains("<mo movablelimits=\"true\" lspace=\"0\" rspace=\"0\">min</mo>"));
        // The first digit alone is the numerator, and a number is whole elsewhere.
        assert!(set(r"\tfrac12 12.5").ends_with("<mfrac><mn>1</mn><mn>2</mn></mfrac></mstyle><mn>12.5</mn>"));
    }

    #[test]
    fn a_minus_is_a_sign_or_lies_between() {
        let (sign, between) = ("<mo form=\"prefix\" lspace=\"0\" rspace=\"0\">−</mo>", "<mo>−</mo>");
        assert_eq!(set("-a"), format!("{sign}<mi>a</mi>"));
        assert_eq!(set("a-b"), format!("<mi>a</mi>{between}<mi>b</mi>"));
        assert!(set("(-a)").contains(sign) && set("a = -b").contains(sign) && set(r"a,\; -b").contains(sign));
        assert!(set("(a)-b").contains(between) && set("x_1 - b").contains(between));
        // TeX leaves no room around signs in scripts.
        assert!(set("x_{n+1}").contains("<mo stretchy=\"false\" lspace=\"0\" rspace=\"0\">+</mo>"));
    }

    #[test]
    fn functions_keep_off_what_they_are_of() {
        assert_eq!(set(r"\sin kh"), format!("<mi>sin</mi>{THIN}<mi>k</mi><mi>h</mi>"));
        assert_eq!(set(r"2\cos(x)").matches(THIN).count(), 1);
    }

    #[test]
    fn brackets_grow_where_they_are_told() {
        assert!(set("(x)").starts_with("<mo stretchy=\"false\">(</mo>"));
        assert!(set(r"\left(x\right)").starts_with("<mrow><mo>(</mo>"));
        assert!(set(r"\Bigl[x\Bigr]").contains("<mo minsize=\"1.8em\" maxsize=\"1.8em\">&#93;</mo>"));
        let matrix = set(r"\begin{pmatrix} 1 & 0 \\ 0 & 1 \end{pmatrix}");
        assert!(matrix.contains("<mtr><mtd><mn>1</mn></mtd><mtd><mn>0</mn></mtd></mtr><mtr>"), "{matrix}");
    }

    #[test]
    fn markdown_finds_nothing_of_its_own() {
        let all = set(r"|x|_{a_b} [1] < \text{a | b & c } \mathrm{T}");
        assert!(!all.contains(['|', '[', ']', '_', '*', '\\', '\n']), "{all}");
        assert!(all.contains("<mtext>a\u{a0}&#124;\u{a0}b\u{a0}&amp;\u{a0}c\u{a0}</mtext>"), "{all}");
        assert!(all.contains("<mi mathvariant=\"normal\">T</mi>"), "{all}");
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (tex, said) in [
            ("a}", "closes nothing"),
            ("{a", "expected }"),
            (r"\left(a", "expected \\right"),
            (r"\left a", "expected a bracket"),
            (r"\begin{pmatrix} a", "expected \\end{pmatrix}"),
            (r"\begin{array} a", "\\begin{array} is not known"),
            ("x^", "it ends"),
            ("a # b", "# is not known"),
            (r"\text a", "words in braces"),
        ] {
            let reason = mathml(tex, Place::Alone).unwrap_err();
            assert!(reason.contains(said), "{tex}: {reason}");
        }
    }
}
