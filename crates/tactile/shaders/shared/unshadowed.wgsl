// The change of an image without shadows.

fn changed(x: u32, y: u32, image: u32) -> vec3<f32> {
    return shade(x, y, image, gradient(x, y, image));
}
