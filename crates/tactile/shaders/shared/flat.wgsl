// A gel that is flat at rest.

const DOMED = false;

fn whole_surface(x: u32, y: u32, image: u32) -> f32 {
    return load_surface(x, y, image);
}

fn slope_at_rest(x: u32, y: u32) -> vec2<f32> {
    return vec2<f32>(0.0, 0.0);
}
