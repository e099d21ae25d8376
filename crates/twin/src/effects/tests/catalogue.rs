//! What the specs say of their effects: checked by calling the hooks, and against each other.

use super::super::testing::grip;
use super::super::*;
use crate::{Covariates, OpticsState};

/// What a spec says of its sensor hook is what the hook does: at another time, and after other readings.
#[test]
fn declared_traits_are_those_of_the_hooks() {
    for spec in LIBRARY {
        let between = |p: &ParameterSpec| {
            let far = if (p.bounds.1 - p.neutral).abs() > (p.neutral - p.bounds.0).abs() {
                p.bounds.1
            } else {
                p.bounds.0
            };
            p.neutral + 0.2 * (far - p.neutral)
        };
        let parameters: Vec<f64> = spec.parameters.iter().map(between).collect();
        let Some(hook) = spec.sensor else {
            assert!(!spec.reads_clock && !spec.remembers, "{}", spec.id);
            continue;
        };
        let last = |before: &[f64], clock_s: f64| {
            let (mut memory, mut reading) = (SensorMemory::default(), 0.0);
            for (k, force_n) in before.iter().chain(&[7.0]).enumerate() {
                let at =
                    SensorPoint { clock_s: clock_s + 0.01 * k as f64, since_zero_s: clock_s, step_s: 0.01 };
                reading = hook(&parameters, *force_n, &mut memory, &at);
            }
            reading
        };
        let (rising, falling) = ([1.0, 3.0, 6.0], [19.0, 15.0, 9.0]);
        assert_eq!(last(&rising, 0.0) != last(&rising, 7200.0), spec.reads_clock, "{}: clock", spec.id);
        assert_eq!(last(&rising, 0.0) != last(&falling, 0.0), spec.remembers, "{}: memory", spec.id);
    }
}

/// Laws that parts may have each in their own way are those of their contact, and nothing else of the rig.
#[test]
fn only_contacts_differ_by_part() {
    for spec in LIBRARY.iter().filter(|s| s.per_part) {
        let of_rig = spec.normal_force.is_some() || spec.sensor.is_some() || spec.command.is_some();
        assert!((spec.friction.is_some() || spec.creep.is_some()) && !of_rig, "{}", spec.id);
    }
}

/// What a picture of the contact needs is what an effect that is not drawn leaves alone.
#[test]
fn effects_that_are_not_drawn_change_light_and_camera_only() {
    let covariates = Covariates { pull_index: 500, time_s: 7200.0, ..Default::default() };
    for spec in LIBRARY.iter().filter(|s| s.optics.is_some()) {
        let fit = spec.presses.unwrap_or_else(|| panic!("{} cannot be fitted to presses", spec.id));
        let mut seen = OpticsState::default();
        let hook = spec.optics.unwrap();
        hook(&spec.typical_values(), &mut seen, &grip(&covariates, 40.0));
        let frame = OpticsState {
            light_gain: seen.light_gain,
            background: seen.background,
            finer_background: seen.finer_background,
            exposure_gain: seen.exposure_gain,
            gamma: seen.gamma,
            rest_offset: seen.rest_offset,
            ..OpticsState::default()
        };
        assert_ne!(seen, OpticsState::default(), "{} does nothing where it is typical", spec.id);
        assert_eq!(seen != frame, fit.drawn, "{}: drawn", spec.id);
    }
}

/// Every spec says what happens, what its number means, what to do, and what a rig with it looks like.
#[test]
fn every_effect_speaks_to_people() {
    for spec in LIBRARY {
        for text in [spec.plainly, spec.number_means, spec.remedy] {
            assert!(text.len() > 20 && text.ends_with('.') && text.is_ascii(), "{}: {text}", spec.id);
        }
        assert!(spec.parameters.iter().any(|p| spec.number_means.contains(p.name)), "{}", spec.id);
        let values = spec.typical_values();
        assert!(values.iter().zip(spec.parameters).any(|(x, p)| *x != p.neutral), "{}", spec.id);
        for (x, p) in values.iter().zip(spec.parameters) {
            assert!(p.bounds.0 <= *x && *x <= p.bounds.1, "{}.{}: typical {x}", spec.id, p.name);
        }
        assert!(spec.typical.iter().all(|(name, _)| spec.position(name).is_some()), "{}", spec.id);
        assert_eq!(spec.group == Group::Optics, spec.optics.is_some(), "{}", spec.id);
        assert!(
            !spec.acts_on().is_empty() && (1..=spec.parameters.len()).contains(&spec.sizes),
            "{}",
            spec.id
        );
    }
    let groups: Vec<usize> =
        LIBRARY.iter().map(|s| Group::ALL.iter().position(|g| *g == s.group).unwrap()).collect();
    assert!(groups.is_sorted(), "the library is in the order of its groups");
}

/// A fit to pulls names parameters that exist, starts inside its bounds, and leaves references alone.
#[test]
fn fits_to_pulls_name_their_own_parameters_and_start_inside_their_bounds() {
    for rests in [false, true] {
        let span = PullSpan {
            varies: &|_| true,
            largest_reading_n: 42.0,
            last_pull_index: 300.0,
            splits: vec![100.0, 200.0],
            rests,
            creep_mm_per_n_s: None,
        };
        let mut fitted = 0;
        for spec in LIBRARY {
            let Ok(fit) = spec.pulls else {
                let why = spec.pulls.err().unwrap_or_default();
                assert!(why.len() > 20, "{}", spec.id);
                assert!(why.contains("images") == spec.optics.is_some(), "{}: another reason", spec.id);
                continue;
            };
            fitted += 1;
            assert!(spec.optics.is_none(), "{} is not felt", spec.id);
            let found = (fit.fit)(&span);
            assert!(!found.starts.is_empty() && !found.free.is_empty(), "{}", spec.id);
            for (name, scale) in &found.free {
                assert!(spec.position(name).is_some() && *scale > 0.0, "{}.{name}", spec.id);
                assert!(!spec.references.contains(name), "{}.{name} is a reference", spec.id);
            }
            for start in &found.starts {
                assert!(start.iter().all(|(name, _)| spec.position(name).is_some()), "{}", spec.id);
                let values = spec.values(start);
                for (x, p) in values.iter().zip(spec.parameters) {
                    let (low, high) = (fit.bounds)(p.name, &values, p.bounds);
                    assert!(p.bounds.0 <= low && high <= p.bounds.1, "{}.{}", spec.id, p.name);
                    assert!(low <= *x && *x <= high, "{}.{} starts at {x}", spec.id, p.name);
                }
            }
        }
        assert!(fitted > 20, "{fitted}");
    }
}

/// A fit to a table or to presses names parameters that exist, and its grid lies inside its bounds.
#[test]
fn fits_to_tables_and_presses_name_their_own_parameters() {
    let span = TableSpan { lowest_n: -3.0, highest_n: 40.0, step_s: 0.02, longest_s: 30.0, whole_s: 600.0 };
    for spec in LIBRARY {
        if let Some(fit) = spec.table {
            assert!(spec.sensor.is_some() && !fit.acts_through.is_empty(), "{}", spec.id);
            if let Some(grid) = fit.grid {
                let (name, values) = grid(&span);
                let at = spec.position(name).unwrap_or_else(|| panic!("{}.{name}", spec.id));
                let (low, high) = (fit.bounds)(&span, spec.parameters[at].bounds);
                let inside = |x: &f64| low * (1.0 - 1e-12) <= *x && *x <= high * (1.0 + 1e-12);
                assert!(values.iter().all(inside), "{}.{name}: {values:?}", spec.id);
            }
        }
        if let Some(fit) = spec.presses {
            assert!(spec.position(fit.main).is_some(), "{}.{}", spec.id, fit.main);
            assert!(fit.tried.is_none_or(|name| spec.position(name).is_some()), "{}", spec.id);
            for p in spec.parameters {
                let (start, scale) = (fit.start)(p.name, 0.05);
                assert!(p.bounds.0 <= start && start <= p.bounds.1 && scale > 0.0, "{}.{}", spec.id, p.name);
            }
        }
    }
}

/// No experiment both shows an effect and leaves it as it is, and each is done with data that the effect is fitted to.
#[test]
fn experiments_are_those_of_data_that_show_the_effect() {
    for spec in LIBRARY {
        assert!(!spec.experiments.iter().any(|e| spec.not_shown_by.contains(e)), "{}", spec.id);
        assert!(spec.leaves.iter().all(|id| find(id).is_some()), "{}", spec.id);
        for experiment in spec.experiments {
            let fits = match experiment.of() {
                Measured::Pulls => spec.pulls.is_ok(),
                Measured::SensorTable => spec.table.is_some(),
                Measured::Presses => spec.presses.is_some(),
                Measured::Imprints => spec.imprints.is_some(),
            };
            assert!(fits, "{}: {experiment:?}", spec.id);
        }
    }
}

/// A slope that vanishes at the neutral value is that of an effect of which a little does nothing, and the other way round.
#[test]
fn flat_effects_do_nothing_while_they_are_small() {
    let mut flat = 0;
    for spec in LIBRARY {
        let Ok(fit) = spec.pulls else { continue };
        let p = spec.parameters[0];
        let far = if p.neutral > 0.0 { p.bounds.0 } else { p.bounds.1 };
        let mut values = spec.values(&[]);
        values[0] = p.neutral + 1e-4 * (far - p.neutral);
        // Two forces, a microsecond apart and an hour after the start, so that what has a memory or reads the clock does something.
        let mut memory = SensorMemory::default();
        let mut read = |hook: SensorHook, force_n, clock_s| {
            hook(&values, force_n, &mut memory, &SensorPoint { clock_s, since_zero_s: clock_s, step_s: 1e-6 })
        };
        let felt = match (spec.sensor, spec.command) {
            (Some(hook), _) => [read(hook, 40.0, 3600.0) - 40.0, read(hook, 80.0, 3600.0) - 80.0],
            (_, Some(hook)) => [hook(&values, 80.0, 79.0) - 80.0, 0.0],
            (None, None) => continue,
        };
        assert_eq!(felt == [0.0, 0.0], fit.flat_at_neutral, "{}: {felt:?}", spec.id);
        flat += usize::from(fit.flat_at_neutral);
    }
    assert!(flat > 0, "no effect is flat");
}
