//! Which recordings are trials of one view, where no table says it: those whose names differ in their last number.

/// Views in the order in which they came.
pub(super) struct Views {
    names: Vec<String>,
    /// The greatest number that a table gives a view: theirs lie above it, as a recording that it does not list is of none of its views.
    last_of_table: u32,
}

impl Views {
    /// None yet, with numbers above that of the last view of a table; 0 without one.
    pub(super) fn behind(last_of_table: u32) -> Self {
        Self { names: Vec::new(), last_of_table }
    }

    /// The number of a recording's view.
    pub(super) fn of_name(&mut self, name: &str) -> u32 {
        let view = without_last_number(name);
        let known = self.names.iter().position(|known| *known == view);
        let index = known.unwrap_or_else(|| {
            self.names.push(view);
            self.names.len() - 1
        });
        self.last_of_table.saturating_add(index as u32 + 1)
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
        let mut views = Views::behind(0);
        let numbers =
            ["view1_trial1.cine", "view1_trial12.cine", "view2_trial1.cine", "ü7.cine", "ü8", "end"]
                .map(|name| views.of_name(name));
        assert_eq!(numbers, [1, 1, 2, 3, 3, 4]);
    }

    #[test]
    fn what_a_table_does_not_list_is_of_none_of_its_views() {
        let mut views = Views::behind(3);
        assert_eq!(["test1.cine", "test2.cine", "other1.cine"].map(|name| views.of_name(name)), [4, 4, 5]);
    }
}
