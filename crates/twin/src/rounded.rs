//! Numbers for people: short, and never on the wrong side of a limit that stands beside them.

/// Digits that are enough for most sentences.
const DIGITS: i32 = 3;
/// Digits of a number that is written out.
const ALL: i32 = 17;

/// A number with three significant digits, or as many more as it takes to be above, below or at each of `beside` as the
/// number itself is. What is short already is not made shorter: `20` stays `20`, 40.548869948502436 is `40.5`.
pub fn rounded(x: f64, beside: &[f64]) -> String {
    if !x.is_finite() || x == 0.0 {
        return x.to_string();
    }
    let above = libm::floor(libm::log10(x.abs())) as i32 + 1;
    (DIGITS..=ALL)
        .map(|digits| format!("{x:.*}", (digits - above).max(0) as usize))
        .find(|text| {
            let short: f64 = text.parse().unwrap_or(f64::NAN);
            beside.iter().all(|limit| short.partial_cmp(limit) == x.partial_cmp(limit))
        })
        .map_or_else(|| x.to_string(), |text| trimmed(&text))
}

/// Without zeros at the end of a fraction.
fn trimmed(text: &str) -> String {
    let short = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text };
    short.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_keep_their_side_of_a_limit() {
        for (x, beside, text) in [
            (40.548_869_948_502_436, &[][..], "40.5"),
            (20.0, &[], "20"),
            (1234.5, &[], "1234"),
            (183.5, &[], "184"),
            (0.012_345, &[], "0.0123"),
            (-7.25, &[], "-7.25"),
            (0.0, &[], "0"),
            (19.999, &[20.0, 80.0], "19.999"),
            (19.97, &[20.0, 80.0], "19.97"),
            (80.04, &[20.0, 80.0], "80.04"),
            (10.0, &[20.0, 80.0], "10"),
            (f64::INFINITY, &[], "inf"),
        ] {
            assert_eq!(rounded(x, beside), text, "{x}");
        }
    }
}
