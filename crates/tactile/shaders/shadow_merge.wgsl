// Stage shadow, what the rays make of the image. CPU twin: src/shadow.rs.

// 0: values are added. 1: values are ceilings. 2: ceilings on Taxim's image without its background.
const KIND = /*KIND*/u;

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(2) var<storage, read> rest: array<f32>;
@group(0) @binding(10) var<storage, read> lowest: array<u32>;
// By image, channel and pixel.
@group(0) @binding(11) var<storage, read_write> dark: array<f32>;
//#PLANES

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= frame.width_px || id.y >= frame.height_px {
        return;
    }
    let pixels = frame.width_px * frame.height_px;
    let pixel = id.y * frame.width_px + id.x;
    let value = unshadowed(id.x, id.y, id.z);
    for (var channel = 0u; channel < 3u; channel++) {
        var bright = value[channel];
        if KIND == 2u {
            bright -= rest[(3u + channel) * pixels + pixel];
        }
        let at = (3u * id.z + channel) * pixels + pixel;
        var lowered = bright;
        if lowest[at] != 0u {
            lowered = min(bright, unordered(~lowest[at]));
        }
        if KIND == 1u {
            lowered -= bright;
        }
        dark[at] = lowered;
    }
}
