//! Contact forces and energies of a row of gaps, sorted by law for vectors.

use pulp::Simd;

use super::{
    contacts::{Contact, Law},
    dashpots::Dashpots,
    power_kernel::PowerKernel,
    power_lanes::{PowerColumns, PowerLanes},
    power_table::{Outside, PowerTable, TableLanes},
    spring::Spring,
};
use crate::lanes::Lanes;

/// Vectors of gaps that go through the power law side by side.
const SIDE_BY_SIDE: usize = 2;

/// Gaps that carry nothing whatever their overlap: those of strikers that have left, and the one behind the last mass where no wall is.
pub(crate) type Idle = [Option<usize>; 3];

/// The contacts of a row of gaps, sorted by law so that vectors of gaps share one. Gap `i` lies between masses `i` and
/// `i + 1` of the row.
#[derive(Debug)]
pub(crate) struct Gaps {
    power: PowerGaps,
    springs: Vec<Springs>,
    /// Gaps that follow a table, one by one.
    tables: Vec<(usize, Spring)>,
    /// Where there are any.
    pub(crate) dashpots: Option<Dashpots>,
    /// Overlaps in metres below which the tension rules hold.
    limits_m: Vec<f64>,
}

#[derive(Debug)]
enum PowerGaps {
    None,
    /// The same law, in all gaps or all but those that follow another kind of law.
    Same(Box<PowerTable>),
    Each(PowerColumns),
}

/// Neighbouring gaps with linear springs.
#[derive(Debug)]
struct Springs {
    first: usize,
    k_n_per_m: Vec<f64>,
    /// Overlap in metres at which the spring detaches, or minus infinity.
    least_m: Vec<f64>,
}

impl Gaps {
    /// The gaps with these contacts, in a row padded to a whole number of vectors.
    pub(crate) fn new(contacts: &[&Contact]) -> Self {
        let mut springs: Vec<Springs> = Vec::new();
        let mut tables = Vec::new();
        for (i, contact) in contacts.iter().enumerate() {
            match &contact.law {
                Law::Power(_) => {}
                Law::Table(_) => tables.push((i, contact.spring())),
                Law::Linear(law) => {
                    let joins = springs.last().is_some_and(|run| run.first + run.k_n_per_m.len() == i);
                    if !joins {
                        springs.push(Springs { first: i, k_n_per_m: vec![], least_m: vec![] });
                    }
                    if let Some(run) = springs.last_mut() {
                        run.k_n_per_m.push(law.k_n_per_m);
                        run.least_m.push(contact.limit_m());
                    }
                }
            }
        }
        Self {
            power: PowerGaps::new(contacts),
            springs,
            tables,
            dashpots: Dashpots::of(contacts),
            limits_m: contacts.iter().map(|contact| contact.limit_m()).collect(),
        }
    }

    pub(crate) fn limits_m(&self) -> &[f64] {
        &self.limits_m
    }

    /// Fills `force_n` with the springs' forces of the first gaps, positive in compression, in newtons.
    #[inline(always)]
    pub(crate) fn forces<S: Simd>(&self, simd: S, x_m: &[f64], idle: Idle, force_n: &mut [f64]) {
        match &self.power {
            PowerGaps::None => {}
            PowerGaps::Same(table) => same_power(simd, table, x_m, idle, force_n),
            PowerGaps::Each(columns) => each_power(simd, columns, x_m, force_n),
        }
        for run in &self.springs {
            run.forces(x_m, force_n);
        }
        for (i, spring) in &self.tables {
            if let Some(force) = force_n.get_mut(*i) {
                *force = spring.force_n(x_m[*i] - x_m[i + 1]);
            }
        }
    }

    /// Fills `energy_j` with the potential energy of the first gaps, in joules.
    #[inline(always)]
    pub(crate) fn energies<S: Simd>(&self, simd: S, x_m: &[f64], energy_j: &mut [f64]) {
        match &self.power {
            PowerGaps::None => {}
            PowerGaps::Same(table) => {
                let law = PowerLanes::<S, 1>::splat(simd, table.kernel().columns());
                over_row(
                    simd,
                    0,
                    x_m,
                    energy_j,
                    #[inline(always)]
                    |_, overlap| law.force_and_energy(overlap).1,
                );
            }
            PowerGaps::Each(columns) => {
                over_row(
                    simd,
                    0,
                    x_m,
                    energy_j,
                    #[inline(always)]
                    |first, overlap| columns.lanes::<S, 1>(simd, first).force_and_energy(overlap).1,
                );
            }
        }
        for run in &self.springs {
            run.energies(x_m, energy_j);
        }
        for (i, spring) in &self.tables {
            if let Some(energy) = energy_j.get_mut(*i) {
                *energy = spring.force_and_energy(x_m[*i] - x_m[i + 1]).1;
            }
        }
    }
}

/// The forces of the same law in every gap; `idle` gaps may hold anything.
#[inline(always)]
fn same_power<S: Simd>(simd: S, table: &PowerTable, x_m: &[f64], idle: Idle, force_n: &mut [f64]) {
    let n_outside = keys(simd, table, x_m, force_n);
    let done = by_table::<S, SIDE_BY_SIDE>(simd, table, x_m, 0, force_n);
    by_table::<S, 1>(simd, table, x_m, done, force_n);
    let expected = idle.iter().flatten().filter(|gap| **gap < force_n.len());
    let expected = expected.filter(|gap| table.is_outside(x_m[**gap] - x_m[**gap + 1])).count();
    if n_outside > expected as f64 {
        simd.vectorize(Outside { table, x_m, force_n });
    }
}

/// Fills a row with the keys of the gaps in the table; returns how many gaps this does not hold.
#[inline(always)]
fn keys<S: Simd>(simd: S, table: &PowerTable, x_m: &[f64], row: &mut [f64]) -> f64 {
    let law = TableLanes::<S, 1>::new(simd, table);
    let n = row.len();
    let (left, right) = (S::as_simd_f64s(&x_m[..n]).0, S::as_simd_f64s(&x_m[1..=n]).0);
    let mut n_outside = Lanes::splat(simd, 0.0);
    for (key, (left, right)) in S::as_mut_simd_f64s(row).0.iter_mut().zip(left.iter().zip(right)) {
        let (found, outside) = law.keys(Lanes::new(simd, [*left]) - Lanes::new(simd, [*right]));
        *key = found.vector();
        n_outside = n_outside + outside;
    }
    n_outside.total()
}

/// Turns keys into forces, `U` vectors of gaps at a time from vector number `from` on; returns the number of vectors before what is
/// left over.
#[inline(always)]
fn by_table<S: Simd, const U: usize>(
    simd: S,
    table: &PowerTable,
    x_m: &[f64],
    from: usize,
    row: &mut [f64],
) -> usize {
    let law = TableLanes::<S, U>::new(simd, table);
    let n = row.len();
    let (left, right) = (S::as_simd_f64s(&x_m[..n]).0, S::as_simd_f64s(&x_m[1..=n]).0);
    let blocks = row[from * S::F64_LANES..].chunks_exact_mut(U * S::F64_LANES);
    let n_blocks = blocks.len();
    for (i, block) in blocks.enumerate() {
        let force_n = law.force(overlaps(simd, left, right, from + U * i), block).values();
        S::as_mut_simd_f64s(block).0.copy_from_slice(&force_n);
    }
    from + U * n_blocks
}

/// The overlaps of `U` vectors of gaps from vector number `first` on.
#[inline(always)]
fn overlaps<S: Simd, const U: usize>(
    simd: S,
    left: &[S::f64s],
    right: &[S::f64s],
    first: usize,
) -> Lanes<S, U> {
    let mut overlap = Lanes::splat(simd, 0.0);
    overlap.load(&left[first..first + U]);
    let mut neighbour = overlap;
    neighbour.load(&right[first..first + U]);
    overlap - neighbour
}

#[inline(always)]
fn each_power<S: Simd>(simd: S, columns: &PowerColumns, x_m: &[f64], force_n: &mut [f64]) {
    let done = over_row(
        simd,
        0,
        x_m,
        force_n,
        #[inline(always)]
        |first, overlap| columns.lanes::<S, SIDE_BY_SIDE>(simd, first).force(overlap),
    );
    over_row(
        simd,
        done,
        x_m,
        force_n,
        #[inline(always)]
        |first, overlap| columns.lanes::<S, 1>(simd, first).force(overlap),
    );
}

/// Fills a row, `U` vectors at a time from vector number `from` on, with a function of the vectors' number and the gaps'
/// overlaps; returns the number of vectors before what is left over.
#[inline(always)]
fn over_row<S: Simd, const U: usize>(
    simd: S,
    from: usize,
    x_m: &[f64],
    row: &mut [f64],
    of_overlap: impl Fn(usize, Lanes<S, U>) -> Lanes<S, U>,
) -> usize {
    let n = row.len();
    let (left, right) = (S::as_simd_f64s(&x_m[..n]).0, S::as_simd_f64s(&x_m[1..=n]).0);
    let blocks = S::as_mut_simd_f64s(row).0[from..].as_chunks_mut::<U>().0;
    for (i, block) in blocks.iter_mut().enumerate() {
        let first = from + U * i;
        *block = of_overlap(first, overlaps(simd, left, right, first)).values();
    }
    from + U * blocks.len()
}

impl PowerGaps {
    fn new(contacts: &[&Contact]) -> Self {
        let law_of = |contact: &Contact| match &contact.law {
            Law::Power(law) => Some((*law, contact.tension)),
            _ => None,
        };
        let Some((law, tension)) = contacts.iter().find_map(|contact| law_of(contact)) else {
            return Self::None;
        };
        if contacts.iter().filter_map(|contact| law_of(contact)).all(|other| other == (law, tension)) {
            return Self::Same(Box::new(PowerTable::new(&law, tension)));
        }
        // Gaps of another kind compute any power law and are then overwritten.
        let rows: Vec<_> = contacts
            .iter()
            .map(|contact| law_of(contact).unwrap_or((law, tension)))
            .map(|(law, tension)| PowerKernel::new(&law, tension).columns())
            .collect();
        Self::Each(PowerColumns::new(&rows))
    }
}

impl Springs {
    #[inline(always)]
    fn forces(&self, x_m: &[f64], force_n: &mut [f64]) {
        self.for_each(
            x_m,
            force_n,
            #[inline(always)]
            |k, overlap_m| k * overlap_m,
        );
    }

    #[inline(always)]
    fn energies(&self, x_m: &[f64], energy_j: &mut [f64]) {
        self.for_each(
            x_m,
            energy_j,
            #[inline(always)]
            |k, overlap_m| 0.5 * k * overlap_m * overlap_m,
        );
    }

    #[inline(always)]
    fn for_each(&self, x_m: &[f64], row: &mut [f64], of_overlap: impl Fn(f64, f64) -> f64) {
        let end = row.len().min(self.first + self.k_n_per_m.len());
        let Some(row) = row.get_mut(self.first..end) else { return };
        let pairs = x_m[self.first..].iter().zip(&x_m[self.first + 1..]);
        let springs = self.k_n_per_m.iter().zip(&self.least_m);
        for ((value, (left, right)), (k, least_m)) in row.iter_mut().zip(pairs).zip(springs) {
            let overlap_m = left - right;
            *value = of_overlap(*k, if overlap_m > *least_m { overlap_m } else { least_m.max(f64::MIN) });
        }
    }
}

#[cfg(test)]
mod tests {
    use pulp::WithSimd;

    use super::*;
    use crate::{contact::power::PowerLaw, lanes::PADDING};

    struct RowForces<'a> {
        gaps: &'a Gaps,
        x_m: &'a [f64],
        idle: Idle,
    }

    impl WithSimd for RowForces<'_> {
        type Output = Vec<f64>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Vec<f64> {
            let mut force_n = vec![0.0; self.x_m.len() - PADDING];
            self.gaps.forces(simd, self.x_m, self.idle, &mut force_n);
            force_n
        }
    }

    /// In rows of one block, of several and of an odd number of vectors, with gaps beyond the tables on either side; whatever an
    /// idle gap holds, it disturbs none of the others.
    #[test]
    fn rows_of_one_law_follow_it_beyond_its_tables() {
        let law = PowerLaw::ELLIPTICAL_RING;
        let contact = Contact::from(Law::Power(law));
        let spring = contact.spring();
        for n_vectors in [1, 2, 3, 8, 9] {
            let n = n_vectors * PADDING;
            let gaps = Gaps::new(&vec![&contact; n]);
            let overlaps_m: Vec<f64> = (0..n)
                .map(|gap| match gap % 11 {
                    3 => -2.2e-3 * gap as f64,
                    7 => 0.5 * gap as f64,
                    _ => 2e-3 * (0.3 * gap as f64).sin(),
                })
                .collect();
            let mut x_m = vec![0.0; n + PADDING];
            for gap in 0..n {
                x_m[gap + 1] = x_m[gap] - overlaps_m[gap];
            }
            for idle in [[None; 3], [Some(3), None, None], [Some(0), Some(n - 2), Some(n - 1)]] {
                let found = chainwave_vectors::dispatch(RowForces { gaps: &gaps, x_m: &x_m, idle });
                let plain = RowForces { gaps: &gaps, x_m: &x_m, idle }.with_simd(pulp::Scalar);
                for gap in (0..n).filter(|gap| !idle.contains(&Some(*gap))) {
                    let truth_n = spring.force_n(x_m[gap] - x_m[gap + 1]);
                    // Two formulas, each within 2e-15 of the law.
                    assert!((found[gap] - truth_n).abs() <= 4e-15 * truth_n.abs(), "{n_vectors} {gap}");
                    assert_eq!(found[gap].to_bits(), plain[gap].to_bits(), "{n_vectors} {gap}");
                }
            }
        }
    }
}
