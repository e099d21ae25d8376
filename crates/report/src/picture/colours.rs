//! The colours of all pictures.

use super::canvas::Rgb;

/// The background.
pub const PAPER: Rgb = Rgb(255, 255, 255);
/// The background of a plot or of an image that is missing.
pub const PANEL: Rgb = Rgb(246, 247, 249);
/// Text.
pub const INK: Rgb = Rgb(33, 37, 43);
/// Text that explains.
pub const SOFT_INK: Rgb = Rgb(110, 117, 128);
/// Grid lines.
pub const GRID: Rgb = Rgb(222, 226, 231);
/// The commanded force.
pub const COMMAND: Rgb = Rgb(150, 156, 166);
/// The measured force.
pub const MEASURED: Rgb = Rgb(24, 94, 178);
/// Slip.
pub const SLIP: Rgb = Rgb(205, 58, 36);
pub(crate) const DISPLACEMENT: Rgb = Rgb(40, 140, 92);
/// What failed.
pub const FAILED: Rgb = Rgb(176, 42, 42);

/// A perceptually even scale from dark to bright for `t` in 0..=1: nine stops of viridis (van der Walt & Smith,
/// CC0), linear between them.
pub(crate) fn scale(t: f64) -> Rgb {
    const STOPS: [Rgb; 9] = [
        Rgb(68, 1, 84),
        Rgb(71, 44, 122),
        Rgb(59, 81, 139),
        Rgb(44, 113, 142),
        Rgb(33, 144, 141),
        Rgb(39, 173, 129),
        Rgb(92, 200, 99),
        Rgb(170, 220, 50),
        Rgb(253, 231, 37),
    ];
    let at = t.clamp(0.0, 1.0) * 8.0;
    let i = (at as usize).min(7);
    let f = at - i as f64;
    let mix = |a: u8, b: u8| (f64::from(a) + f * (f64::from(b) - f64::from(a))).round() as u8;
    let (a, b) = (STOPS[i], STOPS[i + 1]);
    Rgb(mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}
