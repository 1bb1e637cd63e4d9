//! Lines of a file of counts: notes behind `#`, a head, values with commas between and quotation marks where they have some.

/// A head and the lines below it.
#[derive(Debug)]
pub(super) struct Csv {
    head: Vec<String>,
    lines: Vec<Vec<String>>,
}

impl Csv {
    /// Reads a whole file.
    ///
    /// # Errors
    /// No head; a line of another length.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let mut lines = text.lines().filter(|line| !line.starts_with('#')).map(values);
        let head = lines.next().ok_or("expected a head, found no line")?;
        let lines: Vec<Vec<String>> = lines.collect();
        match lines.iter().find(|line| line.len() != head.len()) {
            Some(other) => Err(format!("expected {} values, found {}", head.len(), other.join(","))),
            None => Ok(Self { head, lines }),
        }
    }

    /// The values of a column.
    pub(super) fn column(&self, name: &str) -> Result<Vec<&str>, String> {
        let place = self
            .head
            .iter()
            .position(|other| other == name)
            .ok_or_else(|| format!("expected a column {name}, found {}", self.head.join(", ")))?;
        Ok(self.lines.iter().map(|line| &*line[place]).collect())
    }

    /// The numbers of a column in some lines, where they are not empty.
    pub(super) fn numbers(&self, name: &str, lines: &[usize]) -> Result<Vec<f64>, String> {
        let column = self.column(name)?;
        let written = lines.iter().map(|line| column[*line]).filter(|value| !value.is_empty());
        let number =
            |value: &str| value.parse().map_err(|_| format!("{name}: expected a number, found {value}"));
        written.map(number).collect()
    }

    /// What stands in one column beside a value of another, where that is found.
    pub(super) fn found(&self, column: &str, value: &str, beside: &str) -> Result<Option<&str>, String> {
        let (values, others) = (self.column(column)?, self.column(beside)?);
        Ok(values.iter().position(|other| *other == value).map(|place| others[place]))
    }
}

fn values(line: &str) -> Vec<String> {
    let (mut all, mut quoted) = (vec![String::new()], false);
    let mut characters = line.chars().peekable();
    while let Some(character) = characters.next() {
        match character {
            '"' if quoted && characters.peek() == Some(&'"') => {
                characters.next();
                all.last_mut().into_iter().for_each(|value| value.push('"'));
            }
            '"' => quoted = !quoted,
            ',' if !quoted => all.push(String::new()),
            other => all.last_mut().into_iter().for_each(|value| value.push(other)),
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotation_marks_hold_commas_and_each_other() {
        assert_eq!(values("a,\"b, \"\"c\"\"\",,d"), ["a", "b, \"c\"", "", "d"]);
        assert_eq!(values(""), [""]);
    }

    #[test]
    fn what_is_no_table_is_named() {
        assert!(Csv::parse("# note\n").unwrap_err().contains("head"));
        assert!(Csv::parse("a,b\n1\n").unwrap_err().contains("expected 2 values"));
        let table = Csv::parse("a,b\n1,x\n,\n").unwrap();
        assert_eq!(table.numbers("a", &[0, 1]), Ok(vec![1.0]));
        assert!(table.numbers("b", &[0]).unwrap_err().contains("expected a number"));
        assert_eq!(table.found("b", "x", "a"), Ok(Some("1")));
    }
}
