//! Recordings under the name of another view: at rest they show the markers of its bodies, not those that their own view's other
//! recordings show.

use std::num::NonZero;

use chainwave_correlation::Method;
use chainwave_measurement::map_in_parallel;

use super::resting::Resting;
use super::same_markers::same_markers;
use crate::configuration::Trial;
use crate::finding::{Finding, Sanity};
use crate::setup::Setup;
use crate::wording::named;

/// Recordings of one view by what they show at rest.
struct View<'a> {
    /// Those that show the same, the most first.
    groups: Vec<Vec<&'a Resting>>,
}

impl<'a> View<'a> {
    /// Each recording joins the first group whose first recording shows the same; one that cannot be compared, the first of all.
    fn of(method: Method, recordings: &'a [Resting]) -> Self {
        let mut groups: Vec<Vec<&Resting>> = Vec::new();
        for recording in recordings {
            let shows_the_same =
                |group: &&mut Vec<&Resting>| same_markers(method, group[0], recording).unwrap_or(true);
            match groups.iter_mut().find(shows_the_same) {
                Some(group) => group.push(recording),
                None => groups.push(vec![recording]),
            }
        }
        // Sorting keeps the order of groups of one size.
        groups.sort_by_key(|group| std::cmp::Reverse(group.len()));
        Self { groups }
    }

    /// A recording of most of them, where there are more of these than of any others.
    fn usual(&self) -> Option<&'a Resting> {
        let second = self.groups.get(1).map_or(0, Vec::len);
        self.groups.first().filter(|group| group.len() > second).map(|group| group[0])
    }
}

/// Leaves out recordings that show what most of another view's recordings show and not what most of their own view's do. Where that is not told
/// (another specimen, other markers, as many of the one as of the other) nothing is left out, and it is said.
pub(super) fn mislabelled(
    setup: &Setup,
    resting: &[Vec<Resting>],
    n_threads: NonZero<usize>,
    sanity: &mut Sanity,
) {
    let method = setup.method();
    let views = map_in_parallel(resting.len(), n_threads, |index| View::of(method, &resting[index]));
    for view in &views {
        let Some(first) = view.groups.first().map(|group| &group[0].trial) else { continue };
        for others in &view.groups[1..] {
            let mut of_others =
                views.iter().filter_map(View::usual).filter(|usual| !usual.trial.is_of_one_place_with(first));
            let recording = &others[0].trial.recording;
            // Where the other view's stage stood, its bodies stand.
            let shows = |usual: &&Resting| {
                let there = Trial { recording: recording.clone(), ..usual.trial.clone() };
                same_markers(method, usual, &Resting::of(setup, &there)) == Some(true)
            };
            let others: Vec<Trial> = others.iter().map(|one| one.trial.clone()).collect();
            let of_other = of_others.find(shows);
            match of_other.filter(|_| view.usual().is_some()) {
                Some(Resting { trial: other, .. }) => {
                    let why = format!(
                        "at rest it shows the bodies of view {} (stage at {} m), as {} does, and not those of the other recordings of view {} (hint: is \
                         the row of trials.csv under the right name?)",
                        other.view, other.stage_m, other.recording, first.view
                    );
                    sanity.leave_out(&others, &why);
                }
                None => sanity.findings.push(Finding {
                    code: "other_bodies",
                    subject: names(&others),
                    text: format!(
                        "at rest no body looks as it does in {} of the same view (hint: is it under the right name, is it the same chain?)",
                        first.recording
                    ),
                }),
            }
        }
    }
}

fn names(trials: &[Trial]) -> String {
    named(&trials.iter().map(|trial| trial.recording.as_str()).collect::<Vec<_>>())
}
