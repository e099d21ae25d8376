// Stage shadow, the rays. CPU twin: src/shadow/rays.rs.
//
// A workgroup collects the pixels of its tile that lie at the rim of a contact, then its threads share the pixels that
// the rays of each hit. Nothing but extrema, so that the order does not matter.

const WIDTH = 16u;
const HEIGHT = 4u;
const THREADS = 64u;

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> shadows: Shadows;
@group(0) @binding(2) var<storage, read> outcomes: array<Outcome>;
// Cosine and sine of the lower border of each sector of direction, counted from -pi.
@group(0) @binding(3) var<storage, read> borders: array<vec2<f32>>;
// First and end of the targets of each direction and row.
@group(0) @binding(4) var<storage, read> fans: array<vec2<u32>>;
// dx and dy, 16 bits each, and codes of red, green and blue.
@group(0) @binding(5) var<storage, read> targets: array<vec4<u32>>;
// Codes by image, channel and pixel: the larger, the darker; 0 where no ray falls.
@group(0) @binding(9) var<storage, read_write> lowest: array<atomic<u32>>;
//#PLANES

var<workgroup> origins: array<vec4<u32>, THREADS>;
var<workgroup> count: atomic<u32>;

fn in_core(x: u32, y: u32, image: u32) -> bool {
    return load_contact(x, y, image) > outcomes[image].core_px;
}

// Within reach of the core along both axes, and not in it.
fn at_rim(x: u32, y: u32, image: u32) -> bool {
    if in_core(x, y, image) {
        return false;
    }
    let reach = shadows.rim_px;
    let right = min(x + reach, frame.width_px - 1u);
    let bottom = min(y + reach, frame.height_px - 1u);
    for (var py = max(y, reach) - reach; py <= bottom; py++) {
        for (var px = max(x, reach) - reach; px <= right; px++) {
            if in_core(px, py, image) {
                return true;
            }
        }
    }
    return false;
}

// Whether a direction is at or beyond the lower border of a sector.
fn beyond(k: u32, direction: vec2<f32>) -> bool {
    let border = borders[k];
    let below = direction.y < 0.0;
    if below != (border.y < 0.0) {
        return border.y < 0.0;
    }
    return border.x * direction.y - border.y * direction.x >= 0.0;
}

fn sector_of(slope: vec2<f32>) -> u32 {
    var direction = vec2<f32>(1.0, 0.0);
    if any(slope != vec2<f32>(0.0, 0.0)) {
        direction = slope;
    }
    // What rounds to below -pi belongs to the last one.
    if !beyond(0u, direction) {
        return shadows.directions - 1u;
    }
    var low = 0u;
    var high = shadows.directions;
    while high - low > 1u {
        let middle = (low + high) / 2u;
        if beyond(middle, direction) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

// First and end of the targets of a pixel's rays.
fn fan_of(x: u32, y: u32, image: u32) -> vec2<u32> {
    let raised = load_surface(x, y, image);
    let last = f32(shadows.heights - 1u);
    var row = floor((raised - shadows.first_px) * shadows.per_px);
    if shadows.held != 0u && 0.5 * shadows.first_px <= raised {
        row = clamp(row, 0.0, last);
    }
    if !(row >= 0.0 && row <= last) {
        return vec2<u32>(0u, 0u);
    }
    return fans[sector_of(gradient(x, y, image)) * shadows.heights + u32(row)];
}

// Cutting a position just outside, between -1 and 0, gives pixel 0.
fn cut(at: i32) -> i32 {
    return select(at, 0, at == -1);
}

@compute @workgroup_size(WIDTH, HEIGHT)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    if thread == 0u {
        atomicStore(&count, 0u);
    }
    workgroupBarrier();
    if id.x < frame.width_px && id.y < frame.height_px && at_rim(id.x, id.y, id.z) {
        let fan = fan_of(id.x, id.y, id.z);
        if fan.y > fan.x {
            origins[atomicAdd(&count, 1u)] = vec4<u32>(id.x, id.y, fan.x, fan.y);
        }
    }
    workgroupBarrier();
    let found = atomicLoad(&count);
    let pixels = frame.width_px * frame.height_px;
    for (var i = 0u; i < found; i++) {
        let origin = origins[i];
        let height = whole_surface(origin.x, origin.y, id.z);
        for (var k = origin.z + thread; k < origin.w; k += THREADS) {
            let aim = targets[k];
            let x = cut(i32(origin.x) + (bitcast<i32>(aim.x << 16u) >> 16u));
            let y = cut(i32(origin.y) + (bitcast<i32>(aim.x) >> 16u));
            let inside = x >= 0 && y >= 0 && x < i32(frame.width_px) && y < i32(frame.height_px);
            // A ray only darkens what lies lower than its origin.
            if inside && height > whole_surface(u32(x), u32(y), id.z) {
                let at = 3u * id.z * pixels + u32(y) * frame.width_px + u32(x);
                atomicMax(&lowest[at], aim.y);
                atomicMax(&lowest[at + pixels], aim.z);
                atomicMax(&lowest[at + 2u * pixels], aim.w);
            }
        }
    }
}
