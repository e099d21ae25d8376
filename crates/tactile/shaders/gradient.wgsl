// Stage gradient: the slope of the gel surface. CPU twin: src/gradient.rs.

// Slopes along x and y of the whole surface at a pixel: central differences, the border copies its neighbour.
fn gradient(x: u32, y: u32, image: u32) -> vec2<f32> {
    if frame.width_px < 3u || frame.height_px < 3u {
        return vec2<f32>(0.0, 0.0);
    }
    let cx = clamp(x, 1u, frame.width_px - 2u);
    let cy = clamp(y, 1u, frame.height_px - 2u);
    return 0.5 * vec2<f32>(
        whole_surface(cx + 1u, cy, image) - whole_surface(cx - 1u, cy, image),
        whole_surface(cx, cy + 1u, image) - whole_surface(cx, cy - 1u, image),
    );
}
