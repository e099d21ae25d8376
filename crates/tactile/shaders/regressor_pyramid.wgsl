// Stage shade, regression: what the surroundings of a pixel change, on cells. CPU twins: src/colour/regressor/pyramid.rs
// and `combine` in src/colour/regressor.rs.
//
// A pass per step; each runs one thread per cell of level LEVEL and image. `cells` holds, for each image, the planes that
// `Regression` names. `around` holds six coefficients for each feature: red, green, blue, and in place of a fourth
// channel the limit of the feature.

const LEVEL = /*LEVEL*/u;
// The next finer level, if there is one.
const FINER = max(LEVEL, 1u) - 1u;
const DERIVATIVES = 10u;
const AROUND_FIELD = 6u;

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> regression: Regression;
@group(0) @binding(2) var<storage, read_write> cells: array<f32>;
@group(0) @binding(3) var<uniform> around: array<vec4<f32>, 240>;
//#PLANES

// The cell of a thread; false beyond the last one.
fn mine(index: u32, at: ptr<function, vec2<u32>>) -> bool {
    let columns = regression.columns[LEVEL];
    *at = vec2<u32>(index % columns, index / columns);
    return index < columns * regression.rows[LEVEL];
}

// Mean height of the pixels of each cell in millimetres; cells at the border may hold fewer.
@compute @workgroup_size(64)
fn average(@builtin(global_invocation_id) id: vec3<u32>) {
    var at: vec2<u32>;
    if !mine(id.x, &at) {
        return;
    }
    let first = at * regression.cell_px;
    let end = min(first + regression.cell_px, vec2<u32>(frame.width_px, frame.height_px));
    var sum = 0.0;
    for (var x = first.x; x < end.x; x++) {
        var column = 0.0;
        for (var y = first.y; y < end.y; y++) {
            column += load_surface(x, y, id.z);
        }
        sum += column;
    }
    let count = (end.x - first.x) * (end.y - first.y);
    cells[cell(id.z, regression.means, LEVEL, at.x, at.y)] = sum * (regression.mm_per_px / f32(count));
}

// Cells of this level before it is smoothed: means of two by two finer ones, an odd last column or row counts twice.
fn unsmoothed(x: u32, y: u32, image: u32) -> f32 {
    if LEVEL == 0u {
        return cells[cell(image, regression.means, 0u, x, y)];
    }
    let plane = regression.heights[FINER];
    let right = min(2u * x + 1u, regression.columns[FINER] - 1u);
    let below = min(2u * y + 1u, regression.rows[FINER] - 1u);
    let above = cells[cell(image, plane, FINER, 2u * x, 2u * y)] + cells[cell(image, plane, FINER, right, 2u * y)];
    return 0.25 * (above + (cells[cell(image, plane, FINER, 2u * x, below)] + cells[cell(image, plane, FINER, right, below)]));
}

// Borders are mirrored without repeating the edge, as often as a small level needs.
fn mirrored(i: i32, size: u32) -> u32 {
    let period = max(2 * (i32(size) - 1), 1);
    let folded = ((i % period) + period) % period;
    return u32(select(folded, period - folded, folded >= i32(size)));
}

fn half_way(x: u32, y: u32, image: u32) -> f32 {
    return cells[cell(image, regression.half_way[LEVEL], LEVEL, x, y)];
}

// The binomial kernel of length 9 twice: that of length 17.
@compute @workgroup_size(64)
fn smooth_across(@builtin(global_invocation_id) id: vec3<u32>) {
    var at: vec2<u32>;
    if !mine(id.x, &at) {
        return;
    }
    var sum = 0.0;
    /*ACROSS*/
    cells[cell(id.z, regression.half_way[LEVEL], LEVEL, at.x, at.y)] = sum;
}

@compute @workgroup_size(64)
fn smooth_down(@builtin(global_invocation_id) id: vec3<u32>) {
    var at: vec2<u32>;
    if !mine(id.x, &at) {
        return;
    }
    var sum = 0.0;
    /*DOWN*/
    cells[cell(id.z, regression.heights[LEVEL], LEVEL, at.x, at.y)] = sum;
}

// The level and its central differences, each 0 at the borders across it.
fn z(x: u32, y: u32, image: u32) -> f32 {
    return cells[cell(image, regression.heights[LEVEL], LEVEL, x, y)];
}

fn inner_x(x: u32) -> bool {
    return x >= 1u && x + 1u < regression.columns[LEVEL];
}

fn inner_y(y: u32) -> bool {
    return y >= 1u && y + 1u < regression.rows[LEVEL];
}

/*DIFFERENCES*/
// Features of a cell, in the order of the coefficients.
fn features(x: u32, y: u32, image: u32) -> array<f32, DERIVATIVES> {
    return array<f32, DERIVATIVES>(
        z(x, y, image),
        zx(x, y, image), zy(x, y, image),
        zxx(x, y, image), zxy(x, y, image), zyy(x, y, image),
        zxxx(x, y, image), zxxy(x, y, image), zxyy(x, y, image), zyyy(x, y, image),
    );
}

// Writes the features of a level that finer ones will read.
@compute @workgroup_size(64)
fn differentiate(@builtin(global_invocation_id) id: vec3<u32>) {
    var at: vec2<u32>;
    if !mine(id.x, &at) {
        return;
    }
    let all = features(at.x, at.y, id.z);
    let plane = regression.columns[LEVEL] * regression.rows[LEVEL];
    for (var i = 0u; i < DERIVATIVES; i++) {
        cells[cell(id.z, regression.differences[LEVEL] + i * plane, LEVEL, at.x, at.y)] = all[i];
    }
}

// The two coarser cells beside a cell: its parent, of weight 3/4, and the next one.
fn parents(i: u32, count: u32) -> vec2<u32> {
    let parent = i / 2u;
    return vec2<u32>(parent, select(max(parent, 1u) - 1u, min(parent + 1u, count - 1u), i % 2u == 1u));
}

// A plane of level `level`, doubled once.
fn doubled(plane: u32, level: u32, x: u32, y: u32, image: u32) -> f32 {
    let px = parents(x, regression.columns[level]);
    let py = parents(y, regression.rows[level]);
    let left = 0.75 * cells[cell(image, plane, level, px.x, py.x)] + 0.25 * cells[cell(image, plane, level, px.x, py.y)];
    let right = 0.75 * cells[cell(image, plane, level, px.y, py.x)] + 0.25 * cells[cell(image, plane, level, px.y, py.y)];
    return 0.75 * left + 0.25 * right;
}

// The same for the coarsest level, doubled to level 2 and again to level 1.
fn doubled_twice(plane: u32, x: u32, y: u32, image: u32) -> f32 {
    let px = parents(x, regression.columns[2]);
    let py = parents(y, regression.rows[2]);
    let left = 0.75 * doubled(plane, 3u, px.x, py.x, image) + 0.25 * doubled(plane, 3u, px.x, py.y, image);
    let right = 0.75 * doubled(plane, 3u, px.y, py.x, image) + 0.25 * doubled(plane, 3u, px.y, py.y, image);
    return 0.75 * left + 0.25 * right;
}

// What feature `index` adds at place (u, v).
fn lit_by(index: u32, value: f32, at: vec2<f32>) -> vec3<f32> {
    let first = index * AROUND_FIELD;
    let c = around[first];
    let c0 = c.xyz + at.y * (around[first + 2u].xyz + at.y * around[first + 5u].xyz);
    let c1 = around[first + 1u].xyz + at.y * around[first + 4u].xyz;
    let field = c0 + at.x * (c1 + at.x * around[first + 3u].xyz);
    // Not `clamp`: a limit that is not a number is refused before.
    return max(-c.w, min(value, c.w)) * field;
}

// The centre of a cell in the image.
fn centre(at: vec2<u32>, cell_px: u32) -> vec2<f32> {
    let px = (vec2<f32>(at) + 0.5) * f32(cell_px) - 0.5;
    return place(px.x, px.y);
}

fn write_colour(at: vec2<u32>, image: u32, value: vec3<f32>) {
    let plane = regression.columns[LEVEL] * regression.rows[LEVEL];
    for (var channel = 0u; channel < 3u; channel++) {
        cells[cell(image, regression.colours[LEVEL] + channel * plane, LEVEL, at.x, at.y)] = value[channel];
    }
}

// The three coarser levels together, on the cells of the finest of them.
@compute @workgroup_size(64)
fn coarse(@builtin(global_invocation_id) id: vec3<u32>) {
    var at: vec2<u32>;
    if !mine(id.x, &at) {
        return;
    }
    let where_to = centre(at, 2u * regression.cell_px);
    let own = features(at.x, at.y, id.z);
    var change = vec3<f32>(0.0, 0.0, 0.0);
    for (var i = 0u; i < DERIVATIVES; i++) {
        change += lit_by(DERIVATIVES + i, own[i], where_to);
    }
    let size_2 = regression.columns[2] * regression.rows[2];
    for (var i = 0u; i < DERIVATIVES; i++) {
        let value = doubled(regression.differences[2] + i * size_2, 2u, at.x, at.y, id.z);
        change += lit_by(2u * DERIVATIVES + i, value, where_to);
    }
    let size_3 = regression.columns[3] * regression.rows[3];
    for (var i = 0u; i < DERIVATIVES; i++) {
        let value = doubled_twice(regression.differences[3] + i * size_3, at.x, at.y, id.z);
        change += lit_by(3u * DERIVATIVES + i, value, where_to);
    }
    write_colour(at, id.z, change);
}

// The finest level, and the coarser ones doubled once.
@compute @workgroup_size(64)
fn fine(@builtin(global_invocation_id) id: vec3<u32>) {
    var at: vec2<u32>;
    if !mine(id.x, &at) {
        return;
    }
    let where_to = centre(at, regression.cell_px);
    let own = features(at.x, at.y, id.z);
    var change = vec3<f32>(0.0, 0.0, 0.0);
    for (var i = 0u; i < DERIVATIVES; i++) {
        change += lit_by(i, own[i], where_to);
    }
    let size_1 = regression.columns[1] * regression.rows[1];
    for (var channel = 0u; channel < 3u; channel++) {
        change[channel] += doubled(regression.colours[1] + channel * size_1, 1u, at.x, at.y, id.z);
    }
    write_colour(at, id.z, change);
}
