// Between two runs of stage indent: the pixels beside a step of the contact. CPU twin: src/raster/steps.rs.

@group(0) @binding(0) var<uniform> frame: Frame;
// How much the points of a pixel count; 0 for most.
@group(0) @binding(1) var<storage, read_write> steps: array<f32>;
// Heights at the nine points of each pixel; 0 where there is nothing.
@group(0) @binding(2) var<storage, read_write> points: array<u32>;
// Whether an image has such pixels.
@group(0) @binding(3) var<storage, read_write> stepped: array<atomic<u32>>;
//#PLANES

// Depth some pixels aside; beyond the image lies what lies at its border.
fn depth(x: i32, y: i32, image: u32) -> f32 {
    let last = vec2<i32>(i32(frame.width_px), i32(frame.height_px)) - 1;
    let at = vec2<u32>(clamp(vec2<i32>(x, y), vec2<i32>(), last));
    return load_contact(at.x, at.y, image);
}

// By how much the second and the third of four depths in a row differ more than a slope through them would.
fn step_of(a: f32, b: f32, c: f32, d: f32) -> f32 {
    let here = c - b;
    let rise = here - max(max(b - a, d - c), 0.0);
    let fall = max(max(a - b, c - d), 0.0) + here;
    return max(rise, -fall);
}

// The same of a pixel and its two neighbours in a direction.
fn excess(x: u32, y: u32, dx: i32, dy: i32, image: u32) -> f32 {
    let at = vec2<i32>(vec2<u32>(x, y));
    let a = depth(at.x - 2 * dx, at.y - 2 * dy, image);
    let b = depth(at.x - dx, at.y - dy, image);
    let here = depth(at.x, at.y, image);
    let c = depth(at.x + dx, at.y + dy, image);
    let d = depth(at.x + 2 * dx, at.y + 2 * dy, image);
    return max(step_of(a, b, here, c), step_of(b, here, c, d));
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let image = id.y;
    let x = id.x % frame.width_px;
    let y = id.x / frame.width_px;
    if y >= frame.height_px {
        return;
    }
    let weight = clamp(2.0 * max(excess(x, y, 1, 0, image), excess(x, y, 0, 1, image)) - 1.0, 0.0, 1.0);
    let pixel = (image * frame.height_px + y) * frame.width_px + x;
    steps[pixel] = weight;
    if weight > 0.0 {
        for (var k = 0u; k < 9u; k++) {
            points[9u * pixel + k] = 0u;
        }
        atomicOr(&stepped[image], 1u);
    }
}
