//! A cubic through measured points of force over overlap that goes to and fro with them alone (Fritsch and Butland).

use std::sync::Arc;

use crate::{check, error::MechanicsError};

/// A curve through measured points of overlap and force, with a continuous slope.
///
/// Between points it is the cubic that has F. N. Fritsch and J. Butland's slopes there (SIAM J. Sci. Stat. Comput. 5
/// (1984) 300-304), which never overshoots: it rises and falls as the points do, and where they turn, as those of a bistable contact,
/// it is level. Beyond the last point, and in tension before the first, it goes on along its
/// tangent. The force is counted from its value at zero overlap, which the points must enclose, so that a chain at rest
/// rests.
#[derive(Debug, Clone, PartialEq)]
pub struct TableLaw {
    /// Shared, for a chain holds one law for each of its gaps.
    pieces: Arc<[CubicPiece]>,
    /// Where each of them starts, side by side for the search.
    starts_m: Arc<[f64]>,
}

/// Pieces up to which all starts are compared: no branch is to be foreseen, which costs less than halving.
const FEW_PIECES: usize = 32;

/// One piece of the curve: the cubic in the distance from its start.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CubicPiece {
    start_m: f64,
    /// Coefficients of the force, lowest power first.
    force: [f64; 4],
    /// Energy where the piece starts, in joules, counted from zero overlap.
    energy_j: f64,
}

/// What the points of a curve are called in a refusal.
struct Names {
    x: &'static str,
    table: &'static str,
    forces: &'static str,
    points: &'static str,
}

const OF_CONTACTS: Names = Names {
    x: "overlap",
    table: "contact table",
    forces: "forces of the contact table",
    points: "points of the contact table",
};
const OF_GROUND: Names = Names {
    x: "displacement",
    table: "ground table",
    forces: "forces of the ground table",
    points: "points of the ground table",
};

impl TableLaw {
    /// The curve through points of increasing overlap (metres) and their force (newtons).
    ///
    /// # Errors
    /// [`MechanicsError::Length`] for lists of unequal length or fewer than three points, [`MechanicsError::NotPhysical`]
    /// for a value that is not finite, overlaps that do not increase or do not enclose zero, or a force that does not increase there: a
    /// chain at rest would not stay so.
    pub fn new(overlap_m: &[f64], force_n: &[f64]) -> Result<Self, MechanicsError> {
        Self::named([overlap_m, force_n], &OF_CONTACTS)
    }

    /// The same curve of what holds a body to ground: a force (newtons) against its displacement (metres).
    ///
    /// # Errors
    /// As for [`TableLaw::new`].
    pub fn of_ground(displacement_m: &[f64], force_n: &[f64]) -> Result<Self, MechanicsError> {
        Self::named([displacement_m, force_n], &OF_GROUND)
    }

    fn named([x_m, force_n]: [&[f64]; 2], names: &Names) -> Result<Self, MechanicsError> {
        let Names { x, table, forces, points } = names;
        check::length(forces, x_m.len(), force_n.len())?;
        check::length(points, x_m.len().max(3), x_m.len())?;
        for (name, values) in [(*x, x_m), ("force", force_n)] {
            for (i, &value) in values.iter().enumerate() {
                check::finite(format!("{name} of point {} of the {table}", i + 1), value)?;
            }
        }
        for (i, pair) in x_m.windows(2).enumerate() {
            let quantity = format!("{x} of point {} of the {table}", i + 2);
            check::require(pair[1] > pair[0], quantity, "more than at the point before", pair[1])?;
        }
        let encloses = x_m[0] <= 0.0 && x_m[x_m.len() - 1] > 0.0;
        check::require(encloses, format!("first {x} of the {table}"), "points around 0", x_m[0])?;
        let law = Self::through(x_m, force_n);
        check::positive(format!("stiffness of the {table} at zero {x}"), law.stiffness_n_per_m(0.0))?;
        Ok(law)
    }

    /// Force in newtons at an overlap, or a displacement, in metres.
    pub fn force_n(&self, x_m: f64) -> f64 {
        self.force_alone_n(x_m)
    }

    /// Energy in joules at an overlap, or a displacement, in metres; none at zero.
    pub fn energy_j(&self, x_m: f64) -> f64 {
        self.evaluate(x_m).1
    }

    /// The first and the last of its points' overlaps, or displacements, in metres; beyond them the curve goes on along its tangents.
    pub fn range_m(&self) -> [f64; 2] {
        [self.starts_m[0], self.starts_m[self.starts_m.len() - 1]]
    }

    fn through(x: &[f64], f: &[f64]) -> Self {
        let slopes = monotone_slopes(x, f);
        let mut pieces: Vec<CubicPiece> = (0..x.len() - 1)
            .map(|i| {
                let h = x[i + 1] - x[i];
                let chord = (f[i + 1] - f[i]) / h;
                let (left, right) = (slopes[i], slopes[i + 1]);
                let square = (3.0 * chord - 2.0 * left - right) / h;
                let cube = (left + right - 2.0 * chord) / (h * h);
                CubicPiece { start_m: x[i], force: [f[i], left, square, cube], energy_j: 0.0 }
            })
            .collect();
        let last = x.len() - 1;
        pieces.push(CubicPiece { start_m: x[last], force: [f[last], slopes[last], 0.0, 0.0], energy_j: 0.0 });
        let mut law = Self { pieces: pieces.into(), starts_m: x.into() };
        let zero_n = law.evaluate(0.0).0;
        law.shift(zero_n);
        law
    }

    /// The curve with so many times the force.
    #[must_use]
    pub fn times(&self, factor: f64) -> Self {
        let piece = |piece: &CubicPiece| CubicPiece {
            force: piece.force.map(|coefficient| factor * coefficient),
            energy_j: factor * piece.energy_j,
            ..*piece
        };
        Self { pieces: self.pieces.iter().map(piece).collect(), ..self.clone() }
    }

    /// Counts the force from `zero_n` and the energy from zero overlap.
    fn shift(&mut self, zero_n: f64) {
        let mut pieces = self.pieces.to_vec();
        for piece in &mut pieces {
            piece.force[0] -= zero_n;
        }
        for i in 1..pieces.len() {
            let before = pieces[i - 1];
            pieces[i].energy_j = before.evaluate(pieces[i].start_m).1;
        }
        self.pieces = pieces.into();
        let zero_j = self.evaluate(0.0).1;
        self.pieces =
            self.pieces.iter().map(|p| CubicPiece { energy_j: p.energy_j - zero_j, ..*p }).collect();
    }

    /// Force in newtons and energy in joules at an overlap in metres.
    pub(crate) fn evaluate(&self, overlap_m: f64) -> (f64, f64) {
        let first = &self.pieces[0];
        if overlap_m < self.first_m() {
            let tangent = CubicPiece { force: [first.force[0], first.force[1], 0.0, 0.0], ..*first };
            return tangent.evaluate(overlap_m);
        }
        self.piece_at(overlap_m).evaluate(overlap_m)
    }

    /// Force alone, with the bits of [`TableLaw::evaluate`].
    pub(crate) fn force_alone_n(&self, overlap_m: f64) -> f64 {
        if overlap_m < self.first_m() {
            let [c, linear, ..] = self.pieces[0].force;
            return c + (overlap_m - self.first_m()) * linear;
        }
        self.piece_at(overlap_m).force_n(overlap_m)
    }

    /// Overlap of the first point, in metres.
    pub(crate) fn first_m(&self) -> f64 {
        self.pieces[0].start_m
    }

    /// Slope in newtons per metre at an overlap.
    pub fn stiffness_n_per_m(&self, overlap_m: f64) -> f64 {
        if overlap_m < self.first_m() {
            return self.pieces[0].force[1];
        }
        self.piece_at(overlap_m).slope(overlap_m)
    }

    /// The largest slope, up or down, between two overlaps: at an end of the range, at a point, or at a piece's middle turn. Where the force
    /// falls nothing oscillates, and motions grow as fast as they would turn on a slope as steep that rises.
    pub(crate) fn stiffest_n_per_m(&self, least_m: f64, most_m: f64) -> f64 {
        let ends = [least_m, most_m].map(|x| self.stiffness_n_per_m(x).abs()).into_iter();
        let inner = self.pieces.iter().flat_map(|piece| {
            let turn = piece.start_m - piece.force[2] / (3.0 * piece.force[3]);
            [piece.start_m, turn].map(|x| (x, piece.slope(x)))
        });
        let reached =
            inner.filter(|(x, _)| *x > least_m && *x < most_m).map(|(x, _)| self.stiffness_n_per_m(x).abs());
        ends.chain(reached).fold(0.0, f64::max)
    }

    /// Overlaps between two others at which the energy has a maximum: where the force falls through zero, as on the barrier of a bistable curve.
    pub(crate) fn barriers_m(&self, least_m: f64, most_m: f64) -> impl Iterator<Item = f64> {
        let falls = self.pieces.windows(2).filter_map(|pair| {
            let (piece, end_m, after_n) = (&pair[0], pair[1].start_m, pair[1].force[0]);
            (piece.force[0] > 0.0 && after_n <= 0.0).then(|| piece.falls_through_zero_m(end_m))
        });
        falls.filter(move |x_m| (least_m..most_m).contains(x_m))
    }

    /// Whether it pulls at some overlap above zero.
    pub(crate) fn pulls_in_compression(&self) -> bool {
        let last = &self.pieces[self.pieces.len() - 1];
        // Between two points it goes from one force to the other and no farther.
        last.force[1] < 0.0 || self.pieces.iter().any(|piece| piece.start_m > 0.0 && piece.force[0] < 0.0)
    }

    /// The end of the points that the overlaps of a range pass though the force falls away beyond it, if there is one: along the tangent it
    /// falls for ever, and what is there does not come back.
    pub(crate) fn fallen_off_m(&self, least_m: f64, most_m: f64) -> Option<f64> {
        let [first, last] = [&self.pieces[0], &self.pieces[self.pieces.len() - 1]];
        let ends = [(least_m < first.start_m, first), (most_m > last.start_m, last)];
        ends.into_iter().find(|(passed, end)| *passed && end.force[1] < 0.0).map(|(_, end)| end.start_m)
    }

    /// The largest slope, up or down, anywhere.
    pub(crate) fn steepest_n_per_m(&self) -> f64 {
        let last_m = self.pieces[self.pieces.len() - 1].start_m;
        self.stiffest_n_per_m(self.first_m(), last_m)
    }

    fn piece_at(&self, overlap_m: f64) -> &CubicPiece {
        let after = match self.starts_m.len() <= FEW_PIECES {
            true => self.starts_m.iter().map(|start_m| usize::from(*start_m <= overlap_m)).sum(),
            false => self.starts_m.partition_point(|start_m| *start_m <= overlap_m),
        };
        &self.pieces[after.saturating_sub(1)]
    }
}

impl CubicPiece {
    fn evaluate(&self, overlap_m: f64) -> (f64, f64) {
        let s = overlap_m - self.start_m;
        let [c, linear, square, cube] = self.force;
        let force = self.force_n(overlap_m);
        let energy = self.energy_j + s * (c + s * (linear / 2.0 + s * (square / 3.0 + s * cube / 4.0)));
        (force, energy)
    }

    fn force_n(&self, overlap_m: f64) -> f64 {
        let s = overlap_m - self.start_m;
        let [c, linear, square, cube] = self.force;
        c + s * (linear + s * (square + s * cube))
    }

    /// Where the force of a piece that falls from above zero to below it is zero.
    fn falls_through_zero_m(&self, end_m: f64) -> f64 {
        let (mut above_m, mut below_m) = (self.start_m, end_m);
        loop {
            let middle_m = 0.5 * (above_m + below_m);
            if middle_m <= above_m || middle_m >= below_m {
                return above_m;
            }
            if self.force_n(middle_m) > 0.0 { above_m = middle_m } else { below_m = middle_m }
        }
    }

    fn slope(&self, overlap_m: f64) -> f64 {
        let s = overlap_m - self.start_m;
        self.force[1] + s * (2.0 * self.force[2] + 3.0 * s * self.force[3])
    }
}

/// Slopes at the points: the weighted harmonic mean of the chords beside a point, none where these turn; at the ends the chord's own.
fn monotone_slopes(x: &[f64], f: &[f64]) -> Vec<f64> {
    let h = |i: usize| x[i + 1] - x[i];
    let chord = |i: usize| (f[i + 1] - f[i]) / h(i);
    let n = x.len();
    (0..n)
        .map(|i| match i {
            0 => chord(0),
            _ if i == n - 1 => chord(n - 2),
            _ if chord(i - 1) * chord(i) <= 0.0 => 0.0,
            _ => {
                let (w_1, w_2) = (2.0 * h(i) + h(i - 1), h(i) + 2.0 * h(i - 1));
                (w_1 + w_2) / (w_1 / chord(i - 1) + w_2 / chord(i))
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::power::PowerLaw;

    fn samples_of(law: &PowerLaw, n: usize) -> TableLaw {
        let x: Vec<f64> = (0..=n).map(|i| -1e-3 + 9e-3 * i as f64 / n as f64).collect();
        let f: Vec<f64> = x.iter().map(|&x| law.force_n(x)).collect();
        TableLaw::new(&x, &f).unwrap()
    }

    #[test]
    fn the_curve_approaches_the_law_that_it_samples() {
        let law = PowerLaw::ELLIPTICAL_RING;
        let error = |n: usize| {
            let table = samples_of(&law, n);
            let overlaps = (1..70).map(|i| 1e-4 * f64::from(i));
            overlaps.map(|x| (table.evaluate(x).0 - law.force_n(x)).abs()).fold(0.0, f64::max)
        };
        // Fritsch and Butland's slopes are those of the curve up to the square of the distance, so the error falls with
        // its third power; the force is up to 5 N.
        assert!(error(100) < 1e-3);
        assert!(error(100) / error(200) > 6.0);
    }

    #[test]
    fn the_curve_is_monotone_and_its_energy_is_the_integral() {
        // A step that a plain cubic spline would overshoot.
        let table = TableLaw::new(&[-1e-3, 0.0, 1e-3, 1.1e-3, 3e-3], &[-1.0, 0.0, 0.1, 2.0, 2.1]).unwrap();
        let h = 1e-8;
        for i in -200..400 {
            let x = 1e-5 * f64::from(i) + 3e-7;
            let (force, _) = table.evaluate(x);
            let slope = (table.evaluate(x + h).0 - table.evaluate(x - h).0) / (2.0 * h);
            assert!(slope >= 0.0 && slope <= table.stiffest_n_per_m(x - h, x + h) * (1.0 + 1e-6));
            let power = (table.evaluate(x + h).1 - table.evaluate(x - h).1) / (2.0 * h);
            // Central differences: the third derivative of the energy times h^2 / 6, and rounding.
            assert!((power - force).abs() < 1e-6, "{x} {power} {force}");
        }
        assert!(table.evaluate(0.0) == (0.0, 0.0));
    }

    #[test]
    fn a_bistable_curve_turns_at_its_points_alone_and_books_its_energy() {
        // Snaps through between 2 and 4 mm, and rests again at 5 mm.
        let points = [(0.0, 0.0), (1e-3, 0.8), (2e-3, 1.0), (4e-3, -0.5), (5e-3, 0.0), (6e-3, 1.5)];
        let (x, f): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
        let table = TableLaw::new(&x, &f).unwrap();
        let force = |x: f64| table.evaluate(x).0;
        let (mut sum_j, n) = (0.0, 6000);
        let step_m = 6e-3 / f64::from(n);
        for i in 0..n {
            let [left, right] = [i, i + 1].map(|i| step_m * f64::from(i));
            // Between two points the curve goes from one force to the other and no farther.
            let piece = points.windows(2).find(|pair| right <= pair[1].0 + 1e-12).unwrap();
            let (low, high) = (piece[0].1.min(piece[1].1), piece[0].1.max(piece[1].1));
            assert!((low - 1e-9..=high + 1e-9).contains(&force(right)), "{right}: {}", force(right));
            // The slope bounds what the step may do.
            let steepest = table.stiffest_n_per_m(left, right);
            assert!((force(right) - force(left)).abs() <= steepest * step_m * (1.0 + 1e-6) + 1e-12);
            // Simpson's rule is exact for the cubic pieces, whose joints lie on the grid.
            sum_j += step_m / 6.0 * (force(left) + 4.0 * force(0.5 * (left + right)) + force(right));
            assert!((table.evaluate(right).1 - sum_j).abs() < 1e-13, "{right}");
        }
        for (x, f) in points {
            assert!((force(x) - f).abs() < 1e-12);
        }
        for x in (-300..900).map(|i| 1e-5 * f64::from(i)) {
            assert_eq!(table.force_alone_n(x).to_bits(), force(x).to_bits(), "{x}");
        }
        // The barrier lies where the force falls through zero, the second well where it rises through it.
        let well = table.evaluate(5e-3).1;
        assert!(well < table.evaluate(3.2e-3).1 && well < table.evaluate(6e-3).1);
        let energies = (0..=50_000).map(|i| table.evaluate(1e-7 * f64::from(i)).1);
        let highest = energies.fold(0.0, f64::max);
        let barriers: Vec<f64> = table.barriers_m(0.0, 5e-3).map(|x| table.evaluate(x).1).collect();
        // Next to the barrier, no farther than 0.1 um, the energy is lower by half the slope times the square of that: 1e-11 J.
        assert!(
            barriers.len() == 1 && (0.0..1e-11).contains(&(barriers[0] - highest)),
            "{barriers:?} {highest}"
        );
        assert_eq!(table.barriers_m(0.0, 3e-3).count(), 0);
        assert!(table.pulls_in_compression());
        assert!(!samples_of(&PowerLaw::ELLIPTICAL_RING, 20).pulls_in_compression());
    }

    #[test]
    fn points_that_make_no_curve_are_refused_by_name() {
        let refused = |x: &[f64], f: &[f64]| TableLaw::new(x, f).unwrap_err().to_string();
        assert!(refused(&[0.0, 1.0], &[0.0, 1.0]).contains("expected 3 entries, found 2"));
        assert!(refused(&[0.0, 1.0, 1.0], &[0.0, 1.0, 2.0]).starts_with("overlap of point 3"));
        assert!(refused(&[0.0, 1.0, 2.0], &[0.0, f64::NAN, 0.5]).starts_with("force of point 2"));
        // At rest the chain must be stable: what falls around zero overlap holds no body.
        assert!(refused(&[-1.0, 0.0, 1.0], &[1.0, 0.0, -1.0]).starts_with("stiffness"));
        assert!(refused(&[0.1, 1.0, 2.0], &[0.0, 1.0, 2.0]).contains("points around 0"));
    }
}
