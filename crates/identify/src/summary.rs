//! The answer in a sentence or two for a technician: what acts in the words of the catalogue, and what it does to the error.

use crate::diagnosis::{Channel, Diagnosis, HeldOutError, UnknownCovariate, Verdict};
use gripgen_twin::effects::find;

/// From this many times the noise of the camera on what is left of images is said.
const FAR_ABOVE_NOISE: f64 = 10.0;

/// Share of the evidence below which an effect is reported as `Perhaps`.
pub const MIN_REPORTABLE_WEIGHT: f64 = 0.1;

/// What a diagnosis says, without names of effects and parameters.
pub fn summary_sentence(d: &Diagnosis) -> String {
    let mut text = match d.verdict {
        Verdict::Insufficient => {
            return match d.notes.first() {
                // A note may be a question.
                Some(note) if note.ends_with('?') => format!("The data cannot answer: {note}"),
                Some(note) => format!("The data cannot answer: {note}."),
                None => "The data cannot answer.".into(),
            };
        }
        Verdict::None => "Nothing was found that the model lacks.".into(),
        Verdict::Unknown if d.unknown.is_empty() && d.not_described => {
            "The model does not describe these data, and nothing that was written down says why.".into()
        }
        Verdict::Unknown => format!("Something that the library has no name for goes with {}.", unknown(d)),
        Verdict::Effect => named(d),
    };
    text += &error(d);
    text += &left(d).map_or(String::new(), |times| {
        format!(
            " What is left is still {times:.0} times the noise of the camera: the model is not right there."
        )
    });
    text
}

/// How many times the noise what is left of images is, where that is far.
pub(crate) fn left(d: &Diagnosis) -> Option<f64> {
    let times = d.error.as_ref()?.after.mse? / d.noise_floor_mse.filter(|floor| *floor > 0.0)?;
    (times > FAR_ABOVE_NOISE).then_some(times)
}

fn named(d: &Diagnosis) -> String {
    let mut sentences: Vec<String> = Vec::new();
    for effect in &d.effects {
        let plainly = find(&effect.name).map_or(effect.name.as_str(), |spec| spec.plainly);
        let part = effect.part.as_ref().map_or(String::new(), |part| format!(" (Seen on {part} only.)"));
        let perhaps = if effect.weight < MIN_REPORTABLE_WEIGHT { "Perhaps: " } else { "" };
        sentences.push(format!("{perhaps}{plainly}{part}"));
        if effect.parameters.values().any(|p| p.at_bound) {
            sentences.push(
                "Its value stands at the end of what is fitted, so something else may look like it.".into(),
            );
        }
    }
    if !d.unknown.is_empty() {
        sentences.push(format!("Beside it something without a name goes with {}.", unknown(d)));
    }
    sentences.join(" ")
}

fn unknown(d: &Diagnosis) -> String {
    let names: Vec<String> = d.unknown.iter().map(UnknownCovariate::in_words).collect();
    match names.as_slice() {
        [] => "nothing that was written down".into(),
        [one] => one.clone(),
        [first @ .., last] if names.iter().any(|name| name.contains(' ')) => {
            format!("{}; and with {last}", first.join("; with "))
        }
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

fn error(d: &Diagnosis) -> String {
    let Some(error) = &d.error else { return String::new() };
    let of = |e: &HeldOutError| e.rmse_n.or(e.mse).or(e.rmse_mm3).filter(|v| v.is_finite());
    let (Some(before), Some(after)) = (of(&error.before), of(&error.after)) else { return String::new() };
    let (what, unit) = match d.channel {
        Channel::Pulls | Channel::Sensor => ("prediction error", "N"),
        Channel::Presses => ("mean squared error of the images", "grey levels\u{b2}"),
        Channel::Imprints => ("prediction error of the volume", "mm\u{b3}"),
    };
    match d.verdict {
        Verdict::None => format!(" The {what} is {after:.2} {unit}."),
        _ if after < before => format!(" The {what} falls from {before:.2} to {after:.2} {unit}."),
        _ => format!(" The {what} does not fall: {before:.2} before, {after:.2} {unit} after."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::{DataSummary, ErrorReport, ErrorsBy, NamedEffect, ParameterEstimate};
    use std::collections::BTreeMap;

    fn of(mse: [f64; 2]) -> Diagnosis {
        let error = |mse| HeldOutError { mse: Some(mse), ..Default::default() };
        let [before, after] = mse.map(error);
        let report = ErrorReport { heldout: "presses".into(), before, after, by: ErrorsBy::default() };
        Diagnosis {
            noise_floor_mse: Some(1.0),
            error: Some(report),
            ..Diagnosis::blank(Channel::Presses, DataSummary::default())
        }
    }

    #[test]
    fn a_note_that_asks_ends_in_one_sign() {
        for (note, end) in [("all forces in newtons, per jaw?", "jaw?"), ("4 pulls, 8 are needed", "needed.")]
        {
            let mut d = Diagnosis::blank(Channel::Pulls, DataSummary::default());
            d.notes.push(note.into());
            assert!(summary_sentence(&d).ends_with(end), "{}", summary_sentence(&d));
        }
    }

    #[test]
    fn a_residual_far_above_the_noise_is_no_clean_nothing() {
        let (mut near, mut far) = (of([3.0, 3.0]), of([40.0, 40.0]));
        near.conclude();
        far.conclude();
        assert!(!summary_sentence(&near).contains("times the noise"), "{}", summary_sentence(&near));
        assert!(summary_sentence(&far).contains("still 40 times the noise"), "{}", summary_sentence(&far));
    }

    /// A scale of 0.8 is the lowest that is fitted: it is marked, said, and trusted by half at most.
    #[test]
    fn a_value_at_its_bound_is_said() {
        let with = |name: &str, parameter: &str, value: f64| {
            let mut d = of([30.0, 5.0]);
            d.effects.push(NamedEffect {
                name: name.into(),
                part: None,
                class: vec![name.into()],
                weight: 0.95,
                parameters: BTreeMap::from([(
                    parameter.into(),
                    ParameterEstimate::new(value, (value, value), "1"),
                )]),
                indistinguishable_from: Vec::new(),
                separate_by: None,
                named_again: None,
            });
            d.conclude();
            d
        };
        let scaled = |scale: f64| with("misregistration", "scale", scale);
        let (inside, at) = (scaled(0.9), scaled(0.8));
        assert!(!inside.effects[0].parameters["scale"].at_bound && inside.notes.is_empty());
        assert_eq!(inside.effects[0].weight, 0.95);
        assert!(at.effects[0].parameters["scale"].at_bound && at.notes[0].contains("0.8"), "{:?}", at.notes);
        assert!(!summary_sentence(&inside).starts_with("Perhaps: "), "{}", summary_sentence(&inside));
        let mut light = scaled(0.9);
        light.effects[0].weight = 0.01;
        assert!(summary_sentence(&light).starts_with("Perhaps: "), "{}", summary_sentence(&light));
        assert!(
            at.effects[0].weight <= 0.5 && summary_sentence(&at).contains("something else may look like it")
        );
        let neutral = scaled(1.0);
        assert!(!neutral.effects[0].parameters["scale"].at_bound, "a neutral value is no end");
        // Between 1 N and a million newtons, which stand for no limit.
        for (limit_n, end) in [(11.0, false), (1.0, true)] {
            let limited = with("sensor_saturation", "limit_n", limit_n);
            assert_eq!(limited.effects[0].parameters["limit_n"].at_bound, end, "{limit_n} N");
        }
    }
}
