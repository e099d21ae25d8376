//! The diagnosis on pixels that nobody drew: a frame and contacts of random levels, light and camera that act on them.

use super::*;
use crate::draws::Draws;
use gripgen_twin::effects::GripPoint;
use gripgen_twin::{Covariates, Jaw, OpticsState};

const PRESSES: usize = 14;
const PIXELS_PER_ZONE: usize = 15;

/// A press every ten minutes.
const PRESS_H: f64 = 1.0 / 6.0;

/// What reaches the camera of each pixel: the frame at rest, and what the contact changes.
struct Camera {
    circumstances: Vec<Covariates>,
    pixels: Vec<PressPixels>,
    rest: Vec<Vec<[f64; 3]>>,
    contact: Vec<Vec<[f32; 3]>>,
    backwards: bool,
    /// Squared error of a frame per effect, at pixels that are not looked at.
    unseen_mse: f64,
}

impl Camera {
    /// Presses whose levels `change` turns into others, from press and place; with noise of pixels and of whole presses.
    fn new(seed: u64, change: impl Fn(usize, [f64; 2], [f64; 3]) -> [f64; 3]) -> Self {
        let mut draws = Draws::new(seed, 1);
        let mut camera = Self {
            circumstances: Vec::new(),
            pixels: Vec::new(),
            rest: Vec::new(),
            contact: Vec::new(),
            backwards: false,
            unseen_mse: 0.0,
        };
        for press in 0..PRESSES {
            let time_s = 3600.0 * PRESS_H * press as f64;
            camera.circumstances.push(Covariates { pull_index: press as u64, time_s, ..Default::default() });
            let common = [0; 3].map(|_| 0.05 * draws.normal());
            let (mut pixels, mut rest, mut contact) = (PressPixels::default(), Vec::new(), Vec::new());
            for k in 0..PRESS_ZONES * PIXELS_PER_ZONE {
                let zone = k / PIXELS_PER_ZONE;
                let place = [0; 2].map(|_| 2.0 * draws.uniform() - 1.0);
                let level = [0; 3].map(|_| 60.0 + 100.0 * draws.uniform());
                let pressed = [0; 3].map(|_| if zone < 2 { 20.0 * draws.normal() } else { 0.0 });
                let seen = change(press, place, [0, 1, 2].map(|c| level[c] + pressed[c]));
                pixels.measured.push([0, 1, 2].map(|c| (seen[c] + common[c] + draws.normal()) as f32));
                pixels.zones.push(zone as u8);
                pixels.places.push(place);
                rest.push(level);
                contact.push(pressed.map(|v| v as f32));
            }
            camera.pixels.push(pixels);
            camera.rest.push(rest);
            camera.contact.push(contact);
        }
        camera
    }
}

impl PredictPresses for Camera {
    fn circumstances(&self) -> &[Covariates] {
        &self.circumstances
    }

    fn px_mm(&self) -> f64 {
        0.1
    }

    fn noise_mse(&self) -> f64 {
        1.0
    }

    fn pixels(&self, press: usize) -> PressPixels {
        self.pixels[press].clone()
    }

    fn levels(&self, press: usize, acting: &[ActingEffect]) -> Vec<[f32; 3]> {
        let covariates = &self.circumstances[press];
        let at = GripPoint {
            jaw: Jaw::Left,
            grip_force_n: 0.0,
            contact_area_m2: 0.0,
            pull_rate_n_per_s: 0.0,
            covariates,
            grip: (0, 0),
        };
        let mut optics = OpticsState::default();
        for effect in acting {
            effect.spec.optics.unwrap()(&effect.values, &mut optics, &at);
        }
        let pixels = self.pixels[press].places.iter().zip(&self.rest[press]).zip(&self.contact[press]);
        let levels = pixels.map(|((&[u, v], rest), contact)| {
            [0, 1, 2].map(|c| {
                let light = optics.light_gain[c] * (rest[c] + f64::from(contact[c])) * optics.exposure_gain;
                let pattern = optics.background[c].iter().zip([u, v, u * u, u * v, v * v]);
                let response = 255.0 * (light.max(0.0) / 255.0).powf(optics.gamma);
                (response + optics.rest_offset[c] + pattern.map(|(b, term)| b * term).sum::<f64>()) as f32
            })
        });
        levels.collect()
    }

    fn contact_levels(&self, press: usize, _: &[ActingEffect]) -> Vec<[f32; 3]> {
        self.contact[press].clone()
    }

    fn frame_mse(&self, press: usize, acting: &[ActingEffect]) -> f64 {
        let levels = self.levels(press, acting);
        let squares = levels.iter().zip(&self.pixels[press].measured);
        let sum: f64 = squares.flat_map(|(a, b)| [0, 1, 2].map(|c| f64::from(a[c] - b[c]).powi(2))).sum();
        sum / (3 * levels.len()) as f64 + self.unseen_mse * acting.len() as f64
    }

    fn for_each(&self, n: usize, task: &(dyn Fn(usize) + Sync)) {
        if self.backwards {
            (0..n).rev().for_each(task);
        } else {
            (0..n).for_each(task);
        }
    }
}

fn data(covariates: Vec<PressCovariate>) -> PressData {
    let order = PressValues::Numbers((0..PRESSES).map(|i| i as f64).collect());
    let mut all = vec![PressCovariate { name: "pull_index".into(), values: order }];
    all.extend(covariates);
    PressData {
        names: (0..PRESSES).map(|i| format!("press-{i}")).collect(),
        sha256: "0".into(),
        noise_mse: 1.0,
        covariates: all,
        known: vec![PressNeeds::Marks],
        press_gain_sd: None,
    }
}

fn diagnosis(camera: &Camera) -> PressDiagnosis {
    diagnose_presses(camera, &data(Vec::new()), &mut |_, _| {})
}

/// The light's rates come back, and the 90 % intervals hold them about as often as they say.
#[test]
fn light_that_drifts_is_named_and_the_intervals_hold_its_rates() {
    let truth = [("red_per_h", -0.02), ("green_per_h", 0.03), ("blue_per_h", -0.04)];
    let (mut held, mut all) = (0, 0);
    for seed in 0..20 {
        let camera = Camera::new(seed, |press, _, level| {
            [0, 1, 2].map(|c| level[c] * (1.0 + truth[c].1 * PRESS_H * press as f64))
        });
        let found = diagnosis(&camera);
        assert_eq!(found.diagnosis.names(), ["light_drift"], "seed {seed}: {:?}", found.diagnosis);
        assert_eq!(found.acting[0].spec.id, "light_drift");
        for (name, rate) in truth {
            let p = &found.diagnosis.effects[0].parameters[name];
            assert!((p.value - rate).abs() < 0.004, "{name}: {p:?}");
            held += usize::from((p.low90..=p.high90).contains(&rate));
            all += 1;
        }
        let error = found.diagnosis.error.as_ref().unwrap();
        let (before, after) = (error.before.mse.unwrap(), error.after.mse.unwrap());
        assert!(before > 5.0 && (after - 1.0).abs() < 0.1, "{before} {after}");
    }
    // 54 of 60 on average, with a standard deviation of 2.3.
    assert!(held >= 46, "{held} of {all}");
}

/// A name that lowers the error where pixels are looked at and raises it over whole frames by more is a hint.
#[test]
fn what_makes_whole_frames_worse_is_no_name() {
    for (unseen_mse, named) in [(3.0, true), (60.0, false)] {
        let drift = |press: usize, _, level: [f64; 3]| level.map(|l| l * (1.0 + 0.004 * press as f64));
        let found = diagnosis(&Camera { unseen_mse, ..Camera::new(3, drift) });
        assert_eq!(
            found.diagnosis.names(),
            if named { vec!["light_drift"] } else { vec![] },
            "{:?}",
            found.diagnosis
        );
        let error = found.diagnosis.error.as_ref().unwrap();
        assert!(error.after.mse <= error.before.mse, "{error:?}");
        let hints = &found.diagnosis.hints;
        assert_eq!(
            hints.iter().any(|h| h.name == "light_drift" && h.reason.contains("whole frames")),
            !named,
            "{hints:?}"
        );
    }
}

/// Noise alone has no name, its error is its own, and every effect of the light has a size that would have been seen.
#[test]
fn nothing_is_named_where_nothing_acts() {
    for seed in 0..20 {
        let found = diagnosis(&Camera::new(100 + seed, |_, _, level| level));
        let d = &found.diagnosis;
        assert_eq!(
            (d.verdict, found.diagnosis.names(), d.unknown.len()),
            (Verdict::None, vec![], 0),
            "{seed}: {d:?}"
        );
        assert!(found.frame_mse.iter().all(|(before, after)| before == after), "nothing was added");
        assert_eq!(found.zone_mse[0], found.zone_mse[1]);
        assert!(found.zone_mse[0].iter().all(|mse| (mse - 1.0).abs() < 0.2), "{:?}", found.zone_mse);
        for name in ["light_drift", "rest_offset", "exposure", "background_change"] {
            assert!(d.would_have_seen[name].value > 0.0, "{name}: {:?}", d.would_have_seen);
        }
        assert!(!d.would_have_seen.contains_key("defocus"), "this camera shows no blur");
    }
}

/// Twice the size that would have been seen is seen, a third of it is not.
#[test]
fn sizes_that_would_have_been_seen_are_those_that_are() {
    let size = diagnosis(&Camera::new(5, |_, _, level| level)).diagnosis.would_have_seen["rest_offset"].value;
    assert!((0.02..2.0).contains(&size), "{size}");
    for (factor, expected) in [(2.0, vec!["rest_offset"]), (0.33, vec![])] {
        let offset = [0.0, factor * size, 0.0];
        let camera = Camera::new(6, |_, _, level| [0, 1, 2].map(|c| level[c] + offset[c]));
        assert_eq!(diagnosis(&camera).diagnosis.names(), expected, "{factor} of {size}");
    }
}

/// A camera that balances white, as its sensor file knows: red and blue wander by 5 %, green by 1 %. What all presses share is
/// told by green.
#[test]
fn beside_gains_that_wander_light_is_told_by_the_one_that_does_not() {
    let sd = [0.05, 0.01, 0.05];
    let wandering = |seed: u64, light: &dyn Fn(usize) -> f64| {
        let mut draws = Draws::new(seed, 5);
        let gains: Vec<[f64; 3]> =
            (0..PRESSES).map(|_| sd.map(|sd| libm::exp(sd * draws.normal()))).collect();
        let camera =
            Camera::new(seed, |press, _, level| [0, 1, 2].map(|c| level[c] * gains[press][c] * light(press)));
        let known = PressData { press_gain_sd: Some(sd), ..data(Vec::new()) };
        diagnose_presses(&camera, &known, &mut |_, _| {})
    };
    for seed in 30..36 {
        assert_eq!(wandering(seed, &|_| 1.0).diagnosis.names(), [""; 0], "{seed}: nothing but the balance");
        let (dimmer, drifting) =
            (wandering(seed, &|_| 0.96), wandering(seed, &|press| 1.0 - 0.009 * press as f64));
        for (found, name) in [(dimmer, "exposure"), (drifting, "light_drift")] {
            assert_eq!(found.diagnosis.names(), [name], "{seed}");
            assert!(found.diagnosis.effects[0].weight > 0.7, "{seed}: {:?}", found.diagnosis.effects);
        }
    }
}

/// A pattern from the sixth press on.
#[test]
fn a_background_that_changes_is_found_where_it_does() {
    let camera = Camera::new(7, |press, [u, v], level| {
        if press < 5 { level } else { [level[0] + 4.0 * u, level[1] - 3.0 * v, level[2] + 3.0 * u * v] }
    });
    let found = diagnosis(&camera);
    assert_eq!(found.diagnosis.names(), ["background_change"]);
    let p = &found.diagnosis.effects[0].parameters;
    assert_eq!(p["at_pull_index"].value, 5.0);
    assert!((p["red_u"].value - 4.0).abs() < 0.3 && (p["green_v"].value + 3.0).abs() < 0.3, "{p:?}");
}

/// The presses that it acts on scatter little, and it is no doubt that the others do not change: four of fourteen suffice, three do not.
#[test]
fn a_background_that_changes_late_is_found() {
    let late = |first: usize| {
        Camera::new(11, move |press, [u, v], level| {
            if press < first {
                level
            } else {
                [level[0] + 4.0 * u, level[1] - 3.0 * v, level[2] + 3.0 * u * v]
            }
        })
    };
    let found = diagnosis(&late(10));
    assert_eq!(found.diagnosis.names(), ["background_change"]);
    assert_eq!(found.diagnosis.effects[0].parameters["at_pull_index"].value, 10.0);
    assert_eq!(diagnosis(&late(11)).diagnosis.names(), [""; 0]);
}

/// What follows a column of the table alone is unknown by the name of the column.
#[test]
fn light_that_follows_a_column_is_unknown_by_its_name() {
    let volts: Vec<f64> =
        (0..PRESSES).map(|i| ((i * 5 + 2) % PRESSES) as f64 / PRESSES as f64 - 0.5).collect();
    let camera = Camera::new(8, |press, _, level| level.map(|l| l * (1.0 + 0.1 * volts[press])));
    let lamp = PressCovariate { name: "lamp_v".into(), values: PressValues::Numbers(volts) };
    let still = PressCovariate { name: "gel".into(), values: PressValues::Words(vec!["a".into(); PRESSES]) };
    let d = diagnose_presses(&camera, &data(vec![lamp, still]), &mut |_, _| {}).diagnosis;
    assert_eq!((d.verdict, d.unknown[0].covariate.as_str()), (Verdict::Unknown, "lamp_v"), "{d:?}");
    assert_eq!(d.not_excited, ["gel"]);
}

/// A press that went wrong is named as such and decides nothing.
#[test]
fn one_press_that_went_wrong_is_an_outlier() {
    let camera = Camera::new(9, |press, _, level| if press == 4 { level.map(|l| l + 25.0) } else { level });
    let found = diagnosis(&camera);
    assert_eq!(found.diagnosis.names(), [""; 0], "{:?}", found.diagnosis);
    assert_eq!(found.diagnosis.data.outliers, ["press-4"]);
}

#[test]
fn answers_do_not_depend_on_the_order_of_the_calls() {
    let drift = |press: usize, _, level: [f64; 3]| level.map(|l| l * (1.0 + 0.02 * press as f64));
    let backwards = Camera { backwards: true, ..Camera::new(10, drift) };
    assert_eq!(diagnosis(&backwards), diagnosis(&Camera::new(10, drift)));
}

#[test]
fn three_presses_are_too_few() {
    let mut camera = Camera::new(11, |_, _, level| level);
    camera.circumstances.truncate(3);
    let d = diagnosis(&camera).diagnosis;
    assert_eq!(d.verdict, Verdict::Insufficient);
    assert!(d.notes[0].contains("3 presses with a visible contact, 4 are needed"), "{:?}", d.notes);
}
