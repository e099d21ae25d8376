//! Effects of the library, through the whole pipeline and in both mechanics.

use crate::common::{self, content, jobs, run, write_project};
use gripgen::tactile::SimdLevel;
use gripgen::twin::effects::LIBRARY;
use gripgen::twin::{Outcome, Pulled};
use gripgen::{Project, generate};

/// A quiet twin of the gear with these effects, gripped with 40 N on its faces.
fn project(effects: &str, mechanics: &str, vary: &str, images: &str) -> Project {
    let folder = tempfile::tempdir().unwrap();
    let twin = format!(
        "[parts.gear]\nmesh = \"asset:parts/gear/part.stl\"\nmu = 0.2\nimprint_mm3_per_n = 1.5\n\
         [[parts.gear.grips]]\norientation_deg = [0.0, 0.0, 90.0]\n[wrist]\nnoise_n = 0.0\n{effects}"
    );
    let sweep = format!(
        "twin = \"twin.toml\"\nsamples = 1\nimages = \"{images}\"\nmechanics = \"{mechanics}\"\n\
         [vary]\ngrip_force_n = [40]\n{vary}"
    );
    write_project(folder.path(), &twin, &sweep)
}

fn pulled(project: &Project) -> Box<Pulled> {
    common::pulled(project, 0).unwrap()
}

fn peak_n(p: &Pulled) -> f64 {
    p.trace.measured_force_n.iter().fold(0.0, |a, &b| a.max(b))
}

/// Circumstances in which no effect is at its reference.
const ELSEWHERE: &str = "dwell_s = [30]\npull_index = [100]\ntime_s = [3600]\ntemperature_c = [30]\n\
                         grip_offset_mm = [3]\ngrip_angle_deg = [20]\n";

/// A twin with every effect at its neutral values is the twin without, bit for bit: taking an entry out of a twin
/// restores the old data.
#[test]
fn neutral_effects_change_no_bit_of_a_sample() {
    let all: String = LIBRARY
        .iter()
        .map(|spec| {
            let values: String =
                spec.parameters.iter().map(|p| format!("{} = {:?}\n", p.name, p.neutral)).collect();
            format!("[[effects]]\nname = \"{}\"\n{values}", spec.id)
        })
        .collect();
    for mechanics in ["rapier", "reduced"] {
        let with = pulled(&project(&all, mechanics, ELSEWHERE, "png"));
        let without = pulled(&project("", mechanics, ELSEWHERE, "png"));
        assert!(with == without, "{mechanics}");
    }
}

/// Each effect with a size: by what factor, or by how many newtons, it moves the largest measured force of a pull that
/// slips at 16 N without it. The numbers follow from the formulas by hand.
#[test]
fn every_effect_moves_the_force_by_what_its_formula_says() {
    let e = std::f64::consts::E;
    let cases: &[(&str, &str, &str, f64, f64)] = &[
        ("load_offset", "a = 1.1\nb_n = -4.0", "", 1.0, 0.0),
        ("load_power_law", "n = -0.333333333333333\nf_ref_n = 5.0", "", 0.5, 0.0),
        ("area_saturation", "saturation_per_n = 0.025", "", 0.5, 0.0),
        ("regime_transition", "step = 0.3\nf_c_n = 15.0\nwidth_n = 1.0", "", 1.3, 0.0),
        ("rate_dependence", "k = 0.1\nr0_n_per_s = 1.0", "", 1.0 + 0.1 * (1.0f64 / 0.104).ln(), 0.0),
        ("dwell_ageing", "beta = 0.05\nt0_s = 1.0", "dwell_s = [100]", 1.0 + 0.05 * 101.0f64.ln(), 0.0),
        ("anisotropy", "amplitude = 0.2\naxis_deg = 0.0", "grip_angle_deg = [90]", 0.8, 0.0),
        ("contamination", "drop = 0.4\nat_pull_index = 50.0", "pull_index = [50]", 0.6, 0.0),
        ("wear", "depth = 0.3\nn0 = 100.0", "pull_index = [100]", 1.0 - 0.3 * (1.0 - 1.0 / e), 0.0),
        ("temperature", "k_per_k = 0.02\nt0_c = 23.0", "temperature_c = [33]", (-0.2f64).exp(), 0.0),
        ("grip_relaxation", "depth = 0.2\ntau_s = 10.0", "dwell_s = [10]", 1.0 - 0.2 * (1.0 - 1.0 / e), 0.0),
        (
            "jaw_tilt",
            "tilt_deg = 2.0",
            "",
            {
                let t = 2f64.to_radians().tan();
                (0.2 + t) / (1.0 - 0.2 * t) / 0.2
            },
            0.0,
        ),
        ("grip_force_loss", "loss_n = 4.0", "", 0.9, 0.0),
        ("sensor_gain", "gain = 1.2", "", 1.2, 0.0),
        ("sensor_bias", "bias_n = 0.7", "", 1.0, 0.7),
        ("sensor_drift", "rate_n_per_h = 2.0", "time_s = [1800]", 1.0, 1.0),
        ("sensor_gain_drift", "rate_per_h = 0.1", "time_s = [7200]", 1.2, 0.0),
        ("sensor_quadratic", "quadratic_per_n = 0.01", "", 1.16, 0.0),
        ("sensor_saturation", "limit_n = 9.0", "", 9.0 / 16.0, 0.0),
    ];
    for mechanics in ["rapier", "reduced"] {
        let plain = peak_n(&pulled(&project("", mechanics, "", "none")));
        assert!((plain / 16.0 - 1.0).abs() < 1e-3, "{mechanics}: {plain}");
        for (name, values, vary, factor, offset_n) in cases {
            let effect = format!("[[effects]]\nname = \"{name}\"\n{values}\n");
            let peak = peak_n(&pulled(&project(&effect, mechanics, vary, "none")));
            let expected = 16.0 * factor + offset_n;
            assert!(
                (peak / expected - 1.0).abs() < 3e-3,
                "{mechanics}, {name}: {peak} N, expected {expected} N"
            );
        }
    }
}

/// The others show where the force does not tell: in the trace before slip, in one jaw, in the imprint.
#[test]
fn effects_that_show_elsewhere_do() {
    for mechanics in ["rapier", "reduced"] {
        // With a force loop that does not see its sensor, a sensor effect stays in the reading.
        let robot = "[robot]\nfeedback = \"independent\"\n";
        let run =
            |effect: &str, vary: &str| pulled(&project(&format!("{effect}{robot}"), mechanics, vary, "none"));
        let plain = run("", "");
        let at = |p: &Pulled, time_s: f64| p.trace.measured_force_n[(time_s * 500.0) as usize];
        let effect = |name: &str, values: &str| format!("[[effects]]\nname = \"{name}\"\n{values}\n");

        let slow = run(&effect("sensor_lowpass", "tau_s = 0.05"), "");
        assert!(at(&slow, 1.0) < at(&plain, 1.0) - 0.3, "a low-pass lags behind a ramp");
        let creep = run(&effect("sensor_creep", "fraction = 0.1\ntau_s = 1.0"), "");
        assert!(at(&creep, 1.3) != at(&plain, 1.3));
        let loop_ = run(&effect("sensor_hysteresis", "amplitude_n = 0.5\nforce_scale_n = 2.0"), "");
        assert!((at(&loop_, 1.3) - at(&plain, 1.3)).abs() > 0.3);
        let gain = run(&effect("controller_gain", "gain = 0.9"), "");
        assert!(
            (at(&gain, 1.3) / at(&plain, 1.3) - 0.9).abs() < 0.02,
            "{} {}",
            at(&gain, 1.3),
            at(&plain, 1.3)
        );
        let seen = |effect: &str| pulled(&project(effect, mechanics, "", "none"));
        let band = seen(&effect("deadband", "width_n = 2.0"));
        let behind = at(&seen(""), 1.3) - at(&band, 1.3);
        assert!((0.5..2.0).contains(&behind), "the loop stays behind by up to its dead band: {behind} N");

        // A tool that creeps moves on, and the damping of an arm whose loop does not see its sensor takes its share of the force:
        // F_c (1 + d rate) = F. One that creeps as far as the stop ends its pull there: x = rate int F_c dt with F = r t.
        let damping = 2000.0;
        let crept = run(&effect("shear_creep", "rate_mm_per_n_s = 0.02"), "");
        let tick = 600;
        let share = at(&crept, 1.2) / at(&plain, 1.2);
        assert!((share * (1.0 + damping * 2e-5) - 1.0).abs() < 3e-3, "{share}");
        let impulse: f64 = crept.trace.measured_force_n[..=tick].iter().sum::<f64>() / 500.0;
        let further = crept.trace.displacement_m[tick] - share * plain.trace.displacement_m[tick];
        assert!((further / (2e-5 * impulse) - 1.0).abs() < 0.01, "{further} m");
        let fast = run(&effect("shear_creep", "rate_mm_per_n_s = 2.0"), "");
        let rises_n_per_s = 1.0 / 0.104 / (1.0 + damping * 2e-3);
        let stopped_n = (2.0 * rises_n_per_s * 5e-3 / 2e-3_f64).sqrt();
        assert!((peak_n(&fast) / stopped_n - 1.0).abs() < 0.06, "{} N, {stopped_n} N", peak_n(&fast));

        let unequal = run(&effect("asymmetric_jaws", "asymmetry = 0.2"), "");
        assert!((peak_n(&unequal) / peak_n(&plain) - 1.0).abs() < 2e-3, "what one jaw gains the other loses");
        let deep = run(&effect("imprint_nonlinearity", "exponent = 1.3\nf_ref_n = 20.0"), "");
        let volume = |p: &Pulled| p.imprint.left.press_depth_m;
        assert!(
            volume(&deep) > volume(&plain),
            "above the reference force an exponent over 1 presses deeper"
        );
        assert_eq!(peak_n(&deep), peak_n(&plain), "and changes no friction");
        let tilted = run(&effect("jaw_tilt", "tilt_deg = 1.0"), "");
        let centre = |p: &Pulled| p.imprint.left.patch.centre_m().1;
        assert!(centre(&tilted) > centre(&plain) + 1e-4, "the lower edge presses harder");
        let new = run(&effect("conditioning", "depth = 0.3\nn0 = 5.0"), "pull_index = [0]");
        let run_in = run(&effect("conditioning", "depth = 0.3\nn0 = 5.0"), "pull_index = [60]");
        assert!(peak_n(&new) < 0.75 * peak_n(&run_in) && (peak_n(&run_in) / 16.0 - 1.0).abs() < 3e-3);
        let beside = run(&effect("off_centre", "inverse_lever_per_mm = 0.25"), "grip_offset_mm = [4]");
        assert!((peak_n(&beside) / 16.0 - 0.5f64.sqrt()).abs() < 3e-3, "{}", peak_n(&beside));
    }
}

/// A cube of 10 mm between the jaws, in outlined text (OBJ), and its twin with these effects.
fn stamp(effects: &str, mechanics: &str) -> Box<Pulled> {
    let folder = tempfile::tempdir().unwrap();
    let mut mesh = String::new();
    for i in 0..8 {
        let at = |bit: i32| if i >> bit & 1 == 1 { 5 } else { -5 };
        mesh += &format!("v {} {} {}\n", at(0), at(1), at(2));
    }
    for [a, b, c, d] in [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]] {
        mesh += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
    }
    std::fs::write(folder.path().join("cube.obj"), mesh).unwrap();
    let twin = format!(
        "[parts.cube]\nmesh = \"cube.obj\"\nmu = 0.2\nimprint_mm3_per_n = 1.5\n[wrist]\nnoise_n = 0.0\n\
         [optics.left]\nimage_noise = \"off\"\n{effects}"
    );
    let sweep = format!(
        "twin = \"twin.toml\"\nsamples = 1\nmechanics = \"{mechanics}\"\n[vary]\ngrip_force_n = [40]\n"
    );
    pulled(&write_project(folder.path(), &twin, &sweep))
}

/// A rigid flat punch, tilted by t on a Winkler bed of foundation constant 1 / c: p = (d + y tan t) / c as long as the whole
/// face touches, d = c F / A; beyond, a wedge of the length sqrt(2 c F / (w tan t)). Felt as pressure and seen in the image,
/// in both jaws and both mechanics.
#[test]
fn tilted_jaws_press_a_flat_face_as_a_tilted_punch_does() {
    const C: f64 = 1.5e-9;
    for mechanics in ["reduced", "rapier"] {
        let tilted =
            |deg: f64| stamp(&format!("[[effects]]\nname = \"jaw_tilt\"\ntilt_deg = {deg}\n"), mechanics);
        let flat = tilted(0.0);
        for deg in [1.0_f64, 3.0, -3.0] {
            let p = tilted(deg);
            let slope = deg.to_radians().tan();
            for (jaw, imprint) in p.imprint.iter() {
                let cells = &imprint.patch.cells;
                let (n, y): (f64, f64) =
                    cells.iter().fold((0.0, 0.0), |(n, y), c| (n + c.area_m2, y + c.area_m2 * c.y_m));
                let middle = y / n;
                let (mut pressure, mut steep, mut square) = (0.0, 0.0, 0.0);
                for c in cells {
                    pressure += c.force_n;
                    steep += c.force_n * (c.y_m - middle);
                    square += c.area_m2 * (c.y_m - middle).powi(2);
                }
                let (found, by_hand) = (steep / square, slope / C);
                assert!(
                    (found / by_hand - 1.0).abs() < 0.03,
                    "{mechanics}, {jaw} {deg}: {found} and {by_hand} Pa/m"
                );
                assert!((pressure / n / (40.0 / 1e-4) - 1.0).abs() < 0.03, "the mean is that of the force");
                let deepest = C * 40.0 / 1e-4 + 5e-3 * slope.abs();
                assert!(
                    (imprint.press_depth_m / deepest - 1.0).abs() < 0.03,
                    "{} {deepest}",
                    imprint.press_depth_m
                );
            }
        }
        let wedge = tilted(10.0);
        let length = (2.0 * C * 40.0 / (0.01 * 10f64.to_radians().tan())).sqrt();
        for (jaw, imprint) in wedge.imprint.iter() {
            let area = imprint.patch.area_m2();
            assert!((area / (0.01 * length) - 1.0).abs() < 0.03, "{mechanics}, {jaw}: {area} m2");
        }
        // Lights answer to slopes in proportion: what one tilt adds in the middle of the face, the other takes off.
        let (up, down) = (tilted(3.0), tilted(-3.0));
        let mean = |p: &Pulled, jaw| {
            let image = &p.images.as_ref().unwrap()[jaw];
            let mut sum = [0.0; 3];
            for (x, y) in (140..180).flat_map(|x| (100..140).map(move |y| (x, y))) {
                for (s, v) in sum.iter_mut().zip(image.pixel(x, y)) {
                    *s += f64::from(v) / 1600.0;
                }
            }
            sum
        };
        for jaw in gripgen::twin::Jaw::BOTH {
            let [plain, up, down] = [&flat, &up, &down].map(|p| mean(p, jaw));
            let most = (0..3).map(|i| (up[i] - plain[i]).abs()).fold(0.0, f64::max);
            assert!(most > 2.0, "{mechanics}, {jaw}: {most} grey levels");
            for i in 0..3 {
                let (a, b) = (up[i] - plain[i], down[i] - plain[i]);
                assert!((a + b).abs() < 0.2 * most + 0.5, "{mechanics}, {jaw}: {a} and {b} grey levels");
            }
        }
    }
}

/// A law per cell sees the pressure: with the same grip force a sharp contact holds less than a flat one if friction
/// falls with pressure.
#[test]
fn a_law_per_cell_sees_the_pressure() {
    for mechanics in ["rapier", "reduced"] {
        let peak = |per: &str, angle: &str| {
            let effect = format!("[[effects]]\nname = \"load_power_law\"\nn = -0.3\nf_ref_n = 40.0\n{per}\n");
            let p = project(&effect, mechanics, angle, "none");
            peak_n(&pulled(&p))
        };
        let jaw = peak("", "");
        assert!(
            (jaw / 16.0 - 1.0).abs() < 2e-3,
            "at the reference force the law per jaw does nothing: {jaw}"
        );
        let small = peak("per = \"cell\"\nreference_area_mm2 = 100.0", "");
        let large = peak("per = \"cell\"\nreference_area_mm2 = 400.0", "");
        assert!(small > large * 1.3, "{small} N and {large} N");
    }
}

/// Optics effects with a size that shows, an hour and a hundred pulls into a campaign.
const OPTICS: &[(&str, &str)] = &[
    ("light_drift", "red_per_h = 0.05\nblue_per_h = -0.03"),
    ("background_change", "red_u = 5.0\ngreen_vv = -4.0\nat_pull_index = 50"),
    ("misregistration", "shift_x_mm = 0.5\nrotation_deg = 2.0"),
    ("exposure", "gain = 0.9\ngamma = 1.1"),
    ("defocus", "sigma_mm = 0.2"),
    ("gel_kernel", "factor = 1.3"),
    ("cad_mismatch", "offset_mm = 0.1\nblunting_mm = 0.2"),
    ("rest_offset", "red = 3.0"),
    ("cast_shadow", "strength = 0.4\nelevation_deg = 8.0"),
    ("gel_dome", "sag_mm = 0.5"),
    ("press_gain", "red = 1.05\nblue = 0.95\nred_sd = 0.1\ngreen_sd = 0.1\nblue_sd = 0.1"),
    ("press_depth", "offset_mm = 0.1"),
    ("edge_rounding", "radius_mm = 0.3"),
];

/// A part that is not gripped.
const PLATE: &str = "mesh = \"asset:parts/long_shaft/part.stl\"\nmu = 0.2\nimprint_mm3_per_n = 1.5\n";

/// The cameras see them, the jaws do not.
#[test]
fn optics_effects_change_images_and_no_label() {
    let count = LIBRARY.iter().filter(|spec| spec.optics.is_some()).count();
    assert_eq!(OPTICS.len(), count, "an effect without a case here");
    let vary = format!("part = [\"gear\"]\n{ELSEWHERE}");
    let of =
        |effect: &str| pulled(&project(&format!("{effect}[parts.plate]\n{PLATE}"), "reduced", &vary, "png"));
    let plain = of("");
    for (name, values) in OPTICS {
        let on = |part: &str| of(&format!("[[effects]]\nname = \"{name}\"\npart = \"{part}\"\n{values}\n"));
        assert!(on("plate") == plain, "{name} on another part");
        let mut seen = on("gear");
        let images = std::mem::replace(&mut seen.images, plain.images.clone());
        assert!(seen == plain, "{name} changes more than images");
        let (before, after) = (plain.images.as_ref().unwrap(), images.as_ref().unwrap());
        for (before, after) in [(&before.left, &after.left), (&before.right, &after.right)] {
            let changed = before.rgb.iter().zip(&after.rgb).filter(|(a, b)| a.abs_diff(**b) > 2).count();
            assert!(changed > 100, "{name}: {changed} values of the image");
        }
    }
}

/// Jaws that miss the part see light and camera change, and nothing of what a contact would.
#[test]
fn without_contact_only_light_and_camera_show() {
    let vary = "grip_offset_mm = [60]\ntime_s = [3600]\npull_index = [100]\n";
    let rest = |effect: &str| match generate(&project(effect, "reduced", vary, "png"), 0, SimdLevel::best())
        .outcome
    {
        Outcome::NoContact { images: Some(images) } => images,
        other => panic!("{other:?}"),
    };
    let plain = rest("");
    for (name, values) in OPTICS {
        let seen = rest(&format!("[[effects]]\nname = \"{name}\"\n{values}\n"));
        let frame = ["light_drift", "background_change", "exposure", "press_gain"].contains(name);
        assert_eq!(seen != plain, frame, "{name}");
    }
}

/// A sweep with an optics effect has other images and the same labels; without its entry the old bytes come back.
#[test]
fn taking_an_optics_effect_out_restores_the_bytes_of_a_sweep() {
    let shard_and_index = |effect: &str| {
        let folder = tempfile::tempdir().unwrap();
        run(&project(effect, "reduced", "time_s = [3600]\n", "png"), folder.path(), jobs(1));
        let mut files = content(folder.path());
        ["shard-00000.mcap", "index.csv"].map(|name| files.remove(name).unwrap())
    };
    let [shard, index] = shard_and_index("");
    for (name, values) in [OPTICS[0], OPTICS[9]] {
        let entry = format!("[[effects]]\nname = \"{name}\"\n{values}\n");
        let [other_shard, same_index] = shard_and_index(&entry);
        assert!(other_shard != shard && same_index == index, "{name}: other images, the same labels");
    }
    assert!(shard_and_index("") == [shard, index], "the old bytes");
}
