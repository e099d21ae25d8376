// Stage indent: how deep the part sinks in. CPU twin: src/indent.rs.
//
// Newton's method on sum max(0, below + press) = wanted from the deep side, which converges monotonically and ends
// when the set of touching pixels no longer changes. One workgroup an image; sums are taken in blocks of 16 values, so
// that they lose no more than a few bits of 24.
//
// It runs twice: by the centres of pixels, then, in images with a step, with the points of the pixels beside it.

const THREADS = /*THREADS*/u;
const BLOCK = 16u;
// Newton ends after 2 to 8 steps (median 6); this only bounds what rounding could make of it.
const MAX_STEPS = 24u;
const SECOND = /*SECOND*/;

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> presses: array<PressInput>;
@group(0) @binding(2) var<storage, read> heights: array<u32>;
@group(0) @binding(3) var<storage, read_write> outcomes: array<Outcome>;
// The gel surface at rest towards the part, in pixels, at most 0.
@group(0) @binding(5) var<storage, read> rest: array<f32>;
//#PLANES
/*STEPS*/

var<workgroup> volumes: array<f32, THREADS>;
var<workgroup> counts: array<f32, THREADS>;
var<workgroup> highest: atomic<u32>;
var<workgroup> newton: Newton;
// The contact's box.
var<workgroup> low_x: atomic<u32>;
var<workgroup> low_y: atomic<u32>;
var<workgroup> high_x: atomic<u32>;
var<workgroup> high_y: atomic<u32>;

struct Newton {
    press: f32,
    touching: f32,
    running: u32,
    available: f32,
}

// Height above the gel at rest; only where there is a surface.
fn above_gel(code: u32, pixel: u32) -> f32 {
    return unordered(code) + rest[pixel];
}

// Depth at a height that is there, and whether it touches.
fn touch(code: u32, pixel: u32, top: f32, press: f32) -> vec2<f32> {
    let depth = (above_gel(code, pixel) - top) + press;
    return select(vec2<f32>(), vec2<f32>(depth, 1.0), code != 0u && depth > 0.0);
}

// Depth of a pixel, and how much of it touches.
fn pressed_in(start: u32, pixel: u32, top: f32, press: f32) -> vec2<f32> {
    var here = touch(heights[start + pixel], pixel, top, press);
    /*POINTS*/
    return here;
}

// Volume and pixels in contact at a press, of all threads together, in place 0.
fn measure(start: u32, pixels: u32, thread: u32, top: f32, press: f32) {
    var volume = 0.0;
    var count = 0.0;
    // Neighbouring threads read neighbouring pixels.
    for (var block = thread; block < pixels; block += THREADS * BLOCK) {
        var part = vec2<f32>();
        for (var i = block; i < min(block + THREADS * BLOCK, pixels); i += THREADS) {
            part += pressed_in(start, i, top, press);
        }
        volume += part.x;
        count += part.y;
    }
    volumes[thread] = volume;
    counts[thread] = count;
    workgroupBarrier();
    for (var half = THREADS / 2u; half > 0u; half /= 2u) {
        if thread < half {
            volumes[thread] += volumes[thread + half];
            counts[thread] += counts[thread + half];
        }
        workgroupBarrier();
    }
}

@compute @workgroup_size(THREADS)
fn main(@builtin(workgroup_id) id: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let image = id.x;
    let pixels = frame.width_px * frame.height_px;
    let start = image * pixels;
    let has_part = (presses[image].flags & HAS_PART) != 0u;
    let wanted = presses[image].wanted_px3;
    if thread == 0u {
        atomicStore(&highest, 0u);
    }
    workgroupBarrier();
    var mine = 0u;
    for (var i = thread; i < pixels; i += THREADS) {
        let code = heights[start + i];
        if code != 0u {
            mine = max(mine, ordered(above_gel(code, i)));
        }
    }
    atomicMax(&highest, mine);
    workgroupBarrier();
    let code = atomicLoad(&highest);
    let something = has_part && code != 0u;
    let top = select(0.0, unordered(code), something);
    if thread == 0u {
        newton = Newton(frame.thickness_px, -1.0, select(0u, 1u, something), 0.0);
        /*AGAIN*/
    }
    var step = 0u;
    loop {
        let now = workgroupUniformLoad(&newton);
        if now.running == 0u || step == MAX_STEPS {
            break;
        }
        measure(start, pixels, thread, top, now.press);
        if thread == 0u {
            if step == 0u && !SECOND {
                newton.available = volumes[0];
            }
            if (step == 0u && !SECOND && volumes[0] < wanted) || counts[0] == now.touching || counts[0] < 1e-6 {
                newton.running = 0u;
            } else {
                newton.touching = counts[0];
                newton.press = now.press - (volumes[0] - wanted) / counts[0];
            }
        }
        step += 1u;
    }
    let found = workgroupUniformLoad(&newton);
    if SECOND && found.touching < 0.0 {
        return;
    }
    let deeper = something && (found.available < wanted || found.press > frame.thickness_px);
    let press = found.press;
    let pressed = something && !deeper;
    var low = vec2<u32>(frame.width_px, frame.height_px);
    var high = vec2<u32>();
    for (var i = thread; i < pixels; i += THREADS) {
        let depth = select(0.0, pressed_in(start, i, top, press).x, pressed);
        let place = vec2<u32>(i % frame.width_px, i / frame.width_px);
        store_contact(place.x, place.y, image, depth);
        if depth > 0.0 {
            low = min(low, place);
            high = max(high, place);
        }
    }
    if thread == 0u {
        atomicStore(&low_x, frame.width_px);
        atomicStore(&low_y, frame.height_px);
        atomicStore(&high_x, 0u);
        atomicStore(&high_y, 0u);
    }
    workgroupBarrier();
    atomicMin(&low_x, low.x);
    atomicMin(&low_y, low.y);
    atomicMax(&high_x, high.x);
    atomicMax(&high_y, high.y);
    workgroupBarrier();
    if thread == 0u {
        var status = 0u;
        if has_part && !something {
            status = 1u;
        } else if deeper {
            status = 2u;
        }
        let depth = select(0.0, press, pressed);
        outcomes[image] = Outcome(
            status, depth, found.available, frame.restore_depth_fraction * depth, top,
            atomicLoad(&low_x), atomicLoad(&low_y), atomicLoad(&high_x), atomicLoad(&high_y),
        );
    }
}
