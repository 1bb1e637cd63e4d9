//! The table of ratios of one processor: written, read, and compared with an earlier one.

use std::fmt::Write;

/// A loss from here on is shown.
const LOSS: f64 = 0.10;
const HEAD: &str = "measure,against,ratio,least,most";

/// How many times faster something is than what it is held against, in several rounds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RatioRow {
    pub(crate) measure: String,
    pub(crate) against: String,
    /// The median of the rounds.
    pub(crate) ratio: f64,
    pub(crate) least: f64,
    pub(crate) most: f64,
}

impl RatioRow {
    /// The median and the range of the rounds; nothing without one.
    pub(crate) fn of_rounds(measure: &str, against: &str, mut rounds: Vec<f64>) -> Option<Self> {
        rounds.sort_by(f64::total_cmp);
        let (least, most) = (*rounds.first()?, *rounds.last()?);
        let middle = rounds.len() / 2;
        let ratio = match rounds.len() % 2 {
            0 => 0.5 * (rounds[middle - 1] + rounds[middle]),
            _ => rounds[middle],
        };
        Some(Self { measure: measure.to_owned(), against: against.to_owned(), ratio, least, most })
    }

    /// The share of an earlier ratio that is lost; negative where it is a gain.
    fn loss_since(&self, earlier: &Self) -> f64 {
        1.0 - self.ratio / earlier.ratio
    }

    fn is_of(&self, other: &Self) -> bool {
        (&self.measure, &self.against) == (&other.measure, &other.against)
    }
}

/// The rows as a file, below lines that say where and how they were measured.
pub(crate) fn written(about: &[String], rows: &[RatioRow]) -> String {
    let mut text = String::new();
    about.iter().for_each(|line| text.push_str(&format!("# {line}\n")));
    text.push_str(HEAD);
    text.push('\n');
    for RatioRow { measure, against, ratio, least, most } in rows {
        // Writing to a text cannot fail.
        let _ = writeln!(text, "\"{measure}\",\"{against}\",{ratio:.2},{least:.2},{most:.2}");
    }
    text
}

/// The rows of such a file; nothing where it is none.
pub(crate) fn read(text: &str) -> Option<Vec<RatioRow>> {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    (lines.next()? == HEAD).then_some(())?;
    lines.map(row).collect()
}

fn row(line: &str) -> Option<RatioRow> {
    let (measure, rest) = line.strip_prefix('"')?.split_once("\",\"")?;
    let (against, numbers) = rest.split_once("\",")?;
    let numbers: Vec<f64> = numbers.split(',').map(str::parse).collect::<Result<_, _>>().ok()?;
    let [ratio, least, most] = numbers[..] else { return None };
    Some(RatioRow { measure: measure.to_owned(), against: against.to_owned(), ratio, least, most })
}

/// The rows beside those of an earlier table, with what is lost.
pub(crate) fn compared(rows: &[RatioRow], earlier: &[RatioRow]) -> String {
    let width =
        |cell: fn(&RatioRow) -> &str| rows.iter().map(|row| cell(row).chars().count()).max().unwrap_or(0);
    let (wide, wide_against) = (width(|row| &row.measure), width(|row| &row.against));
    let mut text = String::new();
    for row in rows {
        let earlier = earlier.iter().find(|earlier| earlier.is_of(row));
        let told = match earlier.map(|earlier| (earlier.ratio, row.loss_since(earlier))) {
            None => String::new(),
            Some((ratio, loss)) if loss >= LOSS => format!("   was {ratio:.2}: LOST {:.0} %", 100.0 * loss),
            Some((ratio, _)) => format!("   was {ratio:.2}"),
        };
        let RatioRow { measure, against, ratio, least, most } = row;
        let _ = writeln!(
            text,
            "{measure:wide$}  {against:wide_against$}  {ratio:7.2} ({least:.2} to {most:.2}){told}"
        );
    }
    text
}

/// The rows, and those of an earlier table that were not measured now.
pub(crate) fn with_others_of(rows: &[RatioRow], earlier: &[RatioRow]) -> Vec<RatioRow> {
    let others = earlier.iter().filter(|earlier| !rows.iter().any(|row| row.is_of(earlier)));
    rows.iter().chain(others).cloned().collect()
}

/// How many rows lost a tenth or more.
pub(crate) fn n_lost(rows: &[RatioRow], earlier: &[RatioRow]) -> usize {
    let lost =
        |row: &&RatioRow| earlier.iter().any(|earlier| earlier.is_of(row) && row.loss_since(earlier) >= LOSS);
    rows.iter().filter(lost).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(measure: &str, rounds: &[f64]) -> RatioRow {
        RatioRow::of_rounds(measure, "a plain loop", rounds.to_vec()).unwrap()
    }

    #[test]
    fn a_median_stands_with_its_range() {
        let odd = row("a", &[3.0, 1.0, 2.0]);
        assert_eq!((odd.ratio, odd.least, odd.most), (2.0, 1.0, 3.0));
        let even = row("a", &[4.0, 1.0, 2.0, 3.0]);
        assert_eq!((even.ratio, even.least, even.most), (2.5, 1.0, 4.0));
        assert_eq!(RatioRow::of_rounds("a", "b", Vec::new()), None);
    }

    #[test]
    fn what_is_written_is_read() {
        let rows = [row("rings, 16 elements", &[4.25]), row("b", &[0.5, 1.0, 1.5])];
        let text = written(&["AMD EPYC".to_owned()], &rows);
        assert!(text.starts_with("# AMD EPYC\nmeasure,against,ratio,least,most\n"), "{text}");
        assert_eq!(read(&text).as_deref(), Some(&rows[..]));
        for damaged in ["", "a,b\n", &text.replace("4.25", "x"), &text.replace("\",", ",")] {
            assert_eq!(read(damaged), None, "{damaged}");
        }
    }

    #[test]
    fn what_was_not_measured_stays() {
        let (a, b, again) = (row("a", &[1.0]), row("b", &[2.0]), row("b", &[3.0]));
        let kept = with_others_of(std::slice::from_ref(&again), &[a.clone(), b]);
        assert_eq!(kept, [again, a]);
    }

    #[test]
    fn a_loss_of_a_tenth_is_shown() {
        let earlier = [row("a", &[10.0]), row("b", &[10.0]), row("gone", &[1.0])];
        let now = [row("a", &[8.9]), row("b", &[9.1]), row("new", &[5.0])];
        let told = compared(&now, &earlier);
        let told: Vec<&str> = told.lines().collect();
        assert!(told[0].ends_with("was 10.00: LOST 11 %"), "{told:?}");
        assert!(told[1].ends_with("was 10.00"), "{told:?}");
        assert!(told[2].ends_with("(5.00 to 5.00)"), "{told:?}");
        assert_eq!(n_lost(&now, &earlier), 1);
    }
}
