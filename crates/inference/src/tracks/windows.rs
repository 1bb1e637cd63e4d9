//! The motion's derivatives from one part of the time to the next, so that they are never held over all of it.
//!
//! There may be as many unknowns as bodies, and a longer chain is filmed for longer: all derivatives of all bodies at all times would grow with
//! the cube of the chain's length. Over a short time they grow with its square, as the equations do that are made of them.

use std::num::NonZero;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use chainwave_measurement::map_in_parallel;
use chainwave_mechanics::{Change, Kept, MechanicsError, ReferenceMotion, Replay, Stretch, Variations};

use super::family::{DERIVATIVE_NODES, Family, N_DERIVATIVE_NODES, Struck};
use super::samples::Samples;
use crate::steps::DERIVATIVES_TOGETHER;

/// The chain a step below and a step above in one unknown.
pub(super) struct Sides {
    pub(super) below: Struck,
    pub(super) above: Struck,
    pub(super) width: f64,
}

/// The derivatives over a part of the time.
pub(super) struct Window {
    /// The outputs; the last one is the first one of the window behind.
    pub(super) outputs: Range<usize>,
    /// Whether none follows.
    is_last: bool,
    /// By each unknown that is asked for, at each node.
    pub(super) derivatives: Vec<[Samples; N_DERIVATIVE_NODES]>,
}

/// Samples that are held at once where that allows for windows that are long enough: 64 MB.
const HELD: usize = 1 << 22;
/// Outputs of a window at least, some frames: fewer would cost more to join than to solve. Of 1000 bodies and as many masses
/// these would be 770 MB, of the 320 that a hypothesis has at most 250 MB.
const SHORTEST: usize = 16;

/// Outputs of a window of derivatives of so many bodies by so many unknowns.
pub(super) fn n_outputs(n_unknowns: usize, n_bodies: usize) -> usize {
    (HELD / (n_unknowns * N_DERIVATIVE_NODES * n_bodies).max(1)).max(SHORTEST)
}

/// What is kept of the motion at a node of a family: its steps where derivatives go along it.
pub(super) fn kept_of_node(node: usize, with_derivatives: bool) -> Kept {
    if with_derivatives && DERIVATIVE_NODES.contains(&node) { Kept::Steps } else { Kept::Outputs }
}

/// The changes of a chain at the nodes of a family, as many together as go through one integration.
pub(super) fn changes_of(sides: &[Sides], family: &Family) -> Vec<Vec<Change>> {
    let of_node = |node: usize| {
        let change = move |sides: &Sides| Change {
            below: family.struck(node, &sides.below),
            above: family.struck(node, &sides.above),
            width: sides.width,
        };
        sides.chunks(DERIVATIVES_TOGETHER).map(move |together| together.iter().map(change).collect())
    };
    DERIVATIVE_NODES.into_iter().flat_map(of_node).collect()
}

impl Window {
    /// All of the time, without derivatives.
    pub(super) fn whole(n_outputs: usize) -> Self {
        Self { outputs: 0..n_outputs, is_last: true, derivatives: Vec::new() }
    }

    /// The frames whose motion the window tells, of those behind some outputs; the first window has also those before the impact, the last one
    /// those at its end and behind it.
    pub(super) fn frames(&self, outputs_before: &[usize]) -> Range<usize> {
        let until = |output: usize| outputs_before.partition_point(|before| *before < output);
        let end = if self.is_last { outputs_before.len() } else { until(self.outputs.end - 1) };
        until(self.outputs.start)..end
    }
}

/// The windows one by one.
pub(super) struct Windows<'a> {
    /// The motion at each node.
    motions: Vec<Mutex<Replay<'a>>>,
    /// Along these, group after group at the first node, then at the others.
    variations: Vec<Mutex<Variations<'a>>>,
    n_outputs: usize,
    /// Of a window.
    length: usize,
    /// Where the next one begins.
    first: usize,
    n_threads: NonZero<usize>,
}

impl<'a> Windows<'a> {
    /// Of the changes at the nodes of a family ([`changes_of`]) along the motions at them, so many outputs each.
    pub(super) fn new(
        motions: &'a [ReferenceMotion<'a>],
        changes: &'a [Vec<Change>],
        length: usize,
        n_threads: NonZero<usize>,
    ) -> Result<Self, MechanicsError> {
        let n_groups = changes.len() / N_DERIVATIVE_NODES;
        let along = |group: usize| {
            let motion = &motions[DERIVATIVE_NODES[group / n_groups]];
            motion.variations(&changes[group], &[]).map(Mutex::new)
        };
        let variations = map_in_parallel(changes.len(), n_threads, along);
        // Without changes nothing goes along the motions.
        let n_nodes = if changes.is_empty() { 0 } else { N_DERIVATIVE_NODES };
        let again = |node: usize| motions[DERIVATIVE_NODES[node]].replay().map(Mutex::new);
        Ok(Self {
            motions: (0..n_nodes).map(again).collect::<Result<_, _>>()?,
            variations: variations.into_iter().collect::<Result<_, _>>()?,
            n_outputs: motions.first().map_or(0, ReferenceMotion::n_outputs),
            length: length.max(2),
            first: 0,
            n_threads,
        })
    }
}

impl Iterator for Windows<'_> {
    type Item = Result<Window, MechanicsError>;

    fn next(&mut self) -> Option<Self::Item> {
        let Self { n_outputs, length, first, n_threads, .. } = *self;
        if first + 1 >= n_outputs {
            return None;
        }
        let last = (first + length - 1).min(n_outputs - 1);
        self.first = last;
        let stretch =
            |node: usize| self.motions[node].lock().unwrap_or_else(PoisonError::into_inner).until(last);
        let stretches = map_in_parallel(self.motions.len(), n_threads, stretch);
        let stretches: Vec<Stretch> = match stretches.into_iter().collect() {
            Ok(stretches) => stretches,
            Err(why) => return Some(Err(why)),
        };
        let n_groups = self.variations.len() / N_DERIVATIVE_NODES;
        let solved = map_in_parallel(self.variations.len(), n_threads, |group| {
            let mut variations = self.variations[group].lock().unwrap_or_else(PoisonError::into_inner);
            let derivatives = variations.along(&stretches[group / n_groups])?;
            Ok(derivatives.iter().map(Samples::of).collect::<Vec<_>>())
        });
        let solved: Result<Vec<Vec<Samples>>, MechanicsError> = solved.into_iter().collect();
        Some(solved.map(|solved| {
            let mut groups = solved.into_iter();
            let mut nodes: [_; N_DERIVATIVE_NODES] = std::array::from_fn(|_| {
                groups.by_ref().take(n_groups).flatten().collect::<Vec<_>>().into_iter()
            });
            let derivatives = std::iter::from_fn(|| {
                let of_nodes: Vec<Samples> = nodes.iter_mut().filter_map(Iterator::next).collect();
                of_nodes.try_into().ok()
            });
            Window {
                outputs: first..last + 1,
                is_last: last + 1 == n_outputs,
                derivatives: derivatives.collect(),
            }
        }))
    }
}

#[cfg(test)]
mod tests {
    use chainwave_mechanics::{Chain, Schedule, Striker};

    use super::super::response::solve;
    use super::*;
    use crate::quantity::Quantity;

    /// Samples that windows of the derivatives by the mass of each body hold at once, and in all, where a chain is filmed for as long as it is.
    fn held(n_bodies: usize) -> (usize, usize) {
        let struck = |body: usize, factor: f64| {
            let (mut chain, mut striker) = (Chain::of_rings(n_bodies), Striker::OF_RINGS);
            Quantity::MassOfBody(body).apply(factor, &mut chain, &mut striker);
            Struck { chain, striker }
        };
        let sides =
            |body: usize| Sides { below: struck(body, 0.9999), above: struck(body, 1.0001), width: 2e-4 };
        let sides: Vec<Sides> = (1..=n_bodies).map(sides).collect();
        let family = Family::new([2.6, 2.87]);
        let (changes, centre) = (changes_of(&sides, &family), struck(1, 1.0));
        let chains: Vec<Chain> = (0..family.n_nodes()).map(|node| family.struck(node, &centre)).collect();
        let n_threads = NonZero::<usize>::MIN;
        let schedule = Schedule::automatic(5e-4 * n_bodies as f64, 2e-5);
        let motions = solve(&chains, &schedule, |_| Kept::Outputs, n_threads).unwrap();
        let windows = Windows::new(&motions, &changes, n_outputs(n_bodies, n_bodies), n_threads).unwrap();
        let n_samples = |window: Result<Window, MechanicsError>| -> usize {
            window.unwrap().derivatives.iter().flatten().map(Samples::len).sum()
        };
        windows.map(n_samples).fold((0, 0), |(most, all), n| (most.max(n), all + n))
    }

    #[test]
    fn what_is_held_at_once_does_not_grow_with_all_derivatives_at_all_times() {
        let ((_, few), (at_once, many)) = (held(20), held(80));
        // Four times the unknowns, bodies and time; windows share their ends.
        assert!(many as f64 > 0.99 * 64.0 * few as f64, "{few} {many}");
        assert!(at_once <= HELD && many > 8 * HELD, "{at_once} of {many}");
        // Of chains so long that windows are shortest it grows as their equations do, of which each recording has the square of the unknowns.
        for n_bodies in [300, 1000] {
            let of_window = n_outputs(n_bodies, n_bodies) * n_bodies * n_bodies * N_DERIVATIVE_NODES;
            assert!(of_window <= HELD.max(SHORTEST * N_DERIVATIVE_NODES * n_bodies * n_bodies));
        }
    }
}
