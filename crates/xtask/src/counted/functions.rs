//! What the lines of a row come to.

use super::csv::Csv;

/// A column of a table: its title, and what stands in it.
#[derive(Debug)]
pub(super) struct Column {
    pub(super) title: String,
    pub(super) function: Function,
}

/// What is made of the lines of a row; see [`super`].
#[derive(Debug)]
pub(super) enum Function {
    By(String),
    Number,
    Sum(String),
    Of(String),
    Mean(String),
    Rms(String),
    Names(String),
    Held(String),
    Off(String),
    Hits(String),
    Below(String, f64),
}

impl Column {
    /// Reads `TITLE=FUNCTION(COLUMN)`.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let expected = || format!("expected TITLE=FUNCTION(COLUMN), found {text}");
        let (title, rest) = text.rsplit_once('=').ok_or_else(expected)?;
        let (name, argument) =
            rest.strip_suffix(')').and_then(|rest| rest.split_once('(')).ok_or_else(expected)?;
        let of = argument.to_owned();
        let function = match name {
            "by" => Function::By(of),
            "n" => Function::Number,
            "sum" => Function::Sum(of),
            "of" => Function::Of(of),
            "mean" => Function::Mean(of),
            "rms" => Function::Rms(of),
            "names" => Function::Names(of),
            "held" => Function::Held(of),
            "off" => Function::Off(of),
            "hits" => Function::Hits(of),
            "below" => {
                let (column, level) = argument.rsplit_once(',').ok_or_else(expected)?;
                Function::Below(column.to_owned(), level.parse().map_err(|_| expected())?)
            }
            other => return Err(format!("there is no function {other}")),
        };
        Ok(Self { title: title.to_owned(), function })
    }
}

impl Function {
    /// Of the lines of one row.
    pub(super) fn of(&self, counts: &Csv, lines: &[usize]) -> Result<String, String> {
        let n = lines.len();
        let sum = |column: &str| Ok::<f64, String>(counts.numbers(column, lines)?.iter().sum());
        match self {
            Self::By(column) | Self::Names(column) => {
                let all = counts.column(column)?;
                let mut names: Vec<&str> = Vec::new();
                for name in lines.iter().map(|line| all[*line]).filter(|name| !name.is_empty()) {
                    if !names.contains(&name) {
                        names.push(name);
                    }
                }
                Ok(names.join(", "))
            }
            Self::Number => Ok(n.to_string()),
            Self::Sum(column) => Ok(sum(column)?.to_string()),
            Self::Of(column) => Ok(format!("{} of {n}", sum(column)?)),
            Self::Mean(column) => {
                let values = counts.numbers(column, lines)?;
                Ok(two_digits(values.iter().sum::<f64>() / values.len() as f64))
            }
            Self::Rms(column) => Ok(two_digits(rms(&counts.numbers(column, lines)?))),
            Self::Held(quantity) => {
                let (n, held) = (sum(&n_of(quantity))?, sum(&held_of(quantity))?);
                let off = rms(&counts.numbers(&rms_of(quantity), lines)?);
                Ok(stated(n, || format!("{:.0} % ({off:.1})", 100.0 * held / n)))
            }
            Self::Off(quantity) => {
                let off = rms(&counts.numbers(&rms_of(quantity), lines)?);
                Ok(stated(sum(&n_of(quantity))?, || format!("{off:.1}")))
            }
            Self::Hits(quantity) => {
                let (n, held) = (sum(&n_of(quantity))?, sum(&held_of(quantity))?);
                Ok(stated(n, || format!("{held} of {n}")))
            }
            Self::Below(column, level) => {
                let values = counts.numbers(column, lines)?;
                let (n, below) =
                    (values.len() as f64, values.iter().filter(|value| *value < level).count() as f64);
                let share = below / n;
                // The binomial's; of none that was told, that of one.
                let sigma = (share.max(n.recip()) * (1.0 - share) / n).sqrt();
                Ok(format!("{:.1} ± {:.1} % of {n}", 100.0 * share, 100.0 * sigma))
            }
        }
    }
}

fn n_of(quantity: &str) -> String {
    format!("{quantity}_n")
}

fn held_of(quantity: &str) -> String {
    format!("{quantity}_within_95")
}

fn rms_of(quantity: &str) -> String {
    format!("{quantity}_rms_sigma")
}

fn stated(n: f64, told: impl FnOnce() -> String) -> String {
    if n > 0.0 { told() } else { "refused".to_owned() }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

fn two_digits(value: f64) -> String {
    if value.abs() < 9.95 { format!("{value:.1}") } else { format!("{value:.0}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(text: &str) -> Result<String, String> {
        let counts =
            Csv::parse("c,w,q_n,q_within_95,q_rms_sigma\n3,a,1,1,3\n4,b,1,0,4\n-40,a,0,0,\n").unwrap();
        Column::parse(text)?.function.of(&counts, &[0, 1, 2])
    }

    #[test]
    fn each_function_is_what_it_says() {
        for (text, expected) in [
            ("=n()", "3"),
            ("=sum(c)", "-33"),
            ("=of(q_within_95)", "1 of 3"),
            ("=mean(c)", "-11"),
            // The root of (9 + 16 + 1600) / 3.
            ("=rms(c)", "23"),
            ("=names(w)", "a, b"),
            // The root of (9 + 16) / 2.
            ("=held(q)", "50 % (3.5)"),
            ("=off(q)", "3.5"),
            ("=hits(q)", "1 of 2"),
            // 1 of 3, with the root of 1/3 times 2/3 over 3.
            ("=below(c,0)", "33.3 ± 27.2 % of 3"),
        ] {
            assert_eq!(told(text), Ok(expected.to_owned()), "{text}");
        }
    }

    #[test]
    fn what_is_no_function_is_named() {
        for (text, said) in
            [("a", "TITLE="), ("a=n", "TITLE="), ("a=few(c)", "no function few"), ("a=below(c)", "TITLE=")]
        {
            assert!(told(text).unwrap_err().contains(said), "{text}");
        }
    }
}
