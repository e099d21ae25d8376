// Stage deform, one blur along one axis, for graphics processors: a workgroup blurs SPAN x LANES values that it holds
// in its own memory, each thread RUN neighbouring ones. CPU twins: src/deform.rs and src/convolve.rs.

const RUN = /*RUN*/;
const HALF = /*HALF*/;
const LANES = /*LANES*/;
const THREADS = 256;
const SPAN = THREADS / LANES * RUN;
const LENGTH = SPAN + 2 * HALF;
// One more than LANES, so that neighbours along both axes lie in different banks.
const PITCH = LANES + 1;

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> outcomes: array<Outcome>;
//#PLANES

var<workgroup> tile: array<f32, LENGTH * PITCH>;

// Borders are mirrored, the edge is not repeated.
fn mirrored(i: i32, size: i32) -> i32 {
    let low = abs(i);
    return clamp(select(low, 2 * (size - 1) - low, low >= size), 0, size - 1);
}

@compute @workgroup_size(256)
fn main(@builtin(workgroup_id) id: vec3<u32>, @builtin(local_invocation_index) invocation: u32) {
    let image = id.z;
    let thread = i32(invocation);
    let first = i32(id.x) * SPAN;
    let first_line = i32(id.y) * LANES;
    // Neighbouring threads read neighbouring columns, whichever axis is blurred.
    for (var k = thread; k < LENGTH * LANES; k += THREADS) {
        let run = /*LOAD_RUN*/;
        let lane = /*LOAD_LANE*/;
        let place = mirrored(first + run - HALF, /*SIZE*/);
        let line = min(first_line + lane, /*LINES*/ - 1);
        tile[run * PITCH + lane] = load_source(/*FROM_X*/, /*FROM_Y*/, image);
    }
    workgroupBarrier();
    let lane = thread % LANES;
    let start = thread / LANES * RUN;
    let base = start * PITCH + lane;
    /*SUMS*/
    workgroupBarrier();
    /*FINISH*/
    workgroupBarrier();
    for (var k = thread; k < SPAN * LANES; k += THREADS) {
        let run = /*STORE_RUN*/;
        let lane = /*STORE_LANE*/;
        let place = first + run;
        let line = first_line + lane;
        if place < /*SIZE*/ && line < /*LINES*/ {
            var value = tile[run * PITCH + lane];
            /*RESTORE*/
            store_blurred(/*FROM_X*/, /*FROM_Y*/, image, value);
        }
    }
}
