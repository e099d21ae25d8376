//! What a search makes of the specs of effects, whatever the data: how large is large enough, and which experiments tell effects
//! apart.

use gripgen_twin::effects::{Experiment, LIBRARY, Measured, Visible, find};

/// Whether a size is enough for an effect, in a campaign of so many hours with such a largest label.
pub(crate) fn is_visible(from: Visible, size: f64, hours: f64, largest_n: f64) -> bool {
    match from {
        Visible::Always => true,
        Visible::From(least) => size >= least,
        Visible::OverTheCampaign(least) => size * hours >= least,
        Visible::AtTheLargestForce(least) => size * largest_n >= least,
    }
}

/// Experiments with `measured` that tell some suspects apart, by their ids; names that are no effects say nothing.
pub(crate) fn separating(measured: Measured, suspects: &[&str]) -> Vec<Experiment> {
    let mut all: Vec<Experiment> =
        LIBRARY.iter().flat_map(|s| s.experiments).copied().filter(|e| e.of() == measured).collect();
    all.sort_unstable();
    all.dedup();
    all.retain(|e| separates(*e, suspects));
    all
}

/// Whether an experiment is of use for some suspects: it shows one of them, and leaves another one alone where it has such a side.
fn separates(experiment: Experiment, suspects: &[&str]) -> bool {
    let specs = || suspects.iter().filter_map(|id| find(id));
    let two_sided = LIBRARY.iter().any(|s| s.not_shown_by.contains(&experiment));
    specs().any(|s| s.experiments.contains(&experiment))
        && (!two_sided || specs().any(|s| s.not_shown_by.contains(&experiment)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Effects are told apart by what shows one and not the other, and by nothing where there is one suspect of two sides.
    #[test]
    fn experiments_separate_what_they_show_from_what_they_leave() {
        use Experiment::*;
        assert_eq!(
            separating(Measured::Pulls, &["sensor_bias", "load_offset"]),
            [NoLoadReading, PullsUpAndDown, GripForceWithALoadCell]
        );
        assert_eq!(separating(Measured::Presses, &["exposure", "rest_offset"]), [FrameWithoutContact]);
        assert_eq!(separating(Measured::Presses, &["exposure"]), [], "nothing to be told apart from");
        assert_eq!(separating(Measured::SensorTable, &["sensor_creep", "a word"]), [ConstantLoad]);
    }
}
