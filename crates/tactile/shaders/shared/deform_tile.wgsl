// What the two tiled blurs of stage deform share.

const RUN = /*RUN*/u;
const HALF = /*HALF*/;
const LANES = /*LANES*/u;
const THREADS = 256u;
const SPAN = THREADS / LANES * RUN;
const LENGTH = SPAN + 2u * u32(HALF);
// One more than LANES, so that neighbours along both axes lie in different banks.
const PITCH = LANES + 1u;
// How far the blurs up to this one carry what the contact's box holds.
const REACH = vec2<i32>(/*REACH_X*/, /*REACH_Y*/);

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> outcomes: array<Outcome>;
//#PLANES

var<workgroup> tile: array<f32, LENGTH * PITCH>;

// Borders are mirrored, the edge is not repeated.
fn mirrored(i: i32, size: i32) -> u32 {
    let low = abs(i);
    return u32(clamp(select(low, 2 * (size - 1) - low, low >= size), 0, size - 1));
}

// Whether values of a rectangle can differ from zero.
fn reached(first: vec2<i32>, size: vec2<i32>, image: u32) -> bool {
    let low = vec2<i32>(i32(outcomes[image].low_x), i32(outcomes[image].low_y)) - REACH;
    let high = vec2<i32>(i32(outcomes[image].high_x), i32(outcomes[image].high_y)) + REACH;
    return all(first <= high) && all(first + size > low) && outcomes[image].press_px > 0.0;
}

fn source_at(column: i32, row: i32, image: u32) -> f32 {
    return load_source(mirrored(column, i32(frame.width_px)), mirrored(row, i32(frame.height_px)), image);
}

fn finish(column: i32, row: i32, image: u32, blurred: f32, depth: f32, share: f32) {
    if column < i32(frame.width_px) && row < i32(frame.height_px) {
        let x = u32(column);
        let y = u32(row);
        var value = blurred;
        /*RESTORE*/
        store_blurred(x, y, image, value);
    }
}
