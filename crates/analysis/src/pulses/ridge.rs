//! Ridges: humps of neighbouring gaps that one pulse makes on its way.

use super::hump::Hump;

/// Gaps that a ridge must be seen in by itself.
pub(crate) const MIN_GAPS: usize = 3;
/// Gaps in a row that a link may pass over, where humps merge or nothing was filmed, and one.
const MOST_STEPS: usize = 6;
/// What each gap passed over costs, in gaps seen.
const PASSED_OVER: f64 = 0.25;
/// Change of size from one gap to the next that no pulse shows, as a factor.
const RESIZED: f64 = 2.5;
/// Change of speed from one gap to the next that no pulse shows, as a factor.
const BENT: f64 = 1.6;
/// Time from gap to gap over the time that a hump lasts at most: no pulse of a lattice is narrower than half a gap.
const NARROWEST: f64 = 2.0;

/// Which way a pulse runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Direction {
    /// From the first gap to the last.
    Down,
    /// Back.
    Up,
}

impl Direction {
    /// Along x or against it.
    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::Down => 1.0,
            Self::Up => -1.0,
        }
    }

    /// The name in tables.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Down => "down",
            Self::Up => "up",
        }
    }

    /// How many gaps this way from one to another; none where it is the other way.
    fn steps(self, from: usize, to: usize) -> Option<usize> {
        match self {
            Self::Down => to.checked_sub(from),
            Self::Up => from.checked_sub(to),
        }
        .filter(|steps| *steps > 0)
    }
}

/// Humps in the order in which a pulse makes them, by their numbers.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ridge {
    pub(crate) direction: Direction,
    pub(crate) humps: Vec<usize>,
}

/// Two humps that one pulse may make one after the other.
#[derive(Debug, Clone, Copy)]
struct Link {
    from: usize,
    to: usize,
    /// Time from gap to gap.
    slowness_s: f64,
    cost: f64,
}

/// A link with the best chain of links that leads to it.
#[derive(Debug, Clone, Copy)]
struct Reached {
    worth: f64,
    before: Option<usize>,
}

/// The ridges, in the order of their beginnings. Each time the chain of humps is taken that is worth the most: a hump that no
/// ridge has counts one, less what sizes and speeds change by (the best path in a graph without circles; S. Dasgupta, C. Papadimitriou,
/// U. Vazirani, Algorithms (2006), 6.1). Pulses that pass through each other share the humps in which they are one.
pub(crate) fn ridges(humps: &[Hump]) -> Vec<Ridge> {
    let graphs = [Direction::Down, Direction::Up].map(|direction| (direction, links(humps, direction)));
    let mut is_taken = vec![false; humps.len()];
    let mut found: Vec<Ridge> = Vec::new();
    loop {
        let best = graphs
            .iter()
            .filter_map(|(direction, links)| {
                let (worth, chain) = best_chain(links, &is_taken)?;
                Some((worth, Ridge { direction: *direction, humps: chain }))
            })
            .reduce(|one, other| if other.0 > one.0 { other } else { one });
        let Some((_, mut ridge)) = best else { break };
        let n_own = ridge.humps.iter().filter(|hump| !is_taken[**hump]).count();
        if n_own < MIN_GAPS {
            break;
        }
        let is_own = |hump: &usize| !is_taken[*hump];
        let first = ridge.humps.iter().position(is_own).unwrap_or(0);
        let last = ridge.humps.iter().rposition(is_own).unwrap_or(0);
        ridge.humps = ridge.humps[first..=last].to_vec();
        ridge.humps.iter().for_each(|hump| is_taken[*hump] = true);
        found.push(ridge);
    }
    found.sort_by(|one, other| humps[one.humps[0]].t_s.total_cmp(&humps[other.humps[0]].t_s));
    found
}

/// All links that run one way, those from earlier humps first.
fn links(humps: &[Hump], direction: Direction) -> Vec<Link> {
    let mut in_time: Vec<usize> = (0..humps.len()).collect();
    in_time.sort_by(|one, other| humps[*one].t_s.total_cmp(&humps[*other].t_s));
    let mut of_gap: Vec<Vec<usize>> =
        vec![Vec::new(); humps.iter().map(|hump| hump.gap + 1).max().unwrap_or(0)];
    in_time.iter().for_each(|index| of_gap[humps[*index].gap].push(*index));
    let mut links = Vec::new();
    for from in in_time {
        let here = humps[from];
        let gaps = here.gap.saturating_sub(MOST_STEPS)..=here.gap + MOST_STEPS;
        let reachable = gaps.filter_map(|gap| of_gap.get(gap)).flatten();
        links.extend(reachable.filter_map(|to| link(humps, direction, from, *to)));
    }
    links
}

fn link(humps: &[Hump], direction: Direction, from: usize, to: usize) -> Option<Link> {
    let (here, there) = (humps[from], humps[to]);
    let steps = direction.steps(here.gap, there.gap)? as f64;
    let slowness_s = (there.t_s - here.t_s) / steps;
    let longest_s = NARROWEST * here.span_s.max(there.span_s);
    let resized = (there.size / here.size).ln() / RESIZED.ln();
    let is_one = here.sense == there.sense && slowness_s > 0.0 && slowness_s < longest_s;
    let cost = resized * resized + PASSED_OVER * (steps - 1.0);
    (is_one && resized.abs() < 1.0).then_some(Link { from, to, slowness_s, cost })
}

/// The chain of humps that is worth the most, with its worth.
fn best_chain(links: &[Link], is_taken: &[bool]) -> Option<(f64, Vec<usize>)> {
    let worth = |hump: usize| if is_taken[hump] { 0.0 } else { 1.0 };
    let mut to_hump: Vec<Vec<usize>> = vec![Vec::new(); is_taken.len()];
    let mut reached: Vec<Reached> = Vec::with_capacity(links.len());
    for (index, link) in links.iter().enumerate() {
        let alone = Reached { worth: worth(link.from), before: None };
        let joined = to_hump[link.from].iter().filter_map(|before| {
            let bent = (link.slowness_s / links[*before].slowness_s).ln() / BENT.ln();
            let worth = reached[*before].worth - bent * bent;
            (bent.abs() < 1.0).then_some(Reached { worth, before: Some(*before) })
        });
        let best = joined.fold(alone, |best, next| if next.worth > best.worth { next } else { best });
        reached.push(Reached { worth: best.worth + worth(link.to) - link.cost, ..best });
        to_hump[link.to].push(index);
    }
    let best = (0..links.len())
        .reduce(|one, other| if reached[other].worth > reached[one].worth { other } else { one })?;
    let mut chain = vec![links[best].to];
    let mut at = Some(best);
    while let Some(index) = at {
        chain.push(links[index].from);
        at = reached[index].before;
    }
    chain.reverse();
    Some((reached[best].worth, chain))
}
