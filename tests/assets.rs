//! The shipped meshes and the shipped sensor file are made from the numbers beside them.
//!
//! `cargo xtask assets` runs this test with `GRIPGEN_UPDATE` set, which writes them; `cargo xtask assets --check` only compares.

use crate::common::root;
use gripgen::tactile::{ColourModel, GelShape, Grid, Lambert, Light, Sensor};
use gripgen::twin::parts::{BallBearing, InvoluteGear, RollerBearing, SteppedShaft};
use gripgen::twin::write_binary_stl;
use serde::Deserialize;
use std::path::PathBuf;

#[derive(Deserialize)]
struct Illumination {
    width_px: usize,
    height_px: usize,
    mm_per_px: f64,
    noise_rgb: [f64; 3],
    ambient_rgb: [f64; 3],
    vignette: f64,
    lights: Vec<LightFile>,
}

#[derive(Deserialize)]
struct LightFile {
    azimuth_deg: f64,
    elevation_deg: f64,
    rgb: [f64; 3],
    falloff: [f64; 2],
}

#[test]
fn shipped_assets_are_those_of_their_numbers() {
    let assets = root().join("assets");
    let mut stale = Vec::new();
    let mut publish = |path: PathBuf, bytes: Vec<u8>| {
        if std::fs::read(&path).is_ok_and(|old| old == bytes) {
            return;
        }
        if std::env::var_os("GRIPGEN_UPDATE").is_some() {
            std::fs::write(&path, bytes).unwrap();
        } else {
            stale.push(path);
        }
    };
    for part in ["ball_bearing", "gear", "long_shaft", "roller_bearing"] {
        let folder = assets.join("parts").join(part);
        let text = std::fs::read_to_string(folder.join("part.toml")).expect("every part has its numbers");
        publish(folder.join("part.stl"), part_stl(part, &text));
    }
    let folder = assets.join("sensors/gelsight_synthetic");
    let text = std::fs::read_to_string(folder.join("illumination.toml")).expect("the sensor has its numbers");
    publish(folder.join("sensor.npz"), sensor_npz(&text));
    assert!(stale.is_empty(), "stale: {stale:?}; run `cargo xtask assets`");
}

fn part_stl(name: &str, text: &str) -> Vec<u8> {
    let mut table: toml::Table = text.parse().expect("part.toml is TOML");
    let shape = table.remove("shape").expect("part.toml names its shape");
    let mesh = match shape.as_str().unwrap_or_default() {
        "involute_gear" => table.try_into::<InvoluteGear>().map(|p| p.mesh()),
        "stepped_shaft" => table.try_into::<SteppedShaft>().map(|p| p.mesh()),
        "ball_bearing" => table.try_into::<BallBearing>().map(|p| p.mesh()),
        "roller_bearing" => table.try_into::<RollerBearing>().map(|p| p.mesh()),
        other => panic!("{name}: no shape `{other}`"),
    };
    let mesh = mesh.unwrap_or_else(|e| panic!("{name}: {e}"));
    write_binary_stl(&mesh, &format!("gripgen {name}, millimetres, from part.toml"), 1e-3)
}

fn sensor_npz(text: &str) -> Vec<u8> {
    let spec: Illumination = toml::from_str(text).expect("illumination.toml is complete");
    let lights: Vec<Light> = spec
        .lights
        .iter()
        .map(|l| Light {
            azimuth_rad: l.azimuth_deg.to_radians(),
            elevation_rad: l.elevation_deg.to_radians(),
            colour: l.rgb,
            falloff: l.falloff,
        })
        .collect();
    let lambert = Lambert::from_lights(&lights);
    let (w, h) = (spec.width_px, spec.height_px);
    let plane = |channel: usize| -> Vec<f32> {
        (0..w * h)
            .map(|i| {
                let u = ((i % w) as f64 + 0.5 - w as f64 / 2.0) * 2.0 / w as f64;
                let v = ((i / w) as f64 + 0.5 - h as f64 / 2.0) * 2.0 / w as f64;
                let lit = lambert.flat(channel, u, v) + spec.ambient_rgb[channel];
                // The rest frame is stored in whole grey levels, and so it is here.
                (lit * (1.0 - spec.vignette * (u * u + v * v))).round().clamp(0.0, 255.0) as f32
            })
            .collect()
    };
    let sensor = Sensor {
        markers: None,
        grid: Grid { width_px: w, height_px: h, metres_per_px: spec.mm_per_px * 1e-3 },
        rest: [plane(0), plane(1), plane(2)],
        noise_rgb: spec.noise_rgb.map(|x| x as f32),
        colour: ColourModel::Lambert(Box::new(lambert)),
        gel_shape: GelShape::Flat,
        shadow: None,
        pyramid: None,
        ball_m: None,
        press_gain_sd: None,
        unverified: false,
    };
    sensor.to_npz().expect("it is our own colour model").expect("arrays fit into an npz")
}
