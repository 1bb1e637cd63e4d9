//! Records of a table for vectors: found in memory one by one, and sorted into columns.

use std::any::Any;

use pulp::{Simd, bytemuck};

use super::{COLUMNS, PADDING, Records};

/// Which byte of a number names its record: the last four bits of its exponent and the first four of its fraction.
const NAMING_BYTE: usize = if cfg!(target_endian = "big") { 1 } else { 6 };

/// [`super::Lanes::records`] for one vector.
///
/// There is no closure in it, nor a function that takes one: what is not put in line is compiled without the vectors' instructions.
#[inline(always)]
pub(super) fn records<S: Simd>(simd: S, keys: &[f64], table: &Records) -> [S::f64s; COLUMNS] {
    let names = bytemuck::cast_slice(keys);
    #[cfg(target_arch = "x86_64")]
    {
        if let Some(v4) = (&simd as &dyn Any).downcast_ref::<pulp::x86::V4>() {
            let low = columns_of_four(v4.avx, &names[..32], table);
            let high = columns_of_four(v4.avx, &names[32..64], table);
            return [
                from_avx512::<S>(join(v4.avx512f, low[0], high[0])),
                from_avx512::<S>(join(v4.avx512f, low[1], high[1])),
                from_avx512::<S>(join(v4.avx512f, low[2], high[2])),
                from_avx512::<S>(join(v4.avx512f, low[3], high[3])),
            ];
        }
        if let Some(v3) = (&simd as &dyn Any).downcast_ref::<pulp::x86::V3>() {
            let [a, b, c, d] = columns_of_four(v3.avx, &names[..32], table);
            return [from_avx::<S>(a), from_avx::<S>(b), from_avx::<S>(c), from_avx::<S>(d)];
        }
    }
    let mut columns = [[0.0_f64; PADDING]; COLUMNS];
    for lane in 0..S::F64_LANES {
        for (column, number) in columns.iter_mut().zip(record(names, lane, table)) {
            column[lane] = *number;
        }
    }
    let mut found = [simd.splat_f64s(0.0); COLUMNS];
    for (found, column) in found.iter_mut().zip(&columns) {
        *found = S::as_simd_f64s(column).0[0];
    }
    found
}

/// The record that key number `lane` names.
#[inline(always)]
fn record<'a>(names: &[u8], lane: usize, table: &'a Records) -> &'a [f64; COLUMNS] {
    &table[usize::from(names[lane * size_of::<f64>() + NAMING_BYTE])]
}

/// Four records by their columns: each half of a record is loaded at once, and the halves are sorted.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn columns_of_four(
    avx: pulp::core_arch::x86::Avx,
    names: &[u8],
    table: &Records,
) -> [std::arch::x86_64::__m256d; COLUMNS] {
    let first = halves(record(names, 0, table));
    let second = halves(record(names, 1, table));
    let third = halves(record(names, 2, table));
    let fourth = halves(record(names, 3, table));
    let left_even = avx._mm256_insertf128_pd::<1>(avx._mm256_castpd128_pd256(first[0]), third[0]);
    let left_odd = avx._mm256_insertf128_pd::<1>(avx._mm256_castpd128_pd256(second[0]), fourth[0]);
    let right_even = avx._mm256_insertf128_pd::<1>(avx._mm256_castpd128_pd256(first[1]), third[1]);
    let right_odd = avx._mm256_insertf128_pd::<1>(avx._mm256_castpd128_pd256(second[1]), fourth[1]);
    [
        avx._mm256_unpacklo_pd(left_even, left_odd),
        avx._mm256_unpackhi_pd(left_even, left_odd),
        avx._mm256_unpacklo_pd(right_even, right_odd),
        avx._mm256_unpackhi_pd(right_even, right_odd),
    ]
}

/// The two halves of a record.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn halves(record: &[f64; COLUMNS]) -> [std::arch::x86_64::__m128d; 2] {
    let [a, b, c, d] = *record;
    [pulp::cast([a, b]), pulp::cast([c, d])]
}

/// Eight numbers from twice four.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn join(
    avx512f: pulp::core_arch::x86::Avx512f,
    low: std::arch::x86_64::__m256d,
    high: std::arch::x86_64::__m256d,
) -> std::arch::x86_64::__m512d {
    avx512f._mm512_insertf64x4::<1>(avx512f._mm512_castpd256_pd512(low), high)
}

/// A vector of AVX as the same vector of an instruction set that is AVX2.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn from_avx<S: Simd>(vector: std::arch::x86_64::__m256d) -> S::f64s {
    bytemuck::cast(pulp::cast::<_, pulp::f64x4>(vector))
}

/// A vector of AVX-512 as the same vector of an instruction set that is AVX-512.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn from_avx512<S: Simd>(vector: std::arch::x86_64::__m512d) -> S::f64s {
    bytemuck::cast(pulp::cast::<_, pulp::f64x8>(vector))
}
