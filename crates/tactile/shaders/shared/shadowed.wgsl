// The change of an image with shadows. `dark` is the result of shadow_blur.wgsl; with INSTEAD it is Taxim's image without
// its background, which stands in `rest` behind the offset.

const INSTEAD = /*INSTEAD*/;

@group(0) @binding(10) var<storage, read> dark: array<f32>;

fn changed(x: u32, y: u32, image: u32) -> vec3<f32> {
    let pixels = frame.width_px * frame.height_px;
    let pixel = y * frame.width_px + x;
    let first = 3u * image * pixels + pixel;
    let shadow = vec3<f32>(dark[first], dark[first + pixels], dark[first + 2u * pixels]);
    if INSTEAD {
        let base = 6u * pixels + pixel;
        return shadow + vec3<f32>(rest[base], rest[base + pixels], rest[base + 2u * pixels]);
    }
    return shade(x, y, image, gradient(x, y, image)) + shadow;
}
