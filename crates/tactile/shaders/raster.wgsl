// Stage raster: from a mesh to the height map. CPU twin: src/raster.rs.
//
// Positions are whole pixels and a fraction, computed with integers: a 32-bit float has not the bits for 1e-6 pixels at
// 500, no compiler rearranges integers, and a vertex has the same position in every cluster that uses it.
// Heights are relative to `reference`, a whole pixel near the top; `indent` does not depend on it.
//
// The same source draws the points within pixels (src/raster/steps.rs), SUB to a side, where `steps` says so.

const THREADS = 64u;
const SUB = /*SUB*/;
const MAX_VERTICES = 128u;
const MAX_TRIANGLES = 128u;
// Triangles that are more work than this are filled by all threads of the group together: a pixel is 1, a row is ROW_PX.
const LARGE_PX = 1024 * SUB;
const ROW_PX = 4;

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> group: Group;
@group(0) @binding(2) var<storage, read> clusters: array<Cluster>;
@group(0) @binding(3) var<storage, read> vertices: array<i32>;
@group(0) @binding(4) var<storage, read> triangles: array<u32>;
@group(0) @binding(5) var<storage, read> presses: array<PressInput>;
// Whole pixels of the highest sampled vertex inside the window, sign bit flipped; 0 where there is none.
@group(0) @binding(6) var<storage, read_write> tops: array<atomic<u32>>;
@group(0) @binding(7) var<storage, read_write> heights: array<atomic<u32>>;
/*STEPS*/

struct Corner {
    x: i32,
    y: i32,
    h: i32,
    fx: f32,
    fy: f32,
    fh: f32,
}

// Signed product of two 32-bit integers: low and high word.
fn product(a: i32, b: i32) -> vec2<u32> {
    let x = bitcast<u32>(a);
    let y = bitcast<u32>(b);
    let low = (x & 0xffffu) * (y & 0xffffu);
    let cross_a = (x & 0xffffu) * (y >> 16u);
    let cross_b = (x >> 16u) * (y & 0xffffu);
    let middle = (low >> 16u) + (cross_a & 0xffffu) + (cross_b & 0xffffu);
    var high = (x >> 16u) * (y >> 16u) + (cross_a >> 16u) + (cross_b >> 16u) + (middle >> 16u);
    high -= select(0u, y, a < 0) + select(0u, x, b < 0);
    return vec2<u32>((low & 0xffffu) | (middle << 16u), high);
}

fn sum(a: vec2<u32>, b: vec2<u32>) -> vec2<u32> {
    let low = a.x + b.x;
    return vec2<u32>(low, a.y + b.y + select(0u, 1u, low < a.x));
}

// Row `row` of the pose applied to a point in steps.
fn placed(image: u32, row: u32, x: i32, y: i32, z: i32) -> vec2<u32> {
    var total = vec2<u32>(presses[image].shift[2u * row], presses[image].shift[2u * row + 1u]);
    total = sum(total, product(presses[image].matrix[3u * row], x));
    total = sum(total, product(presses[image].matrix[3u * row + 1u], y));
    return sum(total, product(presses[image].matrix[3u * row + 2u], z));
}

// Whole pixels; `bits` lies between 33 and 61.
fn whole(value: vec2<u32>, bits: u32) -> i32 {
    return bitcast<i32>(value.y) >> (bits - 32u);
}

// The rest, 0 to 1, cut to the 24 bits that a float holds.
fn fraction(value: vec2<u32>, bits: u32) -> f32 {
    let top = (value.y << (64u - bits)) | (value.x >> (bits - 32u));
    return f32(top >> 8u) * 0x1p-24f;
}

fn corner(image: u32, x: i32, y: i32, z: i32) -> Corner {
    let bits = presses[image].fraction_bits;
    let px = placed(image, 0u, x, y, z);
    let py = placed(image, 1u, x, y, z);
    let ph = placed(image, 2u, x, y, z);
    return Corner(
        whole(px, bits), whole(py, bits), whole(ph, bits),
        fraction(px, bits), fraction(py, bits), fraction(ph, bits),
    );
}

fn vertex(image: u32, index: u32) -> Corner {
    return corner(image, vertices[3u * index], vertices[3u * index + 1u], vertices[3u * index + 2u]);
}

// The same place counted in points; the middle point of a pixel is its centre.
fn finer(c: Corner) -> Corner {
    let fx = f32(SUB) * c.fx;
    let fy = f32(SUB) * c.fy;
    return Corner(
        SUB * c.x + SUB / 2 + i32(floor(fx)), SUB * c.y + SUB / 2 + i32(floor(fy)), c.h,
        fx - floor(fx), fy - floor(fy), c.fh,
    );
}

// One thread per cluster: its first vertex stands for all. What lies deeper than the gel below the highest of them
// cannot be touched.
@compute @workgroup_size(THREADS)
fn top(@builtin(global_invocation_id) id: vec3<u32>) {
    let image = group.first_image + id.y;
    if id.x >= group.clusters {
        return;
    }
    let v = vertex(image, clusters[id.x].first_vertex);
    let right = i32(frame.width_px) - 1;
    let bottom = i32(frame.height_px) - 1;
    let inside_x = v.x >= 0 && (v.x < right || (v.x == right && v.fx == 0.0));
    let inside_y = v.y >= 0 && (v.y < bottom || (v.y == bottom && v.fy == 0.0));
    if inside_x && inside_y {
        atomicMax(&tops[image], bitcast<u32>(v.h) ^ 0x80000000u);
    }
}

// Whether a box of pixels, borders included, may have one that is drawn.
fn wanted(image: u32, left: i32, right: i32, top: i32, bottom: i32) -> bool {
    /*WANTED*/
}

// The tiles of a row that may have such pixels, a bit each.
fn tiles_of(image: u32, row: i32) -> u32 {
    return /*ROW*/;
}

var<workgroup> corners: array<Corner, MAX_VERTICES>;
var<workgroup> large: array<u32, MAX_TRIANGLES>;
var<workgroup> large_count: atomic<u32>;

// Whether a cluster can show in the window, and reach into the gel.
fn visible(image: u32, cluster: u32, reference: i32, floor_px: f32) -> bool {
    let c = corner(
        image, clusters[cluster].centre[0], clusters[cluster].centre[1], clusters[cluster].centre[2],
    );
    var reach = array<f32, 3>(0.0, 0.0, 0.0);
    // pixels_per_step * 2^fraction_bits is the length of a row of the matrix.
    let unit = presses[image].pixels_per_step;
    for (var row = 0u; row < 3u; row++) {
        var extent = 0.0;
        var length2 = 0.0;
        for (var axis = 0u; axis < 3u; axis++) {
            let m = f32(presses[image].matrix[3u * row + axis]);
            extent += abs(m) * clusters[cluster].half[axis];
            length2 += m * m;
        }
        // A margin over rounding: 1e-4 of the size and a pixel.
        reach[row] = extent / sqrt(length2) * unit * 1.0001 + 1.0;
    }
    let x = f32(c.x);
    let y = f32(c.y);
    let h = f32(c.h - reference);
    return x + reach[0] >= 0.0 && x - reach[0] <= f32(frame.width_px)
        && y + reach[1] >= 0.0 && y - reach[1] <= f32(frame.height_px)
        && h + reach[2] >= floor_px
        && wanted(image, i32(x - reach[0]), i32(x + reach[0]), i32(y - reach[1]), i32(y + reach[1]));
}

// An edge, from its upper end, whichever triangle asks.
struct Edge {
    x: i32,
    y: i32,
    fx: f32,
    fy: f32,
    h: f32,
    // To its lower end: columns, height, and one over the rows; 0 on a row.
    run: f32,
    rise: f32,
    per_row: f32,
}

fn edge(upper: Corner, lower: Corner, reference: i32) -> Edge {
    let span = f32(lower.y - upper.y) + (lower.fy - upper.fy);
    return Edge(
        upper.x, upper.y, upper.fx, upper.fy, f32(upper.h - reference) + upper.fh,
        f32(lower.x - upper.x) + (lower.fx - upper.fx), f32(lower.h - upper.h) + (lower.fh - upper.fh),
        select(0.0, 1.0 / span, span > 0.0),
    );
}

// Where an edge crosses a row of pixels: x + fx, at height h.
struct Crossing {
    x: i32,
    fx: f32,
    h: f32,
}

fn crossing(e: Edge, row: i32) -> Crossing {
    let share = min((f32(row - e.y) - e.fy) * e.per_row, 1.0);
    return Crossing(e.x, e.fx + share * e.run, e.h + share * e.rise);
}

fn left_of(a: Crossing, b: Crossing) -> bool {
    return f32(a.x - b.x) + (a.fx - b.fx) < 0.0;
}

// One row of a triangle: between its two crossings, heights on the line between theirs.
// `tiles` are those of the row that have pixels to draw.
fn fill_row(image: u32, a: Crossing, b: Crossing, row: i32, tiles: u32) {
    let swapped = left_of(b, a);
    let left_x = select(a.x, b.x, swapped);
    let left_fx = select(a.fx, b.fx, swapped);
    let left_h = select(a.h, b.h, swapped);
    let right_x = select(b.x, a.x, swapped);
    let right_fx = select(b.fx, a.fx, swapped);
    let right_h = select(b.h, a.h, swapped);
    let first = max(left_x + i32(ceil(left_fx)), 0);
    let last = min(right_x + i32(floor(right_fx)), SUB * i32(frame.width_px) - 1);
    let width = f32(right_x - left_x) + (right_fx - left_fx);
    let start = (image * frame.height_px + u32(row) / u32(SUB)) * frame.width_px;
    for (var x = first; x <= last; x++) {
        /*COLUMN*/
        var h = max(left_h, right_h);
        if width > 0.0 {
            // Not `mix`: a level row has to stay level to the bit.
            h = left_h + clamp((f32(x - left_x) - left_fx) / width, 0.0, 1.0) * (right_h - left_h);
        }
        /*STORE*/
    }
}

// Whether the first corner lies above the second one in the image.
fn above(a: Corner, b: Corner) -> bool {
    return a.y < b.y || (a.y == b.y && a.fy <= b.fy);
}

// A triangle on every `step`th of its rows from `offset` on. Returns whether it is more work than
// `limit`, and then does nothing.
fn fill_triangle(image: u32, packed: u32, offset: u32, step: u32, reference: i32, floor_px: f32, limit: i32) -> bool {
    let a = corners[packed & 0xffu];
    let b = corners[(packed >> 8u) & 0xffu];
    let c = corners[(packed >> 16u) & 0xffu];
    let highest = max(a.h, max(b.h, c.h));
    let left = max(min(a.x, min(b.x, c.x)), -1);
    let right = min(max(a.x, max(b.x, c.x)), SUB * i32(frame.width_px));
    let top_row = max(min(a.y, min(b.y, c.y)), 0);
    let bottom_row = min(max(a.y, max(b.y, c.y)), SUB * i32(frame.height_px) - 1);
    if f32(highest - reference) + 1.0 < floor_px || top_row > bottom_row
        || right < 0 || left >= SUB * i32(frame.width_px)
        || !wanted(image, left / SUB, right / SUB, top_row / SUB, bottom_row / SUB) {
        return false;
    }
    let ab = vec2<f32>(f32(b.x - a.x), f32(b.y - a.y));
    let ac = vec2<f32>(f32(c.x - a.x), f32(c.y - a.y));
    let pixels = i32(min(0.5 * abs(ab.x * ac.y - ab.y * ac.x), 1e6));
    if ROW_PX * (bottom_row - top_row + 1) + pixels > limit {
        return true;
    }
    // From the uppermost to the lowest.
    var p = a;
    var q = b;
    var r = c;
    if !above(p, q) {
        p = b;
        q = a;
    }
    if !above(q, r) {
        r = q;
        q = c;
        if !above(p, q) {
            q = p;
            p = c;
        }
    }
    let whole_side = edge(p, r, reference);
    let upper_side = edge(p, q, reference);
    let lower_side = edge(q, r, reference);
    if whole_side.per_row == 0.0 {
        return false;
    }
    let last = min(r.y, bottom_row);
    for (var row = max(p.y + i32(ceil(p.fy)), 0) + i32(offset); row <= last; row += i32(step)) {
        let tiles = tiles_of(image, row);
        if tiles == 0u {
            continue;
        }
        let below_middle = f32(row - q.y) - q.fy;
        let upper = below_middle < 0.0 || (below_middle == 0.0 && upper_side.per_row > 0.0);
        var side = lower_side;
        if upper {
            side = upper_side;
        }
        fill_row(image, crossing(whole_side, row), crossing(side, row), row, tiles);
    }
    return false;
}

// One workgroup a cluster and image.
@compute @workgroup_size(THREADS)
fn fill(@builtin(workgroup_id) id: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let image = group.first_image + id.y;
    let cluster = id.x;
    let found = atomicLoad(&tops[image]);
    let reference = select(bitcast<i32>(found ^ 0x80000000u), presses[image].bound_px, found == 0u);
    let floor_px = select(-frame.reach_px, -0x1p120f, found == 0u);
    let seen = visible(image, cluster, reference, floor_px);
    let first_vertex = clusters[cluster].first_vertex;
    if seen {
        for (var i = thread; i < clusters[cluster].vertices; i += THREADS) {
            corners[i] = finer(vertex(image, first_vertex + i));
        }
    }
    if thread == 0u {
        atomicStore(&large_count, 0u);
    }
    workgroupBarrier();
    if seen {
        let first_triangle = clusters[cluster].first_triangle;
        for (var i = thread; i < clusters[cluster].triangles; i += THREADS) {
            let packed = triangles[first_triangle + i];
            if fill_triangle(image, packed, 0u, 1u, reference, floor_px, LARGE_PX) {
                large[atomicAdd(&large_count, 1u)] = packed;
            }
        }
    }
    workgroupBarrier();
    let count = atomicLoad(&large_count);
    for (var i = 0u; i < count; i++) {
        fill_triangle(image, large[i], thread, THREADS, reference, floor_px, 0x7fffffff);
    }
}
