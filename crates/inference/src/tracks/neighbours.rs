//! Neighbours that share a number, where a chain is too long for one of each body's own.

/// Bodies or gaps, from the first number to the last one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Neighbours {
    pub(super) first: usize,
    pub(super) last: usize,
    /// Those among them that were asked about.
    pub(super) n: usize,
}

impl Neighbours {
    /// As many groups of some numbers, which ascend, as there are at most to be: of one each where that allows for it, else as large as each other.
    pub(super) fn of(numbers: &[usize], most: usize) -> Vec<Self> {
        let n_groups = numbers.len().min(most);
        let bound = |group: usize| group * numbers.len() / n_groups;
        let group = |group: usize| {
            let members = &numbers[bound(group)..bound(group + 1)];
            Some(Self { first: *members.first()?, last: *members.last()?, n: members.len() })
        };
        (0..n_groups).filter_map(group).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_is_in_one_group_and_few_have_one_of_their_own() {
        let numbers: Vec<usize> = (1..=100).filter(|number| number % 7 != 0).collect();
        let alone = |number: &usize| Neighbours { first: *number, last: *number, n: 1 };
        assert_eq!(Neighbours::of(&numbers, 100), numbers.iter().map(alone).collect::<Vec<_>>());
        let groups = Neighbours::of(&numbers, 10);
        assert_eq!(groups.iter().map(|group| group.n).sum::<usize>(), numbers.len());
        assert!(groups.iter().all(|group| (8..=9).contains(&group.n)), "{groups:?}");
        assert!(groups.windows(2).all(|pair| pair[0].last < pair[1].first), "{groups:?}");
        assert!(Neighbours::of(&[], 10).is_empty());
    }
}
