//! The power law of one set of parameters by tables, for the inner loop.

use pulp::{Simd, WithSimd};

use super::{power::PowerLaw, power_kernel::PowerKernel, power_lanes::PowerLanes, tension::Tension};
use crate::lanes::{COLUMNS, Lanes, TABLE};

/// The power law of fixed parameters as a table, for the inner loop: no division, no logarithm, no exponential.
///
/// With S = Delta + delta_0 = 2^k M and M / delta_0 in sixteen intervals of (0.73, 1.47), each with a centre c,
///
/// (S / delta_0)^p = 2^(k p) c^p (1 + t)^p,  t = (M - c delta_0) / (c delta_0),  |t| <= 1/32,
///
/// where the first two factors come from tables, less one each, and the third from its binomial series. What keeps every
/// digit of E = (S / delta_0)^p - 1:
///
/// - M - delta_0 = 2^(-k) Delta + (2^(-k) - 1) delta_0 is rounded once; for k = 0 it is the overlap itself;
/// - t = (M - delta_0) / (c delta_0) - (c - 1) / c, rounded once, has terms that exceed it little where E is small;
/// - the interval around S = delta_0 has its centre there, so that a small overlap is t itself;
/// - T = 2^(k p) c^p is added up from T - 1, whose two parts do not cancel but for a factor below 3.
///
/// The tables hold overlaps from -0.97 to 180 delta_0, less where the rule in tension begins before. What lies outside, and
/// any law whose exponent would want a longer series, goes through the general [`PowerKernel`], gap by gap.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(crate) struct PowerTable {
    /// (2^(-k) - 1) delta_0 in metres, from k = -8 on.
    octave_m: [f64; TABLE],
    /// 1 / (c delta_0) of each interval.
    scale_per_m: [f64; TABLE],
    /// (c - 1) / c, negative.
    shift: [f64; TABLE],
    /// c^p - 1.
    of_centre: [f64; TABLE],
    /// 2^(k p) - 1, from k = -8 on.
    of_octave: [f64; TABLE],
    /// What the tables above say for each octave and interval: (2^(-k) - 1) delta_0, 1 / (c delta_0), (c - 1) / c and T - 1, for
    /// machines that look them up faster together.
    records: [[f64; COLUMNS]; TABLE * TABLE],
    /// Coefficients of ((1 + t)^p - 1) / t.
    series: [f64; TERMS],
    /// Bits of the least S / delta_0 that the tables hold, and how many numbers from there on.
    first_place: u64,
    n_places: u64,
    kernel: PowerKernel,
}

/// Terms of the series; the next one is below 9e-17 of the sum for |t| <= 1/32.
const TERMS: usize = 10;
/// Exponent up to which that holds.
const LARGEST_EXPONENT: f64 = 4.0;
/// Overlaps over delta_0 that the tables hold.
const RANGE: [f64; 2] = [-0.97, 180.0];
/// The octave k = 0 in the tables.
const MIDDLE: u64 = 8;
/// Bits of a number below its exponent, and below its exponent and four more.
const FRACTION: u32 = 52;
const PART: u32 = 48;
const ONE: u64 = 1023 << FRACTION;
/// Lower end of the first interval of the octave k = 0: eight intervals and a half below 1.
const FIRST: u64 = ONE - (17 << (PART - 1));

/// What is taken from the bits of S / delta_0, so that the octave and the interval stand above the bit [`PART`].
const ORIGIN: u64 = FIRST - (MIDDLE << FRACTION);
/// The interval around S = delta_0, of the octave k = 0, in those bits.
const MIDDLE_PLACE: u64 = (MIDDLE << FRACTION) + (MIDDLE << PART);

impl PowerTable {
    pub(crate) fn new(law: &PowerLaw, tension: Tension) -> Self {
        let kernel = PowerKernel::new(law, tension);
        let centre_m = std::array::from_fn(|i| (centre(i as u64) - 1.0) * law.delta_0_m);
        // 2^(-k p) - 1 from 2^(k p) - 1, because Delta + delta_0 below delta_0 would not be exact.
        let octave = |i: usize| {
            let k = i as i32 - MIDDLE as i32;
            let up = kernel.power_minus_one((2.0_f64.powi(k.abs()) - 1.0) * law.delta_0_m);
            if k < 0 { -up / (1.0 + up) } else { up }
        };
        let scale_per_m = centre_m.map(|centre_m| (law.delta_0_m + centre_m).recip());
        let [low, high] = RANGE.map(|overlap| 1.0 + overlap.max(kernel.limit_m() / law.delta_0_m));
        let shift: [f64; TABLE] = std::array::from_fn(|i| -centre_m[i] * scale_per_m[i]);
        let octave_m: [f64; TABLE] =
            std::array::from_fn(|i| (2.0_f64.powi(MIDDLE as i32 - i as i32) - 1.0) * law.delta_0_m);
        let of_centre = centre_m.map(|centre_m| kernel.power_minus_one(centre_m));
        let of_octave: [f64; TABLE] = std::array::from_fn(octave);
        let record = |place: usize| {
            let (k, i) = (place / TABLE, place % TABLE);
            let factor_minus_one = of_octave[k].mul_add(of_centre[i], of_octave[k] + of_centre[i]);
            [octave_m[k], scale_per_m[i], shift[i], factor_minus_one]
        };
        let n_places = if law.p <= LARGEST_EXPONENT { high.to_bits() - low.to_bits() } else { 0 };
        Self {
            first_place: low.to_bits(),
            octave_m,
            n_places,
            shift,
            scale_per_m,
            of_centre,
            of_octave,
            records: std::array::from_fn(record),
            series: binomial_series(law.p),
            kernel,
        }
    }

    /// The law at any overlap.
    pub(crate) fn kernel(&self) -> &PowerKernel {
        &self.kernel
    }

    /// Whether the tables do not hold an overlap in metres.
    pub(crate) fn is_outside(&self, overlap_m: f64) -> bool {
        let place = (overlap_m + self.kernel.delta_0_m) * self.kernel.inverse_delta_0_per_m;
        place.to_bits().wrapping_sub(self.first_place) >= self.n_places
    }
}

/// Middle of an interval, over delta_0; 1 where that lies inside.
fn centre(interval: u64) -> f64 {
    let end = |interval: u64| f64::from_bits(FIRST + (interval << PART));
    if interval == MIDDLE { 1.0 } else { 0.5 * (end(interval) + end(interval + 1)) }
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
    table: &'a PowerTable,
    delta_0_m: Lanes<S, U>,
    per_delta_0: Lanes<S, U>,
    f_0_n: Lanes<S, U>,
}

impl<'a, S: Simd, const U: usize> TableLanes<'a, S, U> {
    #[inline(always)]
    pub(crate) fn new(simd: S, table: &'a PowerTable) -> Self {
        let splat = |value: f64| Lanes::splat(simd, value);
        Self {
            table,
            delta_0_m: splat(table.kernel.delta_0_m),
            per_delta_0: splat(table.kernel.inverse_delta_0_per_m),
            f_0_n: splat(table.kernel.f_0_n),
        }
    }

    /// Finds the overlaps' places in the tables; and one in the lanes that these do not hold, else zero.
    #[inline(always)]
    pub(crate) fn place(&self, overlap_m: Lanes<S, U>) -> (Placed<S, U>, Lanes<S, U>) {
        let table = self.table;
        let (zero, one) = (overlap_m.constant(0.0), overlap_m.constant(1.0));
        let ratio = (overlap_m + self.delta_0_m) * self.per_delta_0;
        let outside = ratio.bits_less(table.first_place).select_bits_below(table.n_places, zero, one);
        let place = ratio.bits_less(ORIGIN);
        let inverse_power = place.and_bits(0xfff << FRACTION).less_bits(ONE + (MIDDLE << FRACTION));
        let [octave_m, scale_per_m, shift, factor_minus_one] = if Lanes::<S, U>::has_tables_in_registers() {
            let octave = place.look_up::<FRACTION>(&table.of_octave);
            let centre = place.look_up::<PART>(&table.of_centre);
            [
                place.look_up::<FRACTION>(&table.octave_m),
                place.look_up::<PART>(&table.scale_per_m),
                place.look_up::<PART>(&table.shift),
                octave.mul_add(centre, octave + centre),
            ]
        } else {
            place.records::<PART>(&table.records)
        };
        let t = overlap_m.mul_add(inverse_power, octave_m).mul_add(scale_per_m, shift);
        (Placed { t, factor_minus_one }, outside)
    }

    /// Contact forces in newtons at overlaps; adds one to the lanes that the tables do not hold.
    ///
    /// Ahead of a wave and long behind it, whole blocks lie in the interval around zero overlap, and want no look-up.
    #[inline(always)]
    pub(crate) fn force_at(&self, overlap_m: Lanes<S, U>, n_outside: &mut Lanes<S, U>) -> Lanes<S, U> {
        let ratio = (overlap_m + self.delta_0_m) * self.per_delta_0;
        if ratio.bits_less(ORIGIN + MIDDLE_PLACE).all_bits_below(PART) {
            let [octave_m, scale_per_m, shift, factor_minus_one] =
                self.table.records[(MIDDLE_PLACE >> PART) as usize].map(|value| overlap_m.constant(value));
            let t = (overlap_m + octave_m).mul_add(scale_per_m, shift);
            return self.force(Placed { t, factor_minus_one });
        }
        let (placed, outside) = self.place(overlap_m);
        *n_outside = *n_outside + outside;
        self.force(placed)
    }

    /// Contact forces in newtons at overlaps in their places; of no meaning where the tables do not hold them.
    #[inline(always)]
    pub(crate) fn force(&self, placed: Placed<S, U>) -> Lanes<S, U> {
        let Placed { t, factor_minus_one } = placed;
        let change = t * series(&self.table.series, t);
        self.f_0_n * (factor_minus_one + t.constant(1.0)).mul_add(change, factor_minus_one)
    }
}

/// Overlaps by their places in the tables: t and T - 1.
pub(crate) struct Placed<S: Simd, const U: usize> {
    t: Lanes<S, U>,
    factor_minus_one: Lanes<S, U>,
}

impl<S: Simd, const U: usize> Clone for Placed<S, U> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: Simd, const U: usize> Copy for Placed<S, U> {}

/// The series' sum, in pairs (G. Estrin's scheme).
#[inline(always)]
fn series<S: Simd, const U: usize>(terms: &[f64; TERMS], t: Lanes<S, U>) -> Lanes<S, U> {
    let square = t * t;
    let fourth = square * square;
    let low = pair(terms, t, 2).mul_add(square, pair(terms, t, 0));
    let middle = pair(terms, t, 6).mul_add(square, pair(terms, t, 4));
    pair(terms, t, 8).mul_add(fourth, middle).mul_add(fourth, low)
}

/// Two neighbouring terms, over the power of t that they share.
#[inline(always)]
fn pair<S: Simd, const U: usize>(terms: &[f64; TERMS], t: Lanes<S, U>, i: usize) -> Lanes<S, U> {
    t.constant(terms[i + 1]).mul_add(t, t.constant(terms[i]))
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
            let outside = fast.place(overlap_m).1;
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
    use crate::lanes::vectorised;

    /// TableForces at overlaps, with one vector at a time.
    struct TableForces<'a>(&'a PowerTable, &'a [f64]);

    impl WithSimd for TableForces<'_> {
        type Output = Vec<f64>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Vec<f64> {
            let law = TableLanes::<S, 1>::new(simd, self.0);
            let force = |overlap_m: &f64| law.force(law.place(Lanes::splat(simd, *overlap_m)).0).first();
            self.1.iter().map(force).collect()
        }
    }

    fn table(p: f64, tension: Tension) -> PowerTable {
        PowerTable::new(&PowerLaw::new(60.1, 2.27e-3, p).unwrap(), tension)
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
                let found = vectorised(TableForces(&table, &[overlap_m]))[0];
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
            assert!(vectorised(TableForces(&table, &overlaps)).iter().eq(&plain));
            #[cfg(target_arch = "x86_64")]
            if let Some(avx2) = pulp::x86::V3::try_new() {
                assert!(Simd::vectorize(avx2, TableForces(&table, &overlaps)).iter().eq(&plain));
            }
        }
    }
}
