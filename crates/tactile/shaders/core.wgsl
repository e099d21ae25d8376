// Between stages indent and deform: how much of each pixel belongs to the core of the contact, and the depth there. CPU twin:
// src/deform/core_share.rs.

// A slope that is flat.
const FLAT = 1e-6;

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> outcomes: array<Outcome>;
@group(0) @binding(2) var<storage, read> steps: array<f32>;
@group(0) @binding(3) var<storage, read> points: array<u32>;
// The gel surface at rest towards the part, in pixels, at most 0.
@group(0) @binding(4) var<storage, read> rest: array<f32>;
//#PLANES

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let image = id.z;
    let x = id.x % frame.width_px;
    let y = id.x / frame.width_px;
    if y >= frame.height_px {
        return;
    }
    let outcome = outcomes[image];
    let here = load_contact(x, y, image);
    var depth = here;
    var share = 0.0;
    if here > 0.0 {
        let right = load_contact(min(x + 1u, frame.width_px - 1u), y, image);
        let below = load_contact(x, min(y + 1u, frame.height_px - 1u), image);
        let across = right - load_contact(max(x, 1u) - 1u, y, image);
        let down = below - load_contact(x, max(y, 1u) - 1u, image);
        let slope = max(0.5 * sqrt(across * across + down * down), FLAT);
        share = clamp(0.5 + (here - outcome.core_px) / slope, 0.0, 1.0);
        let place = y * frame.width_px + x;
        let pixel = image * frame.height_px * frame.width_px + place;
        let weight = steps[pixel];
        if weight > 0.0 {
            var sum = vec2<f32>();
            for (var k = 0u; k < 9u; k++) {
                let code = points[9u * pixel + k];
                let deep = (unordered(code) + rest[place] - outcome.top_px) + outcome.press_px;
                sum += select(vec2<f32>(), vec2<f32>(1.0, deep), code != 0u && deep > outcome.core_px);
            }
            let by_slope = (1.0 - weight) * share;
            let by_points = weight * sum.x / 9.0;
            share = by_slope + by_points;
            if share > 0.0 {
                depth = (by_slope * here + by_points * sum.y / max(sum.x, 1.0)) / share;
            }
        }
    }
    store_core(x, y, image, depth);
    store_share(x, y, image, share);
}
