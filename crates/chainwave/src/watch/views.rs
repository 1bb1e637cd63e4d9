//! Which recordings are trials of one view, where no table says it: those whose names differ in their last number.

/// Views in the order in which they came.
#[derive(Default)]
pub(super) struct Views(Vec<String>);

impl Views {
    /// The number of a recording's view, from 1.
    pub(super) fn of_name(&mut self, name: &str) -> u32 {
        let view = without_last_number(name);
        let known = self.0.iter().position(|known| *known == view);
        let index = known.unwrap_or_else(|| {
            self.0.push(view);
            self.0.len() - 1
        });
        index as u32 + 1
    }
}

/// A file's name without its ending and without the digits that come last in it.
fn without_last_number(name: &str) -> String {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let Some(end) = stem.rfind(|c: char| c.is_ascii_digit()).map(|at| at + 1) else {
        return stem.to_owned();
    };
    let start = stem[..end]
        .rfind(|c: char| !c.is_ascii_digit())
        .map_or(0, |at| at + stem[at..].chars().next().map_or(1, char::len_utf8));
    format!("{}#{}", &stem[..start], &stem[end..])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trials_of_a_view_differ_in_their_last_number() {
        let mut views = Views::default();
        let numbers =
            ["view1_trial1.cine", "view1_trial12.cine", "view2_trial1.cine", "ü7.cine", "ü8", "end"]
                .map(|name| views.of_name(name));
        assert_eq!(numbers, [1, 1, 2, 3, 3, 4]);
    }
}
