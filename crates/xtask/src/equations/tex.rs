//! TeX cut into what belongs together: commands, braces, single characters.

/// A piece of TeX.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Token<'a> {
    /// A command, without its backslash: a word, or one sign such as `,`.
    Command(&'a str),
    /// Any other character but white space.
    Character(char),
}

/// Reads TeX piece by piece.
#[derive(Debug, Clone)]
pub(super) struct Tokens<'a> {
    rest: &'a str,
}

impl<'a> Tokens<'a> {
    pub(super) fn new(tex: &'a str) -> Self {
        Self { rest: tex.trim_start() }
    }

    /// The next piece, which stays.
    pub(super) fn peek(&self) -> Option<Token<'a>> {
        self.clone().next()
    }

    /// Takes the next piece if it is this character.
    pub(super) fn takes(&mut self, character: char) -> bool {
        let is_next = self.peek() == Some(Token::Character(character));
        if is_next {
            self.next();
        }
        is_next
    }

    /// The text of a group in braces, as it is written: for words.
    pub(super) fn words(&mut self) -> Option<&'a str> {
        let (words, rest) = self.rest.strip_prefix('{')?.split_once('}')?;
        self.rest = rest.trim_start();
        Some(words)
    }

    /// Digits with at most one point among them, of which the first was taken already.
    pub(super) fn rest_of_number(&mut self) -> &'a str {
        let digits = |text: &str| text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
        let whole = digits(self.rest);
        let length = match self.rest[whole..].strip_prefix('.').map(digits) {
            Some(behind) if behind > 0 => whole + 1 + behind,
            _ => whole,
        };
        let (number, rest) = self.rest.split_at(length);
        self.rest = rest.trim_start();
        number
    }
}

impl<'a> Iterator for Tokens<'a> {
    type Item = Token<'a>;

    fn next(&mut self) -> Option<Token<'a>> {
        let first = self.rest.chars().next()?;
        let (token, rest) = match self.rest.strip_prefix('\\') {
            None => (Token::Character(first), &self.rest[first.len_utf8()..]),
            Some(behind) => {
                let letters = behind.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(behind.len());
                let sign = behind.chars().next().map_or(0, char::len_utf8);
                let (name, rest) = behind.split_at(if letters > 0 { letters } else { sign });
                (Token::Command(name), rest)
            }
        };
        self.rest = rest.trim_start();
        Some(token)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_end_where_their_letters_do() {
        let of: Vec<Token<'_>> = Tokens::new(r" \tfrac12 \,x_\mathrm{a}\\").collect();
        let expected = [
            Token::Command("tfrac"),
            Token::Character('1'),
            Token::Character('2'),
            Token::Command(","),
            Token::Character('x'),
            Token::Character('_'),
            Token::Command("mathrm"),
            Token::Character('{'),
            Token::Character('a'),
            Token::Character('}'),
            Token::Command("\\"),
        ];
        assert_eq!(of, expected);
    }

    #[test]
    fn numbers_and_words_are_taken_whole() {
        let mut tokens = Tokens::new("12.5.{a b} c");
        assert_eq!(tokens.next(), Some(Token::Character('1')));
        assert_eq!(tokens.rest_of_number(), "2.5");
        assert!(tokens.takes('.') && !tokens.takes('.'));
        assert_eq!((tokens.words(), tokens.words()), (Some("a b"), None));
        assert_eq!(tokens.next(), Some(Token::Character('c')));
        assert_eq!(tokens.next(), None);
    }
}
