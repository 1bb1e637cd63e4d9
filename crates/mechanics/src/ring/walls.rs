//! Contact of a ring's walls with each other.

use super::section::Ring;

/// Shortening of a ring, over its length, below which no walls far from each other are looked at: a ring whose poles are
/// farther apart than three quarters of their distance at rest cannot have its left touch its right.
const SHORTENING: f64 = 0.25;

/// Distance of a half ring's poles along the chain.
fn pole_distance_m(nodes: &[[f64; 2]]) -> f64 {
    nodes[nodes.len() - 1][0] - nodes[0][0]
}

/// Where a half ring's wall stands, to see what it touches.
#[derive(Debug, Clone)]
pub(crate) struct Walls {
    /// Places at rest.
    nodes_m: Vec<[f64; 2]>,
    /// Distance from the axis of each inner node at rest; infinite where the wall's own thickness reaches it.
    pub(crate) inner_far_m: Vec<f64>,
    wall_m: f64,
}

impl Walls {
    /// The walls of a half ring whose nodes stand there at rest.
    pub(crate) fn new(ring: &Ring, nodes_m: Vec<[f64; 2]>) -> Self {
        let wall_m = ring.wall_m;
        let far_m = |node: &[f64; 2]| if node[1] > wall_m { node[1] } else { f64::INFINITY };
        let inner_far_m = nodes_m[1..nodes_m.len() - 1].iter().map(far_m).collect();
        Self { nodes_m, inner_far_m, wall_m }
    }

    /// Puts the places of nodes that moved as given.
    pub(crate) fn put_places(
        &self,
        places_m: &mut Vec<[f64; 2]>,
        displacement_m: impl Fn(usize) -> [f64; 2],
    ) {
        places_m.clear();
        places_m.extend(self.nodes_m.iter().enumerate().map(|(node, rest_m)| {
            let moved_m = displacement_m(node);
            [rest_m[0] + moved_m[0], rest_m[1] + moved_m[1]]
        }));
    }

    /// Whether two parts of the wall that were apart by more than twice its thickness are now nearer than that, or a part
    /// meets its mirror image.
    pub(crate) fn touch(&self, places_m: &[[f64; 2]]) -> bool {
        let n = places_m.len();
        let meets_image = |i: usize| self.nodes_m[i][1] > self.wall_m && places_m[i][1] < self.image_m();
        (1..n - 1).any(meets_image) || (self.is_short(places_m) && self.sides_touch(places_m))
    }

    /// Distance from the axis at which a wall meets its image.
    pub(crate) fn image_m(&self) -> f64 {
        0.5 * self.wall_m
    }

    /// Whether sides that far apart at rest may touch where the poles have come so much nearer to each other. A rounding early is soon
    /// enough.
    pub(crate) fn is_shortened_by(&self, shortening_m: f64) -> bool {
        shortening_m > 0.999 * SHORTENING * pole_distance_m(&self.nodes_m)
    }

    fn is_short(&self, places_m: &[[f64; 2]]) -> bool {
        pole_distance_m(places_m) < (1.0 - SHORTENING) * pole_distance_m(&self.nodes_m)
    }

    fn sides_touch(&self, places_m: &[[f64; 2]]) -> bool {
        let near = |a: [f64; 2], b: [f64; 2], reach_m: f64| (a[0] - b[0]).hypot(a[1] - b[1]) < reach_m;
        let n = places_m.len();
        let meets = |i: usize, j: usize| {
            near(places_m[i], places_m[j], self.wall_m)
                && !near(self.nodes_m[i], self.nodes_m[j], 2.0 * self.wall_m)
        };
        (0..n).any(|i| (i + 1..n).any(|j| meets(i, j)))
    }

    /// Whether the wall beside the first pole stands out beyond it.
    pub(crate) fn stands_out(&self, places_m: &[[f64; 2]]) -> bool {
        places_m.iter().skip(1).any(|place| place[0] < places_m[0][0])
    }
}
