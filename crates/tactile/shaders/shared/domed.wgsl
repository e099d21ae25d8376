// A gel that is not flat at rest. `gel` is its surface towards the part, in pixels; images look at it from behind.

const DOMED = true;

@group(0) @binding(7) var<storage, read> gel: array<f32>;

fn gel_surface(x: u32, y: u32) -> f32 {
    return -gel[y * frame.width_px + x];
}

fn whole_surface(x: u32, y: u32, image: u32) -> f32 {
    return load_surface(x, y, image) + gel_surface(x, y);
}

fn slope_at_rest(x: u32, y: u32) -> vec2<f32> {
    let cx = clamp(x, 1u, frame.width_px - 2u);
    let cy = clamp(y, 1u, frame.height_px - 2u);
    return 0.5 * vec2<f32>(
        gel_surface(cx + 1u, cy) - gel_surface(cx - 1u, cy),
        gel_surface(cx, cy + 1u) - gel_surface(cx, cy - 1u),
    );
}
