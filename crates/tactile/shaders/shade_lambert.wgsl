// Stage shade, lights on a matt gel. CPU twin: src/colour/lambert.rs.
//
// `colour` holds the coefficients in the order channel, component of the normal, term.

@group(0) @binding(3) var<storage, read> colour: array<f32>;

fn field(first: u32, terms: array<f32, 6>) -> f32 {
    var value = 0.0;
    for (var i = 0u; i < 6u; i++) {
        value += colour[first + i] * terms[i];
    }
    return value;
}

// Change of red, green and blue against a level gel, in grey levels: sum_j field_j (n_j - n0_j).
fn lit(x: u32, y: u32, slope: vec2<f32>) -> vec3<f32> {
    let unit = 2.0 / f32(frame.width_px);
    let u = (f32(x) + 0.5 - 0.5 * f32(frame.width_px)) * unit;
    let v = (f32(y) + 0.5 - 0.5 * f32(frame.height_px)) * unit;
    let terms = array<f32, 6>(1.0, u, v, u * u, u * v, v * v);
    let square = dot(slope, slope);
    let length = sqrt(1.0 + square);
    let inverse = 1.0 / length;
    // 1 / length - 1, without the loss of bits at small slopes.
    let normal = vec3<f32>(-slope.x * inverse, -slope.y * inverse, -square / (length * (1.0 + length)));
    var change = vec3<f32>(0.0, 0.0, 0.0);
    for (var channel = 0u; channel < 3u; channel++) {
        let first = 18u * channel;
        change[channel] = field(first, terms) * normal.x + field(first + 6u, terms) * normal.y
            + field(first + 12u, terms) * normal.z;
    }
    return change;
}

// The same against the gel at rest.
fn shade(x: u32, y: u32, image: u32, slope: vec2<f32>) -> vec3<f32> {
    let change = lit(x, y, slope);
    if DOMED {
        return change - lit(x, y, slope_at_rest(x, y));
    }
    return change;
}
