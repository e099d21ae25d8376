//! Clocks and counts of a table that are not counted from where gripgen counts them.

use gripgen_twin::MeasuredPull;
use std::collections::BTreeMap;

/// Seconds from which on a time is no time since the start of a campaign, but one since 1970: three years.
const EPOCH_S: f64 = 1e8;

/// The same in milliseconds: in seconds it would be the year 5138.
const EPOCH_MS: f64 = 1e11;

/// Takes Unix time from the earliest pull on. Returns a remark.
pub(super) fn from_the_first(pulls: &mut [MeasuredPull]) -> Option<String> {
    let first = pulls.iter().map(|p| p.covariates.time_s).fold(f64::INFINITY, f64::min);
    if !(first.is_finite() && first.abs() >= EPOCH_S) {
        return None;
    }
    let (scale, unit) = if first >= EPOCH_MS { (1e-3, "ms") } else { (1.0, "s") };
    pulls.iter_mut().for_each(|p| p.covariates.time_s = (p.covariates.time_s - first) * scale);
    Some(format!(
        "time_s begins at {first} {unit}, as a time since 1970: it was taken in seconds from the first pull on"
    ))
}

/// The first place at which a clock goes back from one row to the next of the same session.
pub(super) fn goes_back(pulls: &[MeasuredPull]) -> Option<String> {
    let back = pulls.windows(2).find(|w| {
        let [a, b] = [&w[0].covariates, &w[1].covariates];
        a.session == b.session && b.time_s < a.time_s
    })?;
    Some(format!(
        "time_s goes back within a session: pull {} has {}, {} before it {}; rows stand in the order in which the pulls were made",
        back[1].id, back[1].covariates.time_s, back[0].id, back[0].covariates.time_s
    ))
}

/// Counts pulls from a new gel on where the count of the table goes on over it: 49 on the old gel, 50 on the new one.
pub(super) fn per_gel(pulls: &mut [MeasuredPull]) -> Option<String> {
    // Next count of each gel.
    let mut next: BTreeMap<String, u64> = BTreeMap::new();
    let mut counted = Vec::with_capacity(pulls.len());
    let mut went_on = None;
    // What is taken off the counts of the rows at hand.
    let mut less = 0_i128;
    for (row, pull) in pulls.iter().enumerate() {
        let (gel, index) = (&pull.covariates.gel_id, i128::from(pull.covariates.pull_index));
        if let Some(last) =
            row.checked_sub(1).map(|last| &pulls[last].covariates).filter(|c| c.gel_id != *gel)
        {
            if index <= i128::from(last.pull_index) {
                // It begins anew, or goes back to what the other gel had: it is a count of the gel.
                return None;
            }
            if index > i128::from(last.pull_index) + 1 && !next.contains_key(gel) {
                return None;
            }
            less = index - i128::from(next.get(gel).copied().unwrap_or(0));
            went_on.get_or_insert_with(|| (gel.clone(), pull.id.clone(), last.pull_index, index));
        }
        let own = u64::try_from(index - less).ok()?;
        next.insert(gel.clone(), own + 1);
        counted.push(own);
    }
    let (gel, id, last, index) = went_on?;
    pulls.iter_mut().zip(counted).for_each(|(pull, own)| pull.covariates.pull_index = own);
    Some(format!(
        "pull_index goes on over the new gel {gel} (pull {id}: {index} after {last}), and counts pulls made since a gel was new: \
         it was taken from 0 on with each gel. If {gel} had been used before, write its own count"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_twin::Covariates;

    fn pulls(rows: &[(&str, u64)]) -> Vec<MeasuredPull> {
        let pull = |(gel, index): &(&str, u64)| MeasuredPull {
            id: format!("p{index}"),
            part: "p".into(),
            grip_pose: 0,
            grip_force_n: 10.0,
            increment_n: 1.0,
            start_n: None,
            step_s: 0.1,
            covariates: Covariates { pull_index: *index, gel_id: (*gel).into(), ..Default::default() },
            max_pull_force_n: 3.0,
            zero_shift_n: 0.0,
            trace: None,
        };
        rows.iter().map(pull).collect()
    }

    fn counts(rows: &[(&str, u64)]) -> Option<Vec<u64>> {
        let mut pulls = pulls(rows);
        per_gel(&mut pulls).map(|_| pulls.iter().map(|p| p.covariates.pull_index).collect())
    }

    #[test]
    fn a_count_that_goes_on_over_a_new_gel_is_taken_per_gel() {
        assert_eq!(counts(&[("a", 7), ("a", 8), ("b", 9), ("b", 10)]), Some(vec![7, 8, 0, 1]));
        assert_eq!(counts(&[("a", 0), ("b", 1), ("a", 2), ("a", 3), ("b", 4)]), Some(vec![0, 0, 1, 2, 1]));
        // Counts of the gels themselves: it begins anew, or the gel was used before.
        assert_eq!(counts(&[("a", 7), ("a", 8), ("b", 0), ("b", 1)]), None);
        assert_eq!(counts(&[("a", 7), ("a", 8), ("b", 300), ("b", 301)]), None);
        assert_eq!(counts(&[("a", 7), ("a", 9)]), None);
    }

    #[test]
    fn unix_time_is_taken_from_the_first_pull_on() {
        let mut table = pulls(&[("a", 0), ("a", 1)]);
        let set = |table: &mut [MeasuredPull], times: [f64; 2]| {
            table.iter_mut().zip(times).for_each(|(p, t)| p.covariates.time_s = t);
        };
        let times = |table: &[MeasuredPull]| table.iter().map(|p| p.covariates.time_s).collect::<Vec<_>>();
        set(&mut table, [1_700_000_010.0, 1_700_000_000.0]);
        assert!(from_the_first(&mut table).is_some());
        assert_eq!(times(&table), [10.0, 0.0]);
        assert!(goes_back(&table).unwrap().contains("p1 has 0, p0 before it 10"));
        set(&mut table, [1_700_000_000_000.0, 1_700_000_090_000.0]);
        assert!(from_the_first(&mut table).unwrap().contains("1700000000000 ms"));
        assert_eq!(times(&table), [0.0, 90.0]);
        assert_eq!(from_the_first(&mut table), None);
        assert_eq!(goes_back(&table), None);
    }
}
