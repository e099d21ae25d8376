//! Where the residual lies that a model leaves: by zone, colour and order.

use super::observed::Observed;
use super::predict::{ActingEffect, PRESS_ZONES};

/// Names of the zones, in their order, as the report has them.
const ZONES: [&str; PRESS_ZONES] = ["contact", "rim", "shadow zone", "far field"];

const COLOURS: [&str; 3] = ["red", "green", "blue"];

const THIRDS: [&str; 3] = ["first third", "middle", "last third"];

/// Mean squared residuals of a model in grey levels squared, zones alike.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Left {
    zones: [f64; PRESS_ZONES],
    colours: [f64; 3],
    thirds: [f64; 3],
}

impl Left {
    /// What a model leaves of the presses, without the gain that each of them may have.
    pub(super) fn of(observed: &Observed<'_>, acting: &[ActingEffect]) -> Self {
        let count = observed.count();
        let squares = observed.for_each(count, |i| observed.squares(i, acting).0);
        let mean = |of: &dyn Fn(usize, usize, usize) -> bool| {
            let (mut sum, mut n) = (0.0, 0.0);
            for (i, press) in squares.iter().enumerate() {
                for (z, zone) in press.iter().enumerate() {
                    for (_, square) in zone.iter().enumerate().filter(|(c, v)| v.is_finite() && of(i, z, *c))
                    {
                        (sum, n) = (sum + square, n + 1.0);
                    }
                }
            }
            sum / f64::max(n, 1.0)
        };
        let third = |i: usize| (3 * i / count.max(1)).min(2);
        Self {
            zones: std::array::from_fn(|zone| mean(&|_, z, _| z == zone)),
            colours: std::array::from_fn(|colour| mean(&|_, _, c| c == colour)),
            thirds: std::array::from_fn(|part| mean(&|i, _, _| third(i) == part)),
        }
    }

    /// A remark with the shares.
    pub(super) fn text(&self, times: f64) -> String {
        format!(
            "what is left is {times:.0} times the noise; by zone: {}; by colour: {}; by order: {}",
            shares(&ZONES, &self.zones),
            shares(&COLOURS, &self.colours),
            shares(&THIRDS, &self.thirds)
        )
    }
}

fn shares(names: &[&str], values: &[f64]) -> String {
    let sum = values.iter().sum::<f64>().max(1e-300);
    let each = names.iter().zip(values).map(|(name, v)| format!("{name} {:.0} %", 100.0 * v / sum));
    each.collect::<Vec<_>>().join(", ")
}
