//! Mathematics in labels: what stands between dollar signs is set in italics, with subscripts and superscripts.

/// Size of an index relative to its line.
const INDEX: f64 = 0.72;
/// How far a superscript is raised and a subscript lowered, in em of the line.
const RAISED_EM: f64 = 0.36;
const LOWERED_EM: f64 = -0.17;
/// Space before a superscript, in em of the line.
const INDEX_GAP_EM: f64 = 0.05;

/// Letters in a row that look the same.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Run {
    pub(crate) letters: String,
    pub(crate) italic: bool,
    /// Size relative to the line.
    pub(crate) scale: f64,
    /// Base line above that of the line, in em of the line.
    pub(crate) raised_em: f64,
    /// Space before it, in em of the line.
    pub(crate) gap_em: f64,
}

/// Where a letter stands relative to its line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Level {
    Line,
    Raised,
    Lowered,
}

/// The runs of a label such as `group velocity $c_g$ (m/s)`. In mathematics letters are italic, but for subscripts other
/// than the index `n`, which are words; `_` and `^` take the next letter or what stands in braces.
pub(crate) fn runs(label: &str) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    let mut letters = label.chars().peekable();
    let (mut in_mathematics, mut level, mut in_braces) = (false, Level::Line, false);
    while let Some(letter) = letters.next() {
        match letter {
            // A sign alone in a user's name is no mathematics.
            '$' if !in_mathematics && !letters.clone().any(|later| later == '$') => {
                push(&mut runs, letter, false, level);
            }
            '$' => (in_mathematics, level, in_braces) = (!in_mathematics, Level::Line, false),
            '_' | '^' if in_mathematics => {
                level = if letter == '^' { Level::Raised } else { Level::Lowered };
                in_braces = letters.next_if_eq(&'{').is_some();
            }
            '}' if in_braces => (level, in_braces) = (Level::Line, false),
            _ => {
                push(&mut runs, letter, in_mathematics, level);
                if !in_braces {
                    level = Level::Line;
                }
            }
        }
    }
    runs
}

fn push(runs: &mut Vec<Run>, letter: char, in_mathematics: bool, level: Level) {
    let is_word = level == Level::Lowered && letter != 'n';
    let italic = in_mathematics && letter.is_alphabetic() && !is_word;
    let (scale, raised_em, gap_em) = match level {
        Level::Line => (1.0, 0.0, 0.0),
        Level::Raised => (INDEX, RAISED_EM, INDEX_GAP_EM),
        Level::Lowered => (INDEX, LOWERED_EM, 0.0),
    };
    match runs.last_mut() {
        Some(run) if (run.italic, run.raised_em) == (italic, raised_em) => run.letters.push(letter),
        _ => runs.push(Run { letters: letter.into(), italic, scale, raised_em, gap_em }),
    }
}

/// The label without its marks, for readers of text.
pub(crate) fn plain(label: &str) -> String {
    if label.matches('$').count() > 1 { label.replace(['$', '{', '}'], "") } else { label.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symbols_are_italic_and_words_and_units_are_not() {
        let runs = runs("group velocity $c_g$ (m/s)");
        let told: Vec<(&str, bool)> = runs.iter().map(|run| (run.letters.as_str(), run.italic)).collect();
        assert_eq!(told, [("group velocity ", false), ("c", true), ("g", false), (" (m/s)", false)]);
        assert!(runs[2].raised_em < 0.0 && runs[2].scale < 1.0);
    }

    #[test]
    fn braces_hold_an_index_together_and_names_with_signs_stay_as_they_are() {
        let power = runs("$10^{−3}$");
        assert_eq!(power.len(), 2);
        assert_eq!((power[1].letters.as_str(), power[1].italic), ("−3", false));
        assert_eq!(runs("view_2^b {x}").len(), 1);
        assert_eq!(plain("$10^{−3}$ of $u_n$"), "10^−3 of u_n");
        assert!(runs("$u_n$")[0].italic && runs("$u_n$")[1].italic);
    }

    #[test]
    fn a_name_with_one_sign_stays_as_it_is() {
        let letters = |label: &str| runs(label).into_iter().map(|run| run.letters).collect::<String>();
        for name in ["5 $ a_", "$x^{2", "a_1"] {
            assert_eq!(letters(name), name);
            assert_eq!(plain(name), name);
        }
    }
}
