// Stage deform, one blur along the rows, for graphics processors: a workgroup blurs SPAN columns of LANES rows that it
// holds in its own memory, each thread RUN neighbouring columns. CPU twins: src/deform.rs and src/convolve.rs.

@compute @workgroup_size(THREADS)
fn main(@builtin(workgroup_id) id: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let image = id.z;
    let first = vec2<i32>(i32(id.x * SPAN), i32(id.y * LANES));
    let touched = reached(first, vec2<i32>(i32(SPAN), i32(LANES)), image);
    // Neighbouring threads read and write neighbouring columns.
    let place = thread % 32u;
    let line = thread / 32u;
    if touched {
        /*LOADS*/
    }
    workgroupBarrier();
    let base = thread / LANES * RUN * PITCH + thread % LANES;
    /*SUMS*/
    workgroupBarrier();
    /*EXCHANGE*/
    workgroupBarrier();
    /*FINISH*/
}
