// Stage shade, Taxim's table. CPU twin: src/colour/taxim.rs.
//
// `colour` holds, for B bins: the smallest slope of each; B pairs (cos, sin) of the lower border of each bin of direction;
// then by (slope bin, direction bin, channel) six coefficients. Bins are found by comparing with their borders, not with
// atan: its precision on a GPU is 4096 units in the last place. `rest` holds, after the rest frame, the background that
// Taxim draws on less that frame.

@group(0) @binding(3) var<storage, read> colour: array<f32>;

const CALIBRATION_WIDTH_PX = 640.0;
const MIDDLE_PX = vec2<f32>(320.0, 240.0);

fn slope_bin(slope: f32) -> u32 {
    var low = 0u;
    var high = frame.bins;
    while high - low > 1u {
        let middle = (low + high) / 2u;
        if slope >= colour[middle] {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

// Whether a direction is at or beyond the lower border of bin `k`, both counted from -pi.
fn beyond(k: u32, direction: vec2<f32>) -> bool {
    let at = frame.bins + 2u * k;
    let below = direction.y < 0.0;
    let border_below = colour[at + 1u] < 0.0;
    if below != border_below {
        return border_below;
    }
    return colour[at] * direction.y - colour[at + 1u] * direction.x >= 0.0;
}

fn direction_bin(direction: vec2<f32>) -> u32 {
    // What rounds to below -pi belongs to the last bin.
    if !beyond(0u, direction) {
        return frame.bins - 1u;
    }
    var low = 0u;
    var high = frame.bins;
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

// Change of red, green and blue in grey levels.
fn shade(x: u32, y: u32, image: u32, slope: vec2<f32>) -> vec3<f32> {
    let pixels = frame.width_px * frame.height_px;
    let steepness = length(slope);
    var direction = vec2<f32>(1.0, 0.0);
    if steepness > 0.0 {
        direction = slope;
    }
    let at = vec2<f32>(f32(x), f32(y)) * (CALIBRATION_WIDTH_PX / f32(frame.width_px)) - MIDDLE_PX;
    let bin = slope_bin(steepness) * frame.bins + direction_bin(direction);
    var change = vec3<f32>(0.0, 0.0, 0.0);
    for (var channel = 0u; channel < 3u; channel++) {
        let c = 3u * frame.bins + 6u * (3u * bin + channel);
        let value = (colour[c] * at.x + colour[c + 2u] * at.y + colour[c + 3u]) * at.x
            + ((colour[c + 1u] * at.y + colour[c + 4u]) * at.y + colour[c + 5u]);
        change[channel] = value + rest[(3u + channel) * pixels + y * frame.width_px + x];
    }
    return change;
}
