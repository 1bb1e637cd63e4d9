//! What a command printed, held against what stands in the book. Times in seconds, minutes and hours are those of a machine,
//! and all that may differ.

/// Whether two texts say the same: line by line, times aside.
pub(crate) fn alike(written: &str, printed: &str) -> bool {
    let (mut written, mut printed) = (written.lines(), printed.lines());
    loop {
        match (written.next(), printed.next()) {
            (None, None) => return true,
            (Some(one), Some(other)) if one == other || timeless(one) == timeless(other) => {}
            _ => return false,
        }
    }
}

/// The lines that differ, `-` as they are written and `+` as they were printed, without those that both begin or end with.
pub(crate) fn difference(written: &str, printed: &str) -> String {
    let (written, printed): (Vec<&str>, Vec<&str>) = (written.lines().collect(), printed.lines().collect());
    let same = |(one, other): &(&&str, &&str)| alike(one, other);
    let n_before = written.iter().zip(&printed).take_while(same).count();
    let (written, printed) = (&written[n_before..], &printed[n_before..]);
    let n_behind = written.iter().rev().zip(printed.iter().rev()).take_while(same).count();
    let told = |sign: &str, lines: &[&str]| lines.iter().map(|line| format!("    {sign} {line}\n")).collect();
    let told_written: String = told("-", &written[..written.len() - n_behind]);
    let told_printed: String = told("+", &printed[..printed.len() - n_behind]);
    told_written + &told_printed
}

/// The lines of a text that do not stand in a paragraph, however that is broken into lines.
pub(crate) fn missing<'a>(said: &'a str, paragraph: &str) -> Vec<&'a str> {
    let spaced = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let paragraph = spaced(paragraph);
    said.lines().filter(|line| !paragraph.contains(&spaced(line))).collect()
}

/// The words of a line, with no number before the word `s`, `min` or `h`, of which one may become the other; a number with a sign is no
/// time.
fn timeless(line: &str) -> Vec<&str> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let is_time = |index: usize| {
        let unit = words.get(index + 1).and_then(|next| next.split(|c| !is_of_a_name(c)).next());
        is_number(words[index]) && unit.is_some_and(|unit| ["s", "min", "h"].contains(&unit))
    };
    let told = |index: usize| match index > 0 && is_time(index - 1) {
        true => words[index].trim_start_matches(is_of_a_name),
        false if is_time(index) => "time",
        false => words[index],
    };
    (0..words.len()).map(told).collect()
}

fn is_number(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_digit()) && word.parse::<f64>().is_ok()
}

fn is_of_a_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_a_machine_may_differ_and_nothing_else() {
        for (written, printed) in [
            ("a run takes about 56 s here (none filmed)\n", "a run takes about 9 s here (none filmed)\n"),
            ("    0.27 s  sanity\n", "   10.27 s  sanity\n"),
            ("took 3 s, all of it", "took 4 s, all of it"),
            ("a run takes about 56 s here", "a run takes about 3 min here"),
            ("", ""),
        ] {
            assert!(alike(written, printed), "{written}{printed}");
        }
        for (written, printed) in [
            ("1.5 ms", "1.6 ms"),
            ("17 steps", "18 steps"),
            ("5 s_n", "6 s_n"),
            ("took 3 s, all of it", "took 4 s. all of it"),
            ("off by +0.72 s", "off by +0.73 s"),
            ("c_d 3.0001", "c_d 3.0002"),
            ("a  b", "a b c"),
            ("a\n", "a\nb\n"),
        ] {
            assert!(!alike(written, printed), "{written}: {printed}");
        }
    }

    #[test]
    fn what_differs_is_shown_alone() {
        let told = difference("a\nb\n1 s\nd\n", "a\nc\nc\n2 s\nd\n");
        assert_eq!(told, "    - b\n    + c\n    + c\n");
        assert_eq!(difference("a\n", "a\na\n"), "    + a\n");
        assert_eq!(difference("", ""), "");
    }

    #[test]
    fn words_are_looked_for_across_lines() {
        assert!(missing("17 of them\n", "There are 17\n  of them.").is_empty());
        assert_eq!(missing("17\n18 of\n", "There are 17 of them."), ["18 of"]);
    }
}
