// Stage deform, one blur along one axis, for software adapters: each thread makes RUN neighbouring values from
// textures. CPU twins: src/deform.rs and src/convolve.rs.

const RUN = /*RUN*/;
const HALF = /*HALF*/;

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> outcomes: array<Outcome>;
//#PLANES

// Borders are mirrored, the edge is not repeated.
fn mirrored(i: i32, size: i32) -> i32 {
    let low = abs(i);
    return clamp(select(low, 2 * (size - 1) - low, low >= size), 0, size - 1);
}

fn at(run: i32, line: i32, image: u32) -> f32 {
    let place = mirrored(run, /*SIZE*/);
    return load_source(/*FROM_X*/, /*FROM_Y*/, image);
}

fn finish(run: i32, line: i32, image: u32, blurred: f32) {
    if run < /*SIZE*/ {
        let place = run;
        let x = /*FROM_X*/;
        let y = /*FROM_Y*/;
        var value = blurred;
        /*DEPTH*/
        /*RESTORE*/
        store_blurred(x, y, image, value);
    }
}

@compute @workgroup_size(/*WORKGROUP*/)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let first = i32(id./*AXIS*/) * RUN;
    let line = i32(id./*ACROSS*/);
    let image = id.z;
    if first >= /*SIZE*/ || line >= /*LINES*/ {
        return;
    }
    /*SUMS*/
    /*FINISH*/
}
