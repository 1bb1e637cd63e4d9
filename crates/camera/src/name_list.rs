//! Lists of names in warnings, cut short.

/// Names that a list gives at most.
const N_NAMED: usize = 5;

/// The first names with commas between them, and that there are more where there are.
pub(crate) fn first_names(names: &[String]) -> String {
    let named = names[..names.len().min(N_NAMED)].join(", ");
    let more = if names.len() > N_NAMED { ", and more" } else { "" };
    format!("{named}{more}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn five_names_are_given_and_further_ones_mentioned() {
        let names: Vec<String> = (1..=6).map(|number| number.to_string()).collect();
        assert_eq!(first_names(&names[..5]), "1, 2, 3, 4, 5");
        assert_eq!(first_names(&names), "1, 2, 3, 4, 5, and more");
    }
}
