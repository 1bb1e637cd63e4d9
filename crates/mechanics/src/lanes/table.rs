//! Tables that vectors look up: in registers, or record by record in memory.

use std::any::Any;

use pulp::{Simd, bytemuck};

use super::{COLUMNS, PADDING, TABLE};

/// [`super::Lanes::look_up`] for one vector: in registers where the machine has AVX-512.
#[inline(always)]
pub(super) fn look_up<S: Simd, const FROM: u32>(simd: S, bits: S::f64s, table: &[f64; TABLE]) -> S::f64s {
    #[cfg(target_arch = "x86_64")]
    if let (Some(v4), Ok(bits)) =
        ((&simd as &dyn Any).downcast_ref::<pulp::x86::V4>(), bytemuck::try_cast::<_, pulp::u64x8>(bits))
    {
        let [low, high]: [pulp::f64x8; 2] = bytemuck::cast(*table);
        let place = v4.avx512f._mm512_srli_epi64::<FROM>(pulp::cast(bits));
        let found = v4.avx512f._mm512_permutex2var_pd(pulp::cast(low), place, pulp::cast(high));
        return bytemuck::cast(pulp::cast::<_, pulp::f64x8>(found));
    }
    let mut lanes = [0.0_f64; PADDING];
    S::as_mut_simd_f64s(&mut lanes).0[0] = bits;
    for lane in &mut lanes[..S::F64_LANES] {
        *lane = table[(lane.to_bits() >> FROM) as usize % TABLE];
    }
    S::as_simd_f64s(&lanes).0[0]
}

/// [`super::Lanes::records`] for one vector. With AVX2, each half of a record is loaded at once, and the halves are sorted into columns.
///
/// There is no closure in it, nor a function that takes one: what is not put in line is compiled without the vectors' instructions.
#[inline(always)]
pub(super) fn records<S: Simd, const FROM: u32>(
    simd: S,
    bits: S::f64s,
    table: &[[f64; COLUMNS]; TABLE * TABLE],
) -> [S::f64s; COLUMNS] {
    #[cfg(target_arch = "x86_64")]
    if let (Some(v3), Ok([first, second, third, fourth])) =
        ((&simd as &dyn Any).downcast_ref::<pulp::x86::V3>(), bytemuck::try_cast::<_, [u64; 4]>(bits))
    {
        let first = halves(record::<FROM>(first, table));
        let second = halves(record::<FROM>(second, table));
        let third = halves(record::<FROM>(third, table));
        let fourth = halves(record::<FROM>(fourth, table));
        let avx = v3.avx;
        let left_even = avx._mm256_insertf128_pd::<1>(avx._mm256_castpd128_pd256(first[0]), third[0]);
        let left_odd = avx._mm256_insertf128_pd::<1>(avx._mm256_castpd128_pd256(second[0]), fourth[0]);
        let right_even = avx._mm256_insertf128_pd::<1>(avx._mm256_castpd128_pd256(first[1]), third[1]);
        let right_odd = avx._mm256_insertf128_pd::<1>(avx._mm256_castpd128_pd256(second[1]), fourth[1]);
        return [
            from_avx::<S>(avx._mm256_unpacklo_pd(left_even, left_odd)),
            from_avx::<S>(avx._mm256_unpackhi_pd(left_even, left_odd)),
            from_avx::<S>(avx._mm256_unpacklo_pd(right_even, right_odd)),
            from_avx::<S>(avx._mm256_unpackhi_pd(right_even, right_odd)),
        ];
    }
    let mut numbers = [0.0_f64; PADDING];
    S::as_mut_simd_f64s(&mut numbers).0[0] = bits;
    let mut columns = [[0.0_f64; PADDING]; COLUMNS];
    for lane in 0..S::F64_LANES {
        let record = record::<FROM>(numbers[lane].to_bits(), table);
        for column in 0..COLUMNS {
            columns[column][lane] = record[column];
        }
    }
    let mut found = [bits; COLUMNS];
    for column in 0..COLUMNS {
        found[column] = S::as_simd_f64s(&columns[column]).0[0];
    }
    found
}

/// The record at the place that eight bits name, from bit number `FROM` on.
#[inline(always)]
fn record<const FROM: u32>(bits: u64, table: &[[f64; COLUMNS]; TABLE * TABLE]) -> &[f64; COLUMNS] {
    &table[(bits >> FROM) as usize % (TABLE * TABLE)]
}

/// The two halves of a record.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn halves(record: &[f64; COLUMNS]) -> [std::arch::x86_64::__m128d; 2] {
    let [a, b, c, d] = *record;
    [pulp::cast([a, b]), pulp::cast([c, d])]
}

/// A vector of AVX as the same vector of an instruction set that is AVX2.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn from_avx<S: Simd>(vector: std::arch::x86_64::__m256d) -> S::f64s {
    bytemuck::cast(pulp::cast::<_, pulp::f64x4>(vector))
}
