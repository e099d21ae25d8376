//! Chosen pixels of one press: what was measured there, and what is seen under any optics.

use super::reduce::means;
use super::{PressContact, PressScene};
use crate::grid::levels_of;
use crate::optics::{frame_at, level_at};
use crate::presses::{Circle, ZONES, Zone, drawn};
use gripgen_twin::{OpticsState, TactileImage};

/// Pixels of a zone that are looked at in a press.
const PIXELS_PER_ZONE: usize = 600;

/// Chosen pixels of one press, or of a frame without contact.
#[derive(Debug, Clone, PartialEq)]
pub struct PressView {
    press: Option<PressContact>,
    pixels: Vec<usize>,
    zones: Vec<Zone>,
    measured: Vec<[f32; 3]>,
    rest: Vec<[f32; 3]>,
    /// What the full resolution shows beyond that of the scene, without effects.
    finer: Vec<[f32; 3]>,
}

impl PressView {
    /// Draws pixels of press number `index`, the same ones each time. `full` is the scene at the resolution of the
    /// image.
    pub fn draw(
        index: usize,
        image: &TactileImage,
        press: Option<PressContact>,
        full: &PressScene,
        scene: &PressScene,
    ) -> Self {
        let grid = &scene.sensor.grid;
        let (w, h, f) = (grid.width_px, grid.height_px, scene.factor);
        let here = press.as_ref().map(|PressContact(contact)| contact.in_wider_pixels(f));
        let mut by_zone = [const { Vec::new() }; ZONES.len()];
        for pixel in 0..grid.len() {
            let zone = here.as_ref().map_or(Zone::Far, |contact| {
                Zone::at(contact.beyond_rim_px(pixel, w) / contact.circle.radius_px.max(1.0))
            });
            by_zone[zone as usize].push(pixel);
        }
        let mut state = (index as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(11);
        let (mut pixels, mut zones) = (Vec::new(), Vec::new());
        for (zone, list) in ZONES.into_iter().zip(by_zone) {
            let list = drawn(list, PIXELS_PER_ZONE, &mut state);
            zones.extend(std::iter::repeat_n(zone, list.len()));
            pixels.extend(list);
        }
        let (full_w, full_h) = (image.width_px as usize, image.height_px as usize);
        let planes = levels_of(image).map(|plane| means(&plane, full_w, full_h, f));
        let plain = OpticsState::default();
        let finer = match &press {
            Some(_) if f > 1 => {
                let (fine, coarse) =
                    (full.change_seen(press.as_ref(), &plain), scene.change_seen(press.as_ref(), &plain));
                let fine = [0, 1, 2].map(|c| means(&fine[c].values, full_w, full_h, f));
                pixels.iter().map(|&p| [0, 1, 2].map(|c| fine[c][p] - coarse[c].values[p])).collect()
            }
            _ => vec![[0.0; 3]; pixels.len()],
        };
        debug_assert_eq!(planes[0].len(), w * h);
        Self {
            press,
            measured: pixels.iter().map(|&p| [0, 1, 2].map(|c| planes[c][p])).collect(),
            rest: pixels.iter().map(|&p| [0, 1, 2].map(|c| scene.sensor.rest[c][p])).collect(),
            finer,
            pixels,
            zones,
        }
    }

    /// The zone of each pixel.
    pub fn zones(&self) -> &[Zone] {
        &self.zones
    }

    /// Position of each pixel in the frame, from -1 to 1 along rows and columns.
    pub fn places(&self, scene: &PressScene) -> Vec<[f64; 2]> {
        let grid = &scene.sensor.grid;
        let at = |i: usize, n: usize| (2 * i + 1) as f64 / n as f64 - 1.0;
        self.pixels
            .iter()
            .map(|&p| [at(p % grid.width_px, grid.width_px), at(p / grid.width_px, grid.height_px)])
            .collect()
    }

    /// What was measured at each pixel: red, green, blue.
    pub fn measured(&self) -> &[[f32; 3]] {
        &self.measured
    }

    /// What the contact changes at each pixel under the part of `optics` that needs a picture of its own
    /// ([`surface_part`]); for [`PressView::levels`]. `circle` takes the place of a ball's marked one.
    pub fn contact(
        &self,
        scene: &PressScene,
        optics: &OpticsState,
        circle: Option<&Circle>,
    ) -> Vec<[f32; 3]> {
        let Some(press) = &self.press else { return vec![[0.0; 3]; self.pixels.len()] };
        let moved = circle.map(|circle| press.at(*circle));
        let change = scene.change_seen(Some(moved.as_ref().unwrap_or(press)), &surface_part(optics));
        let at = |(&p, finer): (&usize, &[f32; 3])| [0, 1, 2].map(|c| change[c].values[p] + finer[c]);
        self.pixels.iter().zip(&self.finer).map(at).collect()
    }

    /// Where something is pressed in.
    pub fn press(&self) -> Option<&PressContact> {
        self.press.as_ref()
    }

    /// Grey levels that the camera shows at each pixel, within 0 to 255.
    pub fn levels(&self, scene: &PressScene, contact: &[[f32; 3]], optics: &OpticsState) -> Vec<[f32; 3]> {
        let grid = &scene.sensor.grid;
        let offset = match self.press {
            Some(_) => optics.rest_offset.map(|o| o as f32),
            None => [0.0; 3],
        };
        let frame = optics.changes_frame();
        let moved = optics.moves_frame().then(|| frame_at(&scene.sensor.rest, grid, optics, &self.pixels));
        let rest = moved.as_ref().unwrap_or(&self.rest);
        let mut levels = Vec::with_capacity(self.pixels.len());
        for ((&pixel, rest), contact) in self.pixels.iter().zip(rest).zip(contact) {
            levels.push([0, 1, 2].map(|c| {
                let level = rest[c] + contact[c] + offset[c];
                let seen = if frame { level_at(optics, grid, pixel, c, level) } else { level };
                seen.clamp(0.0, 255.0)
            }));
        }
        levels
    }
}

/// The part of an optics that changes the picture of a contact in a way that has to be drawn; the rest is a function of
/// each pixel.
pub fn surface_part(optics: &OpticsState) -> OpticsState {
    let neutral = OpticsState::default();
    OpticsState {
        light_gain: neutral.light_gain,
        background: neutral.background,
        finer_background: neutral.finer_background,
        exposure_gain: neutral.exposure_gain,
        gamma: neutral.gamma,
        rest_offset: neutral.rest_offset,
        frame_moves: neutral.frame_moves,
        ..*optics
    }
}
