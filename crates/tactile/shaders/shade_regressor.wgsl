// Stage shade, smooth regression. CPU twin: src/colour/regressor.rs.
//
// `colour` holds, by term and monomial of the position, a coefficient for red, green and blue, and a number without
// meaning. `cells` holds what the surroundings change, see regressor_pyramid.wgsl.

const NEAR_FIELD = 10u;

@group(0) @binding(3) var<uniform> colour: array<vec4<f32>, 200>;
@group(0) @binding(8) var<uniform> regression: Regression;
@group(0) @binding(9) var<storage, read> cells: array<f32>;

// The two cells beside a pixel and the weight of the second.
struct Between {
    first: u32,
    second: u32,
    weight: f32,
}

fn between_cells(pixel: u32, count: u32) -> Between {
    let at = clamp((f32(pixel) + 0.5) / f32(regression.cell_px) - 0.5, 0.0, f32(count - 1u));
    let first = min(u32(at), count - 1u);
    return Between(first, min(first + 1u, count - 1u), at - f32(first));
}

// What the surroundings change.
fn shade_around(x: u32, y: u32, image: u32) -> vec3<f32> {
    let bx = between_cells(x, regression.columns[0]);
    let by = between_cells(y, regression.rows[0]);
    let size = regression.columns[0] * regression.rows[0];
    var change = vec3<f32>(0.0, 0.0, 0.0);
    for (var channel = 0u; channel < 3u; channel++) {
        let plane = regression.colours[0] + channel * size;
        let above_left = cells[cell(image, plane, 0u, bx.first, by.first)];
        let above_right = cells[cell(image, plane, 0u, bx.second, by.first)];
        let below_left = cells[cell(image, plane, 0u, bx.first, by.second)];
        let below_right = cells[cell(image, plane, 0u, bx.second, by.second)];
        let above = above_left + bx.weight * (above_right - above_left);
        let below = below_left + bx.weight * (below_right - below_left);
        change[channel] = above + by.weight * (below - above);
    }
    return change;
}

// A term times its field, which is cubic in u and v.
fn near_term(index: u32, value: f32, u: f32, v: f32) -> vec3<f32> {
    let c = index * NEAR_FIELD;
    let p0 = colour[c].xyz + v * (colour[c + 2u].xyz + v * (colour[c + 5u].xyz + v * colour[c + 9u].xyz));
    let p1 = colour[c + 1u].xyz + v * (colour[c + 4u].xyz + v * colour[c + 8u].xyz);
    let p2 = colour[c + 3u].xyz + v * colour[c + 7u].xyz;
    return value * (p0 + u * (p1 + u * (p2 + u * colour[c + 6u].xyz)));
}

// What the shape of the gel at the pixel itself changes.
fn shade_near(x: u32, y: u32, height_px: f32, slope: vec2<f32>) -> vec3<f32> {
    let square = dot(slope, slope);
    let inverse = 1.0 / sqrt(1.0 + square);
    let sine = sqrt(square) * inverse;
    var shorten = 1.0;
    if sine > regression.slope_limit {
        shorten = regression.slope_limit / sine;
    }
    let n = slope * (-inverse * shorten);
    let h = min(height_px * regression.mm_per_px, regression.height_limit_mm);
    let at = place(f32(x), f32(y));
    let u = at.x;
    let v = at.y;
    let xx = n.x * n.x;
    let xy = n.x * n.y;
    let yy = n.y * n.y;
    var change = near_term(0u, n.x, u, v) + near_term(1u, n.y, u, v);
    change += near_term(2u, xx, u, v) + near_term(3u, xy, u, v) + near_term(4u, yy, u, v);
    change += near_term(5u, xx * n.x, u, v) + near_term(6u, xx * n.y, u, v);
    change += near_term(7u, xy * n.y, u, v) + near_term(8u, yy * n.y, u, v);
    change += near_term(9u, xx * xx, u, v) + near_term(10u, xx * xy, u, v) + near_term(11u, xx * yy, u, v);
    change += near_term(12u, xy * yy, u, v) + near_term(13u, yy * yy, u, v);
    change += near_term(14u, h, u, v) + near_term(15u, h * n.x, u, v) + near_term(16u, h * n.y, u, v);
    change += near_term(17u, h * xx, u, v) + near_term(18u, h * xy, u, v) + near_term(19u, h * yy, u, v);
    return change;
}

// Change of red, green and blue in grey levels. `slope` is that of the displacement, whatever the gel's shape.
fn shade(x: u32, y: u32, image: u32, slope: vec2<f32>) -> vec3<f32> {
    var change = shade_around(x, y, image);
    let height_px = load_surface(x, y, image);
    if height_px != 0.0 || any(slope != vec2<f32>(0.0, 0.0)) {
        change += shade_near(x, y, height_px, slope);
    }
    return change;
}
