//! The vector units that the blur uses, behind one trait.
//!
//! Every path does the same operations in the same order, with a fused multiply-add, so they agree bit for bit;
//! only the number of pixels done at once differs. A test compares them.

/// A vector unit to compute with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum SimdLevel {
    /// Any processor. Slow on x86-64 before 2013, whose multiply-add is done in software.
    Portable,
    /// x86-64 with AVX2 and FMA.
    Avx2,
}

impl SimdLevel {
    /// The widest unit of this processor.
    pub fn best() -> Self {
        *Self::available().last().expect("the portable path is always there")
    }

    /// All units of this processor, narrowest first.
    pub fn available() -> Vec<Self> {
        let mut levels = vec![SimdLevel::Portable];
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                levels.push(SimdLevel::Avx2);
            }
        }
        levels
    }

    /// The unit called `portable` or `avx2`.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "portable" => Some(SimdLevel::Portable),
            "avx2" => Some(SimdLevel::Avx2),
            _ => None,
        }
    }
}

/// A vector of f32 lanes.
///
/// # Safety
/// The methods of an implementation may only be called on a processor that has its instructions, and pointers
/// must be valid for [`Lanes::COUNT`] values.
pub(crate) unsafe trait Lanes {
    /// The vector.
    type Vector: Copy;
    /// Lanes in it.
    const COUNT: usize;
    unsafe fn splat(x: f32) -> Self::Vector;
    unsafe fn load(from: *const f32) -> Self::Vector;
    unsafe fn store(to: *mut f32, v: Self::Vector);
    /// `a * b + c`, rounded once.
    unsafe fn fused(a: Self::Vector, b: Self::Vector, c: Self::Vector) -> Self::Vector;
    /// `first` where it is a number, `second` where it is NaN.
    unsafe fn first_unless_nan(first: Self::Vector, second: Self::Vector) -> Self::Vector;
}

/// Plain Rust, eight lanes.
pub(crate) struct Portable;

// SAFETY: no special instructions.
unsafe impl Lanes for Portable {
    type Vector = [f32; 8];
    const COUNT: usize = 8;
    #[inline(always)]
    unsafe fn splat(x: f32) -> [f32; 8] {
        [x; 8]
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> [f32; 8] {
        // SAFETY: valid for eight values by the trait's contract.
        unsafe { from.cast::<[f32; 8]>().read_unaligned() }
    }
    #[inline(always)]
    unsafe fn store(to: *mut f32, v: [f32; 8]) {
        // SAFETY: valid for eight values by the trait's contract.
        unsafe { to.cast::<[f32; 8]>().write_unaligned(v) }
    }
    #[inline(always)]
    unsafe fn fused(a: [f32; 8], b: [f32; 8], c: [f32; 8]) -> [f32; 8] {
        std::array::from_fn(|i| a[i].mul_add(b[i], c[i]))
    }
    #[inline(always)]
    unsafe fn first_unless_nan(first: [f32; 8], second: [f32; 8]) -> [f32; 8] {
        std::array::from_fn(|i| if first[i].is_nan() { second[i] } else { first[i] })
    }
}

#[cfg(target_arch = "x86_64")]
pub(crate) use x86::Avx2;

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::Lanes;
    use std::arch::x86_64::*;

    /// AVX2 and FMA, eight lanes.
    pub(crate) struct Avx2;

    // SAFETY: callers guarantee AVX2 and FMA, and valid pointers.
    unsafe impl Lanes for Avx2 {
        type Vector = __m256;
        const COUNT: usize = 8;
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
        unsafe fn fused(a: __m256, b: __m256, c: __m256) -> __m256 {
            unsafe { _mm256_fmadd_ps(a, b, c) }
        }
        #[inline(always)]
        unsafe fn first_unless_nan(first: __m256, second: __m256) -> __m256 {
            unsafe { _mm256_blendv_ps(second, first, _mm256_cmp_ps::<_CMP_ORD_Q>(first, first)) }
        }
    }
}
