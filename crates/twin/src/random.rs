//! Counter-based randomness: every random number of a sweep is a function of
//! (sweep seed, global sample index, stream, position) and of nothing else.
//!
//! A stream is a ChaCha8 generator whose 256-bit key is made of the three numbers, so neither thread count,
//! order, shard size nor resume can change a draw. Transcendentals come from `libm`.

pub mod sobol;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// What a random number is used for. Streams never share numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u64)]
pub enum Purpose {
    /// Values of `[vary]`, keyed by the group of repetitions instead of the sample.
    Draw = 1,
    /// Scatter of the friction coefficient from grip to grip.
    Scatter = 2,
    /// Noise of the wrist force sensor.
    ForceNoise = 3,
    /// Jitter of the staircase's step time.
    StepJitter = 4,
    /// Image noise of the left sensor.
    ImageNoiseLeft = 5,
    /// Image noise of the right sensor.
    ImageNoiseRight = 6,
    /// Gain of the cameras from grip to grip, keyed by the group of repetitions.
    PressGain = 7,
    /// Image noise of another pass over stored samples, keyed by that of the image.
    ImageNoiseAgain = 8,
    /// Which samples are compared for shares of the label's variance.
    Compared = 9,
}

/// A stream of random numbers for one sample and one purpose.
#[derive(Debug, Clone)]
pub struct Stream(ChaCha8Rng);

impl Stream {
    /// The stream of `purpose` for sample `index` of the sweep seeded with `seed`.
    pub fn new(seed: u64, index: u64, purpose: Purpose) -> Self {
        Self::with_lane(seed, index, purpose, 0)
    }

    /// As [`Stream::new`], split further by `lane` (a varied key, a jaw).
    pub fn with_lane(seed: u64, index: u64, purpose: Purpose, lane: u64) -> Self {
        let mut key = [0u8; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(&index.to_le_bytes());
        key[16..24].copy_from_slice(&(purpose as u64).to_le_bytes());
        key[24..].copy_from_slice(&lane.to_le_bytes());
        Self(ChaCha8Rng::from_seed(key))
    }

    /// The next 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Uniform in the open interval (0, 1), 53 bits.
    pub fn uniform(&mut self) -> f64 {
        ((self.bits() >> 11) as f64 + 0.5) * (1.0 / (1u64 << 53) as f64)
    }

    /// Standard normal.
    pub fn normal(&mut self) -> f64 {
        normal_quantile(self.uniform())
    }
}

/// SplitMix64 (Steele, Lea, Flood 2014): the next 64 random bits after a state, which moves on.
pub fn splitmix64(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The normal distribution function.
pub fn normal_cdf(x: f64) -> f64 {
    0.5 * libm::erfc(-x * std::f64::consts::FRAC_1_SQRT_2)
}

/// The quantile function of the standard normal distribution.
///
/// Wichura (1988), algorithm AS 241 (PPND16), relative accuracy about 1e-16.
/// `probability` lies in the open interval (0, 1).
pub fn normal_quantile(probability: f64) -> f64 {
    let ratio = |r: f64, num: [f64; 8], den: [f64; 8]| {
        let horner = |c: [f64; 8]| c.iter().rev().fold(0.0, |acc, &x| acc * r + x);
        horner(num) / horner(den)
    };
    let q = probability - 0.5;
    if q.abs() <= 0.425 {
        return q * ratio(0.180625 - q * q, CENTRE_NUM, CENTRE_DEN);
    }
    let tail = if q < 0.0 { probability } else { 1.0 - probability };
    let r = libm::sqrt(-libm::log(tail));
    let x =
        if r <= 5.0 { ratio(r - 1.6, MIDDLE_NUM, MIDDLE_DEN) } else { ratio(r - 5.0, TAIL_NUM, TAIL_DEN) };
    if q < 0.0 { -x } else { x }
}

// Coefficients of AS 241, lowest order first.
#[rustfmt::skip]
const CENTRE_NUM: [f64; 8] = [
    3.387_132_872_796_366_5, 1.331_416_678_917_843_8e2, 1.971_590_950_306_551_3e3, 1.373_169_376_550_946e4,
    4.592_195_393_154_987e4, 6.726_577_092_700_87e4, 3.343_057_558_358_813e4, 2.509_080_928_730_122_7e3,
];
#[rustfmt::skip]
const CENTRE_DEN: [f64; 8] = [
    1.0, 4.231_333_070_160_091e1, 6.871_870_074_920_579e2, 5.394_196_021_424_751e3,
    2.121_379_430_158_659_7e4, 3.930_789_580_009_271e4, 2.872_908_573_572_194_3e4, 5.226_495_278_852_854e3,
];
#[rustfmt::skip]
const MIDDLE_NUM: [f64; 8] = [
    1.423_437_110_749_683_5, 4.630_337_846_156_546, 5.769_497_221_460_691, 3.647_848_324_763_204_5,
    1.270_458_252_452_368_4, 2.417_807_251_774_506e-1, 2.272_384_498_926_918_4e-2, 7.745_450_142_783_414e-4,
];
#[rustfmt::skip]
const MIDDLE_DEN: [f64; 8] = [
    1.0, 2.053_191_626_637_759, 1.676_384_830_183_803_8, 6.897_673_349_851e-1,
    1.481_039_764_274_800_8e-1, 1.519_866_656_361_645_7e-2, 5.475_938_084_995_345e-4, 1.050_750_071_644_416_9e-9,
];
#[rustfmt::skip]
const TAIL_NUM: [f64; 8] = [
    6.657_904_643_501_104, 5.463_784_911_164_114, 1.784_826_539_917_291_3, 2.965_605_718_285_048_7e-1,
    2.653_218_952_657_612_4e-2, 1.242_660_947_388_078_4e-3, 2.711_555_568_743_487_6e-5, 2.010_334_399_292_288_1e-7,
];
#[rustfmt::skip]
const TAIL_DEN: [f64; 8] = [
    1.0, 5.998_322_065_558_879e-1, 1.369_298_809_227_358e-1, 1.487_536_129_085_061_5e-2,
    7.868_691_311_456_133e-4, 1.846_318_317_510_054_7e-5, 1.421_511_758_316_446e-7, 2.044_263_103_389_939_8e-15,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_match_published_values() {
        // Abramowitz & Stegun table 26.5 and the values printed with AS 241.
        for (p, z) in [
            (0.25, -0.674_489_750_196_081_7),
            (0.001, -3.090_232_306_167_813_5),
            (1e-20, -9.262_340_089_798_408),
            (0.975, 1.959_963_984_540_054),
        ] {
            assert!((normal_quantile(p) - z).abs() < 1e-12 * (1.0 + z.abs()), "{p}: {}", normal_quantile(p));
        }
        assert_eq!(normal_quantile(0.5), 0.0);
    }

    #[test]
    fn streams_are_functions_of_their_key_alone() {
        let first = |seed, index, purpose, lane| Stream::with_lane(seed, index, purpose, lane).bits();
        let reference = first(7, 3, Purpose::Scatter, 0);
        assert_eq!(reference, first(7, 3, Purpose::Scatter, 0));
        for other in [
            first(8, 3, Purpose::Scatter, 0),
            first(7, 4, Purpose::Scatter, 0),
            first(7, 3, Purpose::ForceNoise, 0),
            first(7, 3, Purpose::Scatter, 1),
        ] {
            assert_ne!(reference, other);
        }
    }

    #[test]
    fn normal_has_mean_0_and_variance_1() {
        let mut s = Stream::new(1, 2, Purpose::ForceNoise);
        let n = 200_000_u32;
        let (mut sum, mut square) = (0.0, 0.0);
        for _ in 0..n {
            let z = s.normal();
            sum += z;
            square += z * z;
        }
        let (mean, variance) = (sum / f64::from(n), square / f64::from(n));
        // Standard errors: 1/sqrt(n) and sqrt(2/n).
        assert!(mean.abs() < 4.0 / (f64::from(n)).sqrt(), "mean {mean}");
        assert!((variance - 1.0).abs() < 4.0 * (2.0 / f64::from(n)).sqrt(), "variance {variance}");
    }
}
