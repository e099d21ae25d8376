// Stage shadow, a blur along one axis. CPU twin: src/shadow/blur.rs.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> blur: ShadowBlur;
// Centre and one side.
@group(0) @binding(2) var<storage, read> weights: array<f32>;
@group(0) @binding(3) var<storage, read> source: array<f32>;
@group(0) @binding(4) var<storage, read_write> blurred: array<f32>;

// Borders are mirrored, with the edge once or twice.
fn mirrored(i: i32, size: u32) -> u32 {
    let n = i32(size);
    let once = blur.edge_once != 0u;
    let period = select(2 * n, max(2 * n - 2, 1), once);
    let folded = ((i % period) + period) % period;
    let back = select(2 * n - 1 - folded, period - folded, once);
    return u32(select(folded, back, folded >= n));
}

fn at(x: u32, y: u32, offset: i32, plane: u32) -> f32 {
    if blur.down != 0u {
        return source[plane + mirrored(i32(y) + offset, frame.height_px) * frame.width_px + x];
    }
    return source[plane + y * frame.width_px + mirrored(i32(x) + offset, frame.width_px)];
}

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= frame.width_px || id.y >= frame.height_px {
        return;
    }
    let pixels = frame.width_px * frame.height_px;
    for (var channel = 0u; channel < 3u; channel++) {
        let plane = (3u * id.z + channel) * pixels;
        var sum = weights[0] * at(id.x, id.y, 0, plane);
        for (var k = 1; k <= blur.radius; k++) {
            sum += weights[k] * (at(id.x, id.y, -k, plane) + at(id.x, id.y, k, plane));
        }
        blurred[plane + id.y * frame.width_px + id.x] = sum;
    }
}
