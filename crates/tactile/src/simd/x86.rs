//! AVX2 and AVX-512.

use super::{Kernel, Lanes};
use std::arch::x86_64::*;

/// # Safety
/// The processor must have AVX2 and FMA.
#[target_feature(enable = "avx2,fma")]
pub(super) unsafe fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    // SAFETY: forwarded.
    unsafe { kernel.run::<Avx2>() }
}

/// # Safety
/// The processor must have AVX2, FMA and AVX-512 F, BW, DQ, VL.
#[target_feature(enable = "avx2,fma,avx512f,avx512bw,avx512dq,avx512vl")]
pub(super) unsafe fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    // SAFETY: forwarded.
    unsafe { kernel.run::<Avx512>() }
}

/// AVX2 and FMA, eight lanes.
pub(crate) struct Avx2;

// SAFETY: callers guarantee AVX2 and FMA, and valid pointers.
unsafe impl Lanes for Avx2 {
    type Vector = __m256;
    const COUNT: usize = 8;
    const MANY_REGISTERS: bool = false;
    #[inline(always)]
    unsafe fn splat(x: f32) -> __m256 {
        unsafe { _mm256_set1_ps(x) }
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> __m256 {
        unsafe { _mm256_loadu_ps(from) }
    }
    #[inline(always)]
    unsafe fn store(to: *mut f32, v: __m256) {
        unsafe { _mm256_storeu_ps(to, v) }
    }
    #[inline(always)]
    unsafe fn add(a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_add_ps(a, b) }
    }
    #[inline(always)]
    unsafe fn fused(a: __m256, b: __m256, c: __m256) -> __m256 {
        unsafe { _mm256_fmadd_ps(a, b, c) }
    }
    #[inline(always)]
    unsafe fn first_unless_nan(first: __m256, second: __m256) -> __m256 {
        unsafe { _mm256_blendv_ps(second, first, _mm256_cmp_ps::<_CMP_ORD_Q>(first, first)) }
    }
    #[inline(always)]
    unsafe fn larger_unless_nan(first: __m256, second: __m256) -> __m256 {
        // The second operand where one of them is NaN.
        unsafe { _mm256_max_ps(first, second) }
    }
    #[inline(always)]
    unsafe fn transpose8(from: *const f32, from_stride: usize, to: *mut f32, to_stride: usize) {
        // SAFETY: forwarded.
        unsafe {
            let r: [__m256; 8] = std::array::from_fn(|i| _mm256_loadu_ps(from.add(i * from_stride)));
            // Pairs of rows interleaved, then pairs of pairs, then halves.
            let low = |a, b| _mm256_unpacklo_ps(a, b);
            let high = |a, b| _mm256_unpackhi_ps(a, b);
            let p = [
                low(r[0], r[1]),
                high(r[0], r[1]),
                low(r[2], r[3]),
                high(r[2], r[3]),
                low(r[4], r[5]),
                high(r[4], r[5]),
                low(r[6], r[7]),
                high(r[6], r[7]),
            ];
            let first = |a, b| _mm256_shuffle_ps::<0x44>(a, b);
            let second = |a, b| _mm256_shuffle_ps::<0xee>(a, b);
            let q = [
                first(p[0], p[2]),
                second(p[0], p[2]),
                first(p[1], p[3]),
                second(p[1], p[3]),
                first(p[4], p[6]),
                second(p[4], p[6]),
                first(p[5], p[7]),
                second(p[5], p[7]),
            ];
            for i in 0..4 {
                let (a, b) = (q[i], q[i + 4]);
                _mm256_storeu_ps(to.add(i * to_stride), _mm256_permute2f128_ps::<0x20>(a, b));
                _mm256_storeu_ps(to.add((i + 4) * to_stride), _mm256_permute2f128_ps::<0x31>(a, b));
            }
        }
    }
}

/// AVX-512, sixteen lanes.
pub(crate) struct Avx512;

// SAFETY: callers guarantee AVX-512 F (and AVX2), and valid pointers.
unsafe impl Lanes for Avx512 {
    type Vector = __m512;
    const COUNT: usize = 16;
    const MANY_REGISTERS: bool = true;
    #[inline(always)]
    unsafe fn splat(x: f32) -> __m512 {
        unsafe { _mm512_set1_ps(x) }
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> __m512 {
        unsafe { _mm512_loadu_ps(from) }
    }
    #[inline(always)]
    unsafe fn store(to: *mut f32, v: __m512) {
        unsafe { _mm512_storeu_ps(to, v) }
    }
    #[inline(always)]
    unsafe fn add(a: __m512, b: __m512) -> __m512 {
        unsafe { _mm512_add_ps(a, b) }
    }
    #[inline(always)]
    unsafe fn fused(a: __m512, b: __m512, c: __m512) -> __m512 {
        unsafe { _mm512_fmadd_ps(a, b, c) }
    }
    #[inline(always)]
    unsafe fn first_unless_nan(first: __m512, second: __m512) -> __m512 {
        unsafe { _mm512_mask_blend_ps(_mm512_cmp_ps_mask::<_CMP_ORD_Q>(first, first), second, first) }
    }
    #[inline(always)]
    unsafe fn larger_unless_nan(first: __m512, second: __m512) -> __m512 {
        // The second operand where one of them is NaN.
        unsafe { _mm512_max_ps(first, second) }
    }
    #[inline(always)]
    unsafe fn transpose8(from: *const f32, from_stride: usize, to: *mut f32, to_stride: usize) {
        // SAFETY: forwarded.
        unsafe { Avx2::transpose8(from, from_stride, to, to_stride) }
    }
}
