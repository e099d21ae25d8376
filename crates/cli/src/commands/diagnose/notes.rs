//! The remarks that decide how far an answer may be believed: they are said without `-v`.

use gripgen_identify::{Channel, Diagnosis};

/// Remarks that are said at most.
const MOST: usize = 2;

/// Names of what lies far off that are said.
const NAMES: usize = 5;

/// The remarks that decide: what lies far off, where alone something was seen, noise that hides an offset, values at a bound.
pub fn deciding(diagnosis: &Diagnosis) -> Vec<String> {
    far_off(diagnosis).into_iter().chain(diagnosis.deciding.iter().cloned()).take(MOST).collect()
}

/// What lies far off, by name.
fn far_off(diagnosis: &Diagnosis) -> Option<String> {
    let data = &diagnosis.data;
    let far = data.outliers.len();
    let (all, what) = match diagnosis.channel {
        Channel::Pulls => (data.pulls, "pull"),
        Channel::Sensor => (data.rows, "row"),
        Channel::Presses => (data.presses, "press"),
        Channel::Imprints => (data.imprints, "imprint"),
    };
    let names = data.outliers.iter().take(NAMES).cloned().collect::<Vec<_>>().join(", ");
    let many = if what == "press" { "presses".into() } else { format!("{what}s") };
    let of = all.map_or(String::new(), |all| format!(" of {all}"));
    match far {
        0 => None,
        1 => Some(format!("{what} {names} lies far off: look at it, or leave it out")),
        2..=NAMES => Some(format!("{far}{of} {many} lie far off: {names}")),
        _ => Some(format!("{far}{of} {many} lie far off: {names} and {} more", far - NAMES)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_identify::DataSummary;

    fn with(outliers: &[&str], decide: &[&str]) -> Vec<String> {
        let outliers = outliers.iter().map(ToString::to_string).collect();
        let data = DataSummary { pulls: Some(120), outliers, ..Default::default() };
        let mut d = Diagnosis::blank(Channel::Pulls, data);
        d.notes.push("3 pulls were left out".into());
        decide.iter().for_each(|note| d.decides(note.to_string()));
        deciding(&d)
    }

    #[test]
    fn pulls_far_off_are_named_and_two_remarks_are_enough() {
        assert_eq!(with(&["7"], &[]), ["pull 7 lies far off: look at it, or leave it out"]);
        assert_eq!(with(&["a", "b"], &[]), ["2 of 120 pulls lie far off: a, b"]);
        let many = with(&["a", "b", "c", "d", "e", "f", "g"], &[]);
        assert_eq!(many, ["7 of 120 pulls lie far off: a, b, c, d, e and 2 more"]);
        assert_eq!(with(&[], &["only there", "noise", "bound"]), ["only there", "noise"]);
        assert_eq!(with(&["7"], &["noise", "bound"]).len(), 2);
        assert!(with(&[], &[]).is_empty());
    }
}
