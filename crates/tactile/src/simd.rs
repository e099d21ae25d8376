//! The vector units of a processor, behind one trait.
//!
//! Two kinds of code run on them. The blur is written with [`Lanes`]. All other stages are plain loops over slices,
//! compiled once for every unit by [`SimdLevel::run`], so that the compiler may use its instructions. Both give the
//! same bits on every unit: only operations that IEEE 754 rounds exactly (add, multiply, divide, square root, fused
//! multiply-add, comparison, conversion) in an order that the source fixes. Tests compare the units.

#[cfg(target_arch = "x86_64")]
mod x86;

/// A vector unit to compute with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum SimdLevel {
    /// Any processor. Slow on x86-64, where its multiply-add is done in software.
    Portable,
    /// x86-64 with AVX2 and FMA.
    Avx2,
    /// x86-64 with AVX-512 (F, BW, DQ, VL).
    Avx512,
}

/// Work that is compiled for each vector unit.
pub(crate) trait Kernel {
    /// What it returns.
    type Output;
    /// Does the work. Has to be `#[inline(always)]`, or it is compiled for the portable unit only.
    ///
    /// # Safety
    /// The processor must have the instructions of `L`.
    unsafe fn run<L: Lanes>(self) -> Self::Output;
}

impl SimdLevel {
    /// The widest unit of this processor.
    pub fn best() -> Self {
        [SimdLevel::Avx512, SimdLevel::Avx2]
            .into_iter()
            .find(|level| level.is_available())
            .unwrap_or(SimdLevel::Portable)
    }

    /// All units of this processor, narrowest first.
    pub fn available() -> Vec<Self> {
        let all = [SimdLevel::Portable, SimdLevel::Avx2, SimdLevel::Avx512];
        all.into_iter().filter(|level| level.is_available()).collect()
    }

    /// The unit called `portable`, `avx2` or `avx512`.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "portable" => Some(SimdLevel::Portable),
            "avx2" => Some(SimdLevel::Avx2),
            "avx512" => Some(SimdLevel::Avx512),
            _ => None,
        }
    }

    #[cfg(target_arch = "x86_64")]
    fn is_available(self) -> bool {
        let avx2 = || is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
        match self {
            SimdLevel::Portable => true,
            SimdLevel::Avx2 => avx2(),
            SimdLevel::Avx512 => {
                avx2()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
            }
        }
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn is_available(self) -> bool {
        self == SimdLevel::Portable
    }

    /// Runs a kernel on this unit, or on the portable one where the processor lacks it.
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        // SAFETY: a unit is used only where `is_available` found its instructions.
        unsafe {
            match self {
                #[cfg(target_arch = "x86_64")]
                SimdLevel::Avx2 if self.is_available() => x86::run_avx2(kernel),
                #[cfg(target_arch = "x86_64")]
                SimdLevel::Avx512 if self.is_available() => x86::run_avx512(kernel),
                _ => kernel.run::<Portable>(),
            }
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
    /// Lanes in it: 8 or 16.
    const COUNT: usize;
    /// Whether there are 32 registers, not 16.
    const MANY_REGISTERS: bool;
    unsafe fn splat(x: f32) -> Self::Vector;
    unsafe fn load(from: *const f32) -> Self::Vector;
    unsafe fn store(to: *mut f32, v: Self::Vector);
    unsafe fn add(a: Self::Vector, b: Self::Vector) -> Self::Vector;
    /// `a * b + c`, rounded once.
    unsafe fn fused(a: Self::Vector, b: Self::Vector, c: Self::Vector) -> Self::Vector;
    /// `first` where it is a number, `second` where it is NaN.
    unsafe fn first_unless_nan(first: Self::Vector, second: Self::Vector) -> Self::Vector;
    /// The larger one; `second` where `first` is NaN.
    unsafe fn larger_unless_nan(first: Self::Vector, second: Self::Vector) -> Self::Vector;
    /// Writes the transpose of the 8 x 8 values at `from` (rows `from_stride` apart) to `to`.
    ///
    /// # Safety
    /// Eight values must be valid in each of eight rows of both.
    unsafe fn transpose8(from: *const f32, from_stride: usize, to: *mut f32, to_stride: usize);
}

/// Plain Rust, eight lanes.
pub(crate) struct Portable;

// SAFETY: no special instructions.
unsafe impl Lanes for Portable {
    type Vector = [f32; 8];
    const COUNT: usize = 8;
    const MANY_REGISTERS: bool = false;
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
    unsafe fn add(a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        std::array::from_fn(|i| a[i] + b[i])
    }
    #[inline(always)]
    unsafe fn fused(a: [f32; 8], b: [f32; 8], c: [f32; 8]) -> [f32; 8] {
        std::array::from_fn(|i| a[i].mul_add(b[i], c[i]))
    }
    #[inline(always)]
    unsafe fn first_unless_nan(first: [f32; 8], second: [f32; 8]) -> [f32; 8] {
        std::array::from_fn(|i| if first[i].is_nan() { second[i] } else { first[i] })
    }
    #[inline(always)]
    unsafe fn larger_unless_nan(first: [f32; 8], second: [f32; 8]) -> [f32; 8] {
        std::array::from_fn(|i| if first[i] > second[i] { first[i] } else { second[i] })
    }
    #[inline(always)]
    unsafe fn transpose8(from: *const f32, from_stride: usize, to: *mut f32, to_stride: usize) {
        for row in 0..8 {
            for column in 0..8 {
                // SAFETY: eight values are valid in each of eight rows by the contract.
                unsafe { *to.add(column * to_stride + row) = *from.add(row * from_stride + column) };
            }
        }
    }
}
