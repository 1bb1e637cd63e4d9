//! The numbers in an image's name, and the pattern that is left without them.

use std::collections::BTreeMap;

/// Stands for a number in a pattern: no letter of a file's name.
const MARK: char = '\0';

/// A number in a name, as it is written.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Number {
    pub(super) digits: String,
    /// With its sign, where it has one.
    pub(super) value: i128,
}

/// A name whose runs of digits are taken out.
pub(super) struct Name {
    pub(super) pattern: Pattern,
    pub(super) numbers: Vec<Number>,
}

impl Name {
    pub(super) fn of(text: &str) -> Self {
        let (mut pattern, mut numbers) = (String::new(), Vec::new());
        let mut digits = String::new();
        for letter in text.chars().chain([MARK]) {
            if letter.is_ascii_digit() {
                digits.push(letter);
                continue;
            }
            // Numbers too large for 64 bits are part of the name like letters.
            match digits.parse::<u64>() {
                Ok(value) => {
                    pattern.push(MARK);
                    numbers.push(Number { digits: digits.clone(), value: value.into() });
                }
                Err(_) => pattern.push_str(&digits),
            }
            digits.clear();
            pattern.push(letter);
        }
        pattern.pop();
        Self { pattern: Pattern(pattern), numbers }
    }
}

/// What a name is without its numbers.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Pattern(String);

impl Pattern {
    /// For messages, with a star in the place of each number.
    pub(super) fn shown(&self) -> String {
        self.0.replace(MARK, "*")
    }

    /// The pattern without the minus before one of its numbers, and the place of that number, for each that has one.
    fn without_minus(&self) -> impl Iterator<Item = (usize, Self)> {
        let numbers = self.0.match_indices(MARK).enumerate();
        numbers.filter_map(|(column, (at, _))| {
            let before = self.0[..at].strip_suffix('-')?;
            Some((column, Self([before, &self.0[at..]].concat())))
        })
    }

    /// Which numbers are the digits behind a decimal point: those behind the only point or comma between two numbers.
    pub(super) fn decimals(&self) -> Vec<bool> {
        let between: Vec<&str> = self.0.split(MARK).collect();
        let is_point = |at: usize| between.get(at).is_some_and(|text| [".", ","].contains(text));
        // The text before number `column` is at `column`, that behind it at `column + 1`.
        let n_numbers = between.len() - 1;
        let is_decimal =
            |column: usize| column > 0 && is_point(column) && !is_point(column - 1) && !is_point(column + 1);
        (0..n_numbers).map(is_decimal).collect()
    }
}

/// An image's place in the given list, and the numbers in its name.
pub(super) type Member = (usize, Vec<Number>);

/// Images of one kind each whose names are the same but for numbers.
pub(super) type Groups<K> = BTreeMap<(K, Pattern), Vec<Member>>;

/// Joins names with a minus before a number to those that have the same pattern without it: there it is a sign. Where all names have it, it
/// separates. Gives what is to be said of it.
pub(super) fn join_signed<K: Ord + Copy>(groups: &mut Groups<K>) -> Vec<String> {
    let mut warnings = Vec::new();
    let counterpart = |groups: &Groups<K>| {
        groups.keys().find_map(|(kind, pattern)| {
            let joined = |(_, plain): &(usize, Pattern)| groups.contains_key(&(*kind, plain.clone()));
            let (column, plain) = pattern.without_minus().filter(joined).last()?;
            Some(((*kind, pattern.clone()), column, (*kind, plain)))
        })
    };
    while let Some((signed, column, plain)) = counterpart(groups) {
        let mut members = groups.remove(&signed).unwrap_or_default();
        members.iter_mut().for_each(|(_, numbers)| numbers[column].value *= -1);
        warnings.push(format!(
            "{} images are named `{}` and others `{}`: the minus is taken for the sign of the number",
            members.len(),
            signed.1.shown(),
            plain.1.shown()
        ));
        groups.entry(plain).or_default().extend(members);
    }
    warnings
}
