//! Settings that a machine carried out, as the levels that were meant.

/// Ratio below which two times are one level, and above which they are two.
const RATIO: f64 = 1.5;

/// A rig that should wait 1 s waits 1.02 s, then 1.11 s: no two pulls have the same time, and a curve with a knot at each would
/// fit noise. Where times fall into groups, each within a factor of 1.5 and each a factor of 1.5 away from the next, the times
/// of a group are replaced by their median; all others (spread out on purpose) stay as they are. Ageing goes with the
/// logarithm of the wait (Dieterich, Journal of Geophysical Research 77, 1972): of 5 % for each factor e, 2 % lie within 1.5.
pub fn levels(x: &[f64]) -> Vec<f64> {
    let mut sorted = x.to_vec();
    sorted.sort_by(f64::total_cmp);
    if sorted.first().is_none_or(|least| least.is_nan() || *least <= 0.0) {
        return x.to_vec();
    }
    let groups: Vec<&[f64]> = sorted.chunk_by(|a, b| *b < RATIO * a).collect();
    if groups.iter().any(|group| group[group.len() - 1] >= RATIO * group[0]) {
        return x.to_vec();
    }
    let level = |v: f64| groups.iter().find(|group| v <= group[group.len() - 1]);
    x.iter().map(|v| level(*v).map_or(*v, |group| group[group.len() / 2])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_of_a_rig_are_the_levels_that_were_planned() {
        let carried_out = [1.022, 10.14, 1.08, 60.2, 10.31, 1.34, 60.02];
        assert_eq!(levels(&carried_out), [1.08, 10.31, 1.08, 60.2, 10.31, 1.08, 60.2]);
        assert_eq!(levels(&[1.02, 1.34, 1.1]), [1.1; 3], "one level: nothing varies");
    }

    #[test]
    fn times_that_were_spread_out_stay() {
        let spread: Vec<f64> = (0..20).map(|i| libm::exp(0.2 * f64::from(i))).collect();
        assert_eq!(levels(&spread), spread);
        assert_eq!(levels(&[0.0, 1.0, 1.1]), [0.0, 1.0, 1.1], "no ratio to 0");
        assert!(levels(&[]).is_empty());
        let exact = [1.0, 10.0, 60.0, 1.0];
        assert_eq!(levels(&exact), exact);
    }
}
