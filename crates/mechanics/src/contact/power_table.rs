//! The power law of one set of parameters by tables, for the inner loop.

use pulp::{Simd, WithSimd};

use super::{power::PowerLaw, power_kernel::PowerKernel, power_lanes::PowerLanes, tension::Tension};
use crate::lanes::{COLUMNS, Lanes, Records};

/// The power law of fixed parameters as a table, for the inner loop: no division, no logarithm, no exponential.
///
/// S = Delta + delta_0 lies in one of sixteen intervals of an octave, each with a centre c delta_0, from which
///
/// (S / delta_0)^p = T (1 + t)^p,  T = c^p,  t = S / (c delta_0) - 1 = alpha Delta + beta,  |t| <= 1/33,
///
/// where alpha, beta and f_0 T come from a table and the last factor from its binomial series. What keeps every digit of
/// F = f_0 ((S / delta_0)^p - 1) = f_0 (T - 1) + f_0 T ((1 + t)^p - 1):
///
/// - alpha is a number of the machine, and the centre is where t is zero for it: beta = alpha delta_0 - 1, rounded once, and
///   T = (alpha delta_0)^(-p). So t has the roundings of beta and of itself;
/// - the interval around S = delta_0 has its centre there, so that beta and T - 1 are zero and a small overlap is t itself;
/// - the two terms of F do not cancel but for a factor below 3.
///
/// The interval is told by the key 33/32 S / delta_0, whose exponent and first four bits of the fraction name it; 33/32 puts
/// S = delta_0 into the middle of one.
///
/// The tables hold overlaps from -0.97 to 180 delta_0, less where the rule in tension begins before. What lies outside, and
/// any law whose exponent would want a longer series, goes through the general [`PowerKernel`], gap by gap.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(crate) struct PowerTable {
    /// alpha per metre, beta, f_0 (T - 1) and f_0 T in newtons.
    records: Records,
    /// Coefficients of ((1 + t)^p - 1) / t.
    series: [f64; TERMS],
    /// 33/32 over delta_0, per metre.
    key_per_m: f64,
    /// Bits of the least key that the tables hold, and how many numbers from there on.
    first_key: u64,
    n_keys: u64,
    kernel: PowerKernel,
}

/// Terms of the series; the next one is below 9e-17 of the sum for |t| <= 1/32.
const TERMS: usize = 10;
/// Exponent up to which that holds.
const LARGEST_EXPONENT: f64 = 4.0;
/// Overlaps over delta_0 that the tables hold.
const RANGE: [f64; 2] = [-0.97, 180.0];
/// Intervals of an octave.
const INTERVALS: usize = 16;
/// Octaves of the tables: from 2^-8 to 2^8.
const OCTAVES: std::ops::Range<i32> = -8..8;
/// The key at S = delta_0: the middle of the first interval above 1.
const KEY_AT_REST: f64 = 1.0 + 0.5 / INTERVALS as f64;

/// Overlap over delta_0, of either sign, up to which a key surely names the record at rest: less than 1/33.
const AT_REST: f64 = 1.0 / 34.0;

impl PowerTable {
    pub(crate) fn new(law: &PowerLaw, tension: Tension) -> Self {
        let kernel = PowerKernel::new(law, tension);
        let mut records: Records = std::array::from_fn(|_| [0.0; COLUMNS]);
        for octave in OCTAVES {
            for interval in 0..INTERVALS {
                let middle = 2.0_f64.powi(octave) * (1.0 + (interval as f64 + 0.5) / INTERVALS as f64);
                records[usize::from(name(middle))] = record(&kernel, middle / KEY_AT_REST);
            }
        }
        let key = |overlap: f64| KEY_AT_REST * (1.0 + overlap.max(kernel.limit_m() / law.delta_0_m));
        let [low, high] = RANGE.map(|overlap| key(overlap).to_bits());
        Self {
            records,
            series: binomial_series(law.p),
            key_per_m: KEY_AT_REST * kernel.inverse_delta_0_per_m,
            first_key: low,
            n_keys: if law.p <= LARGEST_EXPONENT { high - low } else { 0 },
            kernel,
        }
    }

    /// The law at any overlap.
    pub(crate) fn kernel(&self) -> &PowerKernel {
        &self.kernel
    }

    /// Whether the tables do not hold an overlap in metres.
    pub(crate) fn is_outside(&self, overlap_m: f64) -> bool {
        let key = overlap_m.mul_add(self.key_per_m, KEY_AT_REST);
        key.to_bits().wrapping_sub(self.first_key) >= self.n_keys
    }
}

/// Which record a key names.
fn name(key: f64) -> u8 {
    (key.to_bits() >> 48) as u8
}

/// The record of an interval with its centre, over delta_0, near `c`.
fn record(kernel: &PowerKernel, c: f64) -> [f64; COLUMNS] {
    let alpha_per_m = kernel.inverse_delta_0_per_m / c;
    let is_at_rest = c.to_bits() == 1.0_f64.to_bits();
    let beta = if is_at_rest { 0.0 } else { alpha_per_m.mul_add(kernel.delta_0_m, -1.0) };
    // (alpha delta_0)^(-p) - 1 as a power of what lies above 1, by its distance from there.
    let above = |y: f64| kernel.power_minus_one(y * kernel.delta_0_m);
    let factor_minus_one = match beta > 0.0 {
        true => -above(beta) / (1.0 + above(beta)),
        false => above(-beta / (alpha_per_m * kernel.delta_0_m)),
    };
    [alpha_per_m, beta, kernel.f_0_n * factor_minus_one, kernel.f_0_n * (1.0 + factor_minus_one)]
}

/// The coefficients of t, t^2 and so on in (1 + t)^p.
fn binomial_series(p: f64) -> [f64; TERMS] {
    let mut coefficient = 1.0;
    std::array::from_fn(|i| {
        coefficient *= (p - i as f64) / (i + 1) as f64;
        coefficient
    })
}

/// A [`PowerTable`] as vectors.
pub(crate) struct TableLanes<'a, S: Simd, const U: usize> {
    simd: S,
    table: &'a PowerTable,
    key_per_m: Lanes<S, U>,
    key_at_rest: Lanes<S, U>,
    first_key: u64,
    n_keys: u64,
    /// The record around zero overlap, and up to which overlap in metres it holds.
    at_rest: [Lanes<S, U>; COLUMNS],
    rest_m: f64,
}

impl<'a, S: Simd, const U: usize> TableLanes<'a, S, U> {
    #[inline(always)]
    pub(crate) fn new(simd: S, table: &'a PowerTable) -> Self {
        let mut at_rest = [Lanes::splat(simd, 0.0); COLUMNS];
        for (lanes, number) in at_rest.iter_mut().zip(table.records[usize::from(name(KEY_AT_REST))]) {
            *lanes = Lanes::splat(simd, number);
        }
        Self {
            simd,
            table,
            key_per_m: Lanes::splat(simd, table.key_per_m),
            key_at_rest: Lanes::splat(simd, KEY_AT_REST),
            at_rest,
            rest_m: AT_REST * table.kernel.delta_0_m,
            first_key: table.first_key,
            n_keys: table.n_keys,
        }
    }

    /// The keys of overlaps; and one in the lanes that the tables do not hold, else zero.
    #[inline(always)]
    pub(crate) fn keys(&self, overlap_m: Lanes<S, U>) -> (Lanes<S, U>, Lanes<S, U>) {
        let (zero, one) = (overlap_m.constant(0.0), overlap_m.constant(1.0));
        let key = overlap_m.mul_add(self.key_per_m, self.key_at_rest);
        (key, key.bits_less(self.first_key).select_bits_below(self.n_keys, zero, one))
    }

    /// Contact forces in newtons at overlaps with these keys; of no meaning where the tables do not hold them.
    ///
    /// The keys come from memory, where a loop has put them that ran before: a record is found by a byte, which is sooner loaded
    /// than taken out of a vector. Ahead of a wave and long behind it, whole vectors lie in the interval around zero overlap, and want
    /// none.
    #[inline(always)]
    pub(crate) fn force(&self, overlap_m: Lanes<S, U>, keys: &[f64]) -> Lanes<S, U> {
        match overlap_m.all_within(self.rest_m) {
            true => self.of_records(overlap_m, self.at_rest),
            false => self.of_records(overlap_m, Lanes::records(self.simd, keys, &self.table.records)),
        }
    }

    #[inline(always)]
    fn of_records(&self, overlap_m: Lanes<S, U>, records: [Lanes<S, U>; COLUMNS]) -> Lanes<S, U> {
        let [alpha, beta, at_centre_n, scale_n] = records;
        let t = overlap_m.mul_add(alpha, beta);
        (scale_n * t).mul_add(series(&self.table.series, t), at_centre_n)
    }
}

/// The series' sum: even and odd powers side by side, which halves the chain of products that wait for each other.
#[inline(always)]
fn series<S: Simd, const U: usize>(terms: &[f64; TERMS], t: Lanes<S, U>) -> Lanes<S, U> {
    let square = t * t;
    let (mut even, mut odd) = (t.constant(terms[TERMS - 2]), t.constant(terms[TERMS - 1]));
    for i in (0..TERMS / 2 - 1).rev() {
        even = even.mul_add(square, t.constant(terms[2 * i]));
        odd = odd.mul_add(square, t.constant(terms[2 * i + 1]));
    }
    odd.mul_add(t, even)
}

/// Computes anew, by the general kernel, what the tables do not hold.
pub(crate) struct Outside<'a> {
    pub(crate) table: &'a PowerTable,
    pub(crate) x_m: &'a [f64],
    pub(crate) force_n: &'a mut [f64],
}

impl WithSimd for Outside<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { table, x_m, force_n } = self;
        let (fast, general) =
            (TableLanes::<S, 1>::new(simd, table), PowerLanes::<S, 1>::splat(simd, table.kernel.columns()));
        let n = force_n.len();
        let (left, right) = (S::as_simd_f64s(&x_m[..n]).0, S::as_simd_f64s(&x_m[1..=n]).0);
        let pairs = left.iter().zip(right);
        for (force, (left, right)) in S::as_mut_simd_f64s(force_n).0.iter_mut().zip(pairs) {
            let overlap_m = Lanes::new(simd, [*left]) - Lanes::new(simd, [*right]);
            let outside = fast.keys(overlap_m).1;
            if outside.largest() > 0.0 {
                let zero = outside.constant(0.0);
                let found = zero.select_less(outside, general.force(overlap_m), Lanes::new(simd, [*force]));
                [*force] = found.values();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::PADDING;

    /// TableForces at overlaps, with one vector at a time.
    struct TableForces<'a>(&'a PowerTable, &'a [f64]);

    impl WithSimd for TableForces<'_> {
        type Output = Vec<f64>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Vec<f64> {
            let law = TableLanes::<S, 1>::new(simd, self.0);
            let force = |overlap_m: &f64| {
                let overlap_m = Lanes::splat(simd, *overlap_m);
                let mut keys = [0.0; PADDING];
                law.keys(overlap_m).0.write(&mut keys);
                law.force(overlap_m, &keys).first()
            };
            self.1.iter().map(force).collect()
        }
    }

    fn table(p: f64, tension: Tension) -> PowerTable {
        PowerTable::new(&PowerLaw { p, ..PowerLaw::ELLIPTICAL_RING }, tension)
    }

    /// Against 50 digits; the bound is the project's target.
    #[test]
    fn forces_keep_their_digits() {
        let mut n_rows = 0;
        for line in include_str!("../../tests/contact_reference.csv").lines().skip(1) {
            let numbers: Vec<f64> = line.split(',').map(|number| number.parse().unwrap()).collect();
            let [p, overlap_m, force_n, _] = numbers[..] else { panic!("four columns") };
            let table = table(p, Tension::Tangent { limit: -1.0 + 5e-13 });
            if !table.is_outside(overlap_m) {
                let found = chainwave_vectors::dispatch(TableForces(&table, &[overlap_m]))[0];
                assert!(
                    (found / force_n - 1.0).abs() <= 2e-15,
                    "p {p}, overlap {overlap_m}: {found} {force_n}"
                );
                n_rows += 1;
            }
        }
        assert!(n_rows > 400, "{n_rows}");
    }

    #[test]
    fn vectors_of_any_width_give_the_same_bits() {
        let overlaps: Vec<f64> = (-2200..40_000).map(|i| 1e-6 * f64::from(i) + 1e-10).collect();
        for p in [0.114, 0.5, 1.5] {
            let table = table(p, Tension::Detach);
            let plain = TableForces(&table, &overlaps).with_simd(pulp::Scalar);
            assert!(chainwave_vectors::dispatch(TableForces(&table, &overlaps)).iter().eq(&plain));
            #[cfg(target_arch = "x86_64")]
            if let Some(avx2) = pulp::x86::V3::try_new() {
                assert!(Simd::vectorize(avx2, TableForces(&table, &overlaps)).iter().eq(&plain));
            }
        }
    }
}
