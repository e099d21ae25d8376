// Stage deform, one blur down the image, for graphics processors: a workgroup blurs SPAN rows of LANES columns that it
// holds in its own memory, each thread RUN neighbouring rows. CPU twins: src/deform.rs and src/convolve.rs.

@compute @workgroup_size(THREADS)
fn main(@builtin(workgroup_id) id: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let image = id.z;
    let first = vec2<i32>(i32(id.y * LANES), i32(id.x * SPAN));
    let touched = reached(first, vec2<i32>(i32(LANES), i32(SPAN)), image);
    // Neighbouring threads read and write neighbouring columns.
    let lane = thread % LANES;
    let line = thread / LANES;
    let x = first.x + i32(lane);
    if touched {
        /*LOADS*/
    }
    workgroupBarrier();
    let start = line * RUN;
    let base = start * PITCH + lane;
    /*SUMS*/
    let y = first.y + i32(start);
    /*FINISH*/
}
