//! The power law's formula for vectors of gaps: logarithm and exponential without a branch.

use std::f64::consts::LOG2_E;

use pulp::Simd;

use crate::lanes::Lanes;

/// Parts of ln 2; the first has zeros at the end, so that its product with an exponent is exact.
const LN_2: [f64; 2] = [0.693_147_180_485_539_1, 7.440_617_110_012_397e-11];
/// Adding and taking away 1.5 2^52 rounds to a whole number.
const ROUNDER: f64 = 6_755_399_441_055_744.0;
/// z beyond which e^z leaves the range of numbers.
const LARGEST_EXPONENT: f64 = 709.0;
/// 2 (artanh w - w) / w^3 as a polynomial in w^2, for |w| up to 0.172.
const ARTANH: [f64; 7] = [
    0.666_666_666_666_667,
    0.399_999_999_998_932_2,
    0.285_714_286_288_109_96,
    0.222_222_106_742_385_16,
    0.181_829_225_135_159_42,
    0.153_306_173_067_433_05,
    0.146_300_313_641_228_6,
];
/// (e^r - 1 - r - r^2 / 2) / r^3 as a polynomial in r, for |r| up to 0.35.
const EXP: [f64; 9] = [
    0.166_666_666_666_666_66,
    0.041_666_666_666_650_1,
    0.008_333_333_333_332_06,
    0.001_388_888_890_691_662_8,
    0.000_198_412_698_551_346_27,
    2.480_153_434_123_788_8e-5,
    2.755_727_849_246_726_6e-6,
    2.761_493_187_544_047_7e-7,
    2.509_641_984_172_136e-8,
];
/// Terms of the binomial series of the energy; at the series' limit the rest is below 1e-16 of the sum.
const ENERGY_TERMS: u32 = 12;
/// |y| max(p, 1) up to which the energy follows its series: above it, the closed form loses less than two digits.
const ENERGY_LIMIT: f64 = 0.05;

/// Parameters of one power law as the formula needs them: p, delta_0, 1 / delta_0, f_0, the overlap below which the rule in tension
/// holds, dE/dDelta there, and the overlap below which the contact has opened.
pub(super) const COLUMNS: usize = 7;

/// Laws that differ from gap to gap, parameter by parameter.
#[derive(Debug, Clone)]
pub(crate) struct PowerColumns {
    columns: [Vec<f64>; COLUMNS],
}

impl PowerColumns {
    pub(super) fn new(rows: &[[f64; COLUMNS]]) -> Self {
        Self { columns: std::array::from_fn(|c| rows.iter().map(|row| row[c]).collect()) }
    }

    /// The laws of the `U` vectors of gaps from vector number `first` on.
    #[inline(always)]
    pub(crate) fn lanes<S: Simd, const U: usize>(&self, simd: S, first: usize) -> PowerLanes<S, U> {
        let mut lanes = [Lanes::splat(simd, 0.0); COLUMNS];
        for (lanes, column) in lanes.iter_mut().zip(&self.columns) {
            lanes.load(&S::as_simd_f64s(column).0[first..first + U]);
        }
        PowerLanes::from_columns(lanes)
    }
}

/// The power law of as many gaps as the vectors have lanes.
///
/// With y = Delta / delta_0 the force is f_0 E(y), E = (1 + y)^p - 1, and the energy f_0 delta_0 G(y), where G is the
/// integral of E. One formula without a branch keeps every digit of E, so that vectors of gaps go through it:
///
/// - S = Delta + delta_0 is split into 2^k M with M / delta_0 in (sqrt(1/2), sqrt(2)), where N = M - delta_0 is exact; for
///   k = 0, N is the overlap itself, so a small one keeps its digits;
/// - ln(M / delta_0) = 2 artanh w with w = N / (2 delta_0 + N), by a polynomial in w^2; k ln 2 is added in two parts, and
///   the rounding of the sum and of the product with p goes along, because the exponential of a large number magnifies it;
/// - e^z - 1 = 2^j (e^r - 1) + (2^j - 1) with z = j ln 2 + r, |r| <= ln(2) / 2, by a polynomial in r that starts with r.
///
/// The polynomials are Chebyshev fits, to 5e-18 and 8e-17 of their functions. The scheme is that of table-free libraries of
/// vector functions (N. Shibata, F. Petrogalli: SLEEF, IEEE Trans. Parallel Distrib. Syst. 31 (2020) 1316-1327).
///
/// G = ((1 + y) E - p y) / (1 + p), from integration by parts, loses the factor y to cancellation; for small |y| it gives
/// way to the integral of the binomial series.
pub(crate) struct PowerLanes<S: Simd, const U: usize> {
    p: Lanes<S, U>,
    minus_p: Lanes<S, U>,
    delta_0_m: Lanes<S, U>,
    minus_delta_0_m: Lanes<S, U>,
    twice_delta_0_m: Lanes<S, U>,
    inverse_delta_0_per_m: Lanes<S, U>,
    f_0_n: Lanes<S, U>,
    limit_m: Lanes<S, U>,
    slope_per_m: Lanes<S, U>,
    open_below_m: Lanes<S, U>,
}

impl<S: Simd, const U: usize> PowerLanes<S, U> {
    /// The same law in every lane.
    #[inline(always)]
    pub(super) fn splat(simd: S, parameters: [f64; COLUMNS]) -> Self {
        let mut lanes = [Lanes::splat(simd, 0.0); COLUMNS];
        for (lanes, value) in lanes.iter_mut().zip(parameters) {
            *lanes = Lanes::splat(simd, value);
        }
        Self::from_columns(lanes)
    }

    #[inline(always)]
    fn from_columns(columns: [Lanes<S, U>; COLUMNS]) -> Self {
        let [p, delta_0_m, inverse_delta_0_per_m, f_0_n, limit_m, slope_per_m, open_below_m] = columns;
        let zero = p.constant(0.0);
        Self {
            p,
            minus_p: zero - p,
            delta_0_m,
            minus_delta_0_m: zero - delta_0_m,
            twice_delta_0_m: delta_0_m + delta_0_m,
            inverse_delta_0_per_m,
            f_0_n,
            limit_m,
            slope_per_m,
            open_below_m,
        }
    }

    /// Contact forces in newtons at overlaps in metres.
    #[inline(always)]
    pub(crate) fn force(&self, overlap_m: Lanes<S, U>) -> Lanes<S, U> {
        let inside_m = overlap_m.max(self.limit_m);
        let inside = self.power_minus_one(inside_m);
        let relative = self.slope_per_m.mul_add(overlap_m - inside_m, inside);
        let open = overlap_m.constant(-1.0);
        self.f_0_n * overlap_m.select_less(self.open_below_m, open, relative)
    }

    /// Forces in newtons and energies in joules at overlaps in metres.
    #[inline(always)]
    pub(crate) fn force_and_energy(&self, overlap_m: Lanes<S, U>) -> (Lanes<S, U>, Lanes<S, U>) {
        let inside_m = overlap_m.max(self.limit_m);
        let open = overlap_m.constant(-1.0);
        let inside = self.power_minus_one(inside_m);
        let inside = overlap_m.select_less(self.open_below_m, open, inside);
        let beyond_m = overlap_m - inside_m;
        let half_slope = overlap_m.constant(0.5) * self.slope_per_m;
        let outside = (beyond_m * self.inverse_delta_0_per_m) * half_slope.mul_add(beyond_m, inside);
        let relative = self.relative_energy(inside_m, inside) + outside;
        (self.force(overlap_m), self.f_0_n * (self.delta_0_m * relative))
    }

    /// E at overlaps inside the law's range.
    #[inline(always)]
    pub(super) fn power_minus_one(&self, overlap_m: Lanes<S, U>) -> Lanes<S, U> {
        let (logarithm, rest) = self.logarithm(overlap_m);
        let z = (self.p * logarithm).min(overlap_m.constant(LARGEST_EXPONENT));
        let minus_z_rest = self.minus_p.mul_add(rest, self.minus_p.mul_add(logarithm, z));
        exp_minus_one(z, minus_z_rest)
    }

    /// ln(1 + Delta / delta_0) as a sum of two numbers.
    #[inline(always)]
    fn logarithm(&self, overlap_m: Lanes<S, U>) -> (Lanes<S, U>, Lanes<S, U>) {
        // Exponents are counted from 1/sqrt(2) and stored with 1024 added, as the exponent of a number that is then read
        // as 2^11 plus that count.
        const ROOT_HALF: u64 = 0x3fe6_a09e_667f_3bcd_u64.wrapping_sub(1024 << 52);
        const ONE: u64 = 0x3ff0_0000_0000_0000 + (1024 << 52);
        let total_m = overlap_m + self.delta_0_m;
        let exponent = (total_m * self.inverse_delta_0_per_m).bits_less(ROOT_HALF).and_bits(0xfff << 52);
        let inverse_power = exponent.less_bits(ONE);
        let k = exponent.upper_bits_right(11).or_bits(0x40a << 52) - overlap_m.constant(3072.0);
        let away_m = total_m.mul_add(inverse_power, self.minus_delta_0_m);
        let numerator_m = k.select_equal(overlap_m.constant(0.0), overlap_m, away_m);
        let w = numerator_m / (self.twice_delta_0_m + numerator_m);
        let square = w * w;
        let of_mantissa = (w * square).mul_add(artanh_rest(square), w + w);
        let of_power = k * overlap_m.constant(LN_2[0]);
        let sum = of_power + of_mantissa;
        (sum, k.mul_add(overlap_m.constant(LN_2[1]), (of_power - sum) + of_mantissa))
    }

    /// G at overlaps inside the law's range, where E is `force`.
    #[inline(always)]
    fn relative_energy(&self, overlap_m: Lanes<S, U>, force: Lanes<S, U>) -> Lanes<S, U> {
        let y = overlap_m * self.inverse_delta_0_per_m;
        let shifted = (overlap_m + self.delta_0_m) * self.inverse_delta_0_per_m;
        let closed = self.minus_p.mul_add(y, shifted * force) / (overlap_m.constant(1.0) + self.p);
        let mut term = self.p;
        let mut sum = term * overlap_m.constant(0.5);
        for k in 1..ENERGY_TERMS {
            let k = f64::from(k);
            term = term * y * (self.p - overlap_m.constant(k)) * overlap_m.constant(1.0 / (k + 1.0));
            sum = term.mul_add(overlap_m.constant(1.0 / (k + 2.0)), sum);
        }
        let steepness = y.abs() * self.p.max(overlap_m.constant(1.0));
        steepness.select_less(overlap_m.constant(ENERGY_LIMIT), y * y * sum, closed)
    }
}

/// The polynomial [`ARTANH`], in pairs (G. Estrin's scheme), which have shorter chains of dependent products.
#[inline(always)]
fn artanh_rest<S: Simd, const U: usize>(square: Lanes<S, U>) -> Lanes<S, U> {
    let fourth = square * square;
    let high = square.constant(ARTANH[6]).mul_add(fourth, pair(square, ARTANH[4], ARTANH[5]));
    let middle = high.mul_add(fourth, pair(square, ARTANH[2], ARTANH[3]));
    middle.mul_add(fourth, pair(square, ARTANH[0], ARTANH[1]))
}

/// `low + high x`.
#[inline(always)]
fn pair<S: Simd, const U: usize>(x: Lanes<S, U>, low: f64, high: f64) -> Lanes<S, U> {
    x.constant(high).mul_add(x, x.constant(low))
}

/// e^(z - minus_rest) - 1, where the rest is a rounding of z.
#[inline(always)]
fn exp_minus_one<S: Simd, const U: usize>(z: Lanes<S, U>, minus_rest: Lanes<S, U>) -> Lanes<S, U> {
    let rounder = z.constant(ROUNDER);
    let j = z.mul_add(z.constant(LOG2_E), rounder) - rounder;
    let reduced = j.mul_add(z.constant(-LN_2[1]), j.mul_add(z.constant(-LN_2[0]), z)) - minus_rest;
    let square = reduced * reduced;
    let fourth = square * square;
    let low = pair(reduced, EXP[2], EXP[3]).mul_add(square, pair(reduced, EXP[0], EXP[1]));
    let middle = pair(reduced, EXP[6], EXP[7]).mul_add(square, pair(reduced, EXP[4], EXP[5]));
    let rest = z.constant(EXP[8]).mul_add(fourth, middle).mul_add(fourth, low);
    let small = square.mul_add(rest.mul_add(reduced, z.constant(0.5)), reduced);
    // j + 1023 as the exponent: read off the fraction of 2^11 + 1023 + j.
    let power = (j + z.constant(3071.0)).upper_bits_left(11);
    power.mul_add(small, power - z.constant(1.0))
}
