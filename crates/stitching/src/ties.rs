use crate::merge::{MAX_ROUNDS, Stitch};

impl Stitch<'_> {
    /// What the reader should know of an alignment that took so many rounds.
    pub(crate) fn warnings(&self, rounds: usize) -> Vec<String> {
        let mut warnings = Vec::new();
        if rounds == MAX_ROUNDS {
            warnings.push(format!("the alignment of trials had not settled after {MAX_ROUNDS} rounds"));
        }
        let groups = self.tied_groups();
        let main = groups.iter().max_by_key(|group| group.len()).cloned().unwrap_or_default();
        for group in groups.iter().filter(|group| **group != main) {
            let names: Vec<&str> = group.iter().map(|r| self.observations[*r].recording.as_str()).collect();
            warnings.push(format!(
                "{} share no body with the other recordings: their time base rests on the trigger alone",
                names.join(", ")
            ));
        }
        warnings
    }

    /// Recordings tied to each other through bodies that both saw.
    fn tied_groups(&self) -> Vec<Vec<usize>> {
        let rows = |r: usize| self.displacements[r].iter().map(|displacement| displacement.row);
        let mut group: Vec<usize> = (0..self.observations.len()).collect();
        for a in 0..group.len() {
            for b in 0..a {
                if group[a] != group[b] && rows(a).any(|row| rows(b).any(|other| other == row)) {
                    let (from, to) = (group[a].max(group[b]), group[a].min(group[b]));
                    group.iter_mut().filter(|label| **label == from).for_each(|label| *label = to);
                }
            }
        }
        let members = |label: usize| (0..group.len()).filter(|r| group[*r] == label).collect::<Vec<_>>();
        (0..group.len()).map(members).filter(|group| !group.is_empty()).collect()
    }
}
