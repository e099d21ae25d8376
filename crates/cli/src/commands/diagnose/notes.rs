//! The remarks that decide how far an answer may be believed: they are said without `-v`.

use gripgen::identify::{Channel, Diagnosis};

/// Remarks that are said at most.
const MOST: usize = 2;

/// Names of what lies far off that are said.
const NAMES: usize = 5;

/// What marks the notes of a diagnosis that decide, the most important first.
const DECIDING: [fn(&str) -> bool; 3] = [
    |note| note.ends_with(", and only there"),
    |note| note.starts_with("the labels are those of a force sensor with"),
    |note| note.contains("stands at the bound"),
];

/// The remarks that decide: what lies far off, where alone something was seen, noise that hides an offset, values at a bound.
pub fn deciding(diagnosis: &Diagnosis) -> Vec<String> {
    let of = |is: fn(&str) -> bool| diagnosis.notes.iter().filter(move |note| is(note)).cloned();
    far_off(diagnosis).into_iter().chain(DECIDING.into_iter().flat_map(of)).take(MOST).collect()
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
    use gripgen::identify::DataSummary;

    fn with(outliers: &[&str], notes: &[&str]) -> Vec<String> {
        let outliers = outliers.iter().map(ToString::to_string).collect();
        let data = DataSummary { pulls: Some(120), outliers, ..Default::default() };
        let mut d = Diagnosis::blank(Channel::Pulls, data);
        d.notes = notes.iter().map(ToString::to_string).collect();
        deciding(&d)
    }

    #[test]
    fn pulls_far_off_are_named_and_two_remarks_are_enough() {
        assert_eq!(with(&["7"], &["x"]), ["pull 7 lies far off: look at it, or leave it out"]);
        assert_eq!(with(&["a", "b"], &[]), ["2 of 120 pulls lie far off: a, b"]);
        let many = with(&["a", "b", "c", "d", "e", "f", "g"], &[]);
        assert_eq!(many, ["7 of 120 pulls lie far off: a, b, c, d, e and 2 more"]);
        let noise =
            "the labels are those of a force sensor with 0.87 N of noise or more, the twin says 0.12 N";
        let only = "humidity_pct*part: it was seen where part is lever, and only there";
        let bound = "wear.depth = 0.9 stands at the bound of what is fitted, 0.9";
        assert_eq!(with(&[], &["left out", bound, noise, only]), [only, noise]);
        assert_eq!(with(&["7"], &[bound]).len(), 2);
        assert!(with(&[], &["left out"]).is_empty());
    }
}
