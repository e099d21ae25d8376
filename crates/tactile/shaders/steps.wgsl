// Between two runs of stage indent: the pixels beside a step of the contact. CPU twin: src/raster/steps.rs.

@group(0) @binding(0) var<uniform> frame: Frame;
// How much the points of a pixel count; 0 for most.
@group(0) @binding(1) var<storage, read_write> steps: array<f32>;
// Heights at the nine points of each pixel; 0 where there is nothing.
@group(0) @binding(2) var<storage, read_write> points: array<u32>;
// Where an image has such pixels: TILES words, each a row of as many tiles.
@group(0) @binding(3) var<storage, read_write> stepped: array<atomic<u32>>;
//#PLANES

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let image = id.y;
    let x = id.x % frame.width_px;
    let y = id.x / frame.width_px;
    if y >= frame.height_px {
        return;
    }
    let here = load_contact(x, y, image);
    let left = abs(here - load_contact(max(x, 1u) - 1u, y, image));
    let right = abs(here - load_contact(min(x + 1u, frame.width_px - 1u), y, image));
    let above = abs(here - load_contact(x, max(y, 1u) - 1u, image));
    let below = abs(here - load_contact(x, min(y + 1u, frame.height_px - 1u), image));
    let most = max(max(left, right), max(above, below));
    let weight = clamp(2.0 * most - 1.0, 0.0, 1.0);
    let pixel = (image * frame.height_px + y) * frame.width_px + x;
    steps[pixel] = weight;
    if weight > 0.0 {
        for (var k = 0u; k < 9u; k++) {
            points[9u * pixel + k] = 0u;
        }
        let bits = tile_bits(frame);
        atomicOr(&stepped[TILES * image + (y >> bits)], 1u << (x >> bits));
    }
}
