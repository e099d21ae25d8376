// Stage shade, lights on a matt gel. CPU twin: src/colour/lambert.rs.
//
// `colour` holds, by component of the normal and term of the position, a coefficient for red, green and blue, and a number
// without meaning.

@group(0) @binding(3) var<uniform> colour: array<vec4<f32>, 18>;

fn field(first: u32, u: f32, v: f32) -> vec3<f32> {
    return colour[first].xyz + u * colour[first + 1u].xyz + v * colour[first + 2u].xyz
        + (u * u) * colour[first + 3u].xyz + (u * v) * colour[first + 4u].xyz + (v * v) * colour[first + 5u].xyz;
}

// Change of red, green and blue against a level gel, in grey levels: sum_j field_j (n_j - n0_j).
fn lit(x: u32, y: u32, slope: vec2<f32>) -> vec3<f32> {
    let unit = 2.0 / f32(frame.width_px);
    let u = (f32(x) + 0.5 - 0.5 * f32(frame.width_px)) * unit;
    let v = (f32(y) + 0.5 - 0.5 * f32(frame.height_px)) * unit;
    let square = dot(slope, slope);
    let length = sqrt(1.0 + square);
    let inverse = 1.0 / length;
    // 1 / length - 1, without the loss of bits at small slopes.
    let normal = vec3<f32>(-slope.x * inverse, -slope.y * inverse, -square / (length * (1.0 + length)));
    return field(0u, u, v) * normal.x + field(6u, u, v) * normal.y + field(12u, u, v) * normal.z;
}

// The same against the gel at rest.
fn shade(x: u32, y: u32, image: u32, slope: vec2<f32>) -> vec3<f32> {
    let change = lit(x, y, slope);
    if DOMED {
        return change - lit(x, y, slope_at_rest(x, y));
    }
    return change;
}
