// Stages gradient, shade and noise in one pass: four pixels per thread, whose RGB are three words of the packed image.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> presses: array<PressInput>;
// Rest frame: planes of red, green and blue, in grey levels; see shade_taxim.wgsl for what may follow.
@group(0) @binding(2) var<storage, read> rest: array<f32>;
// Binding 3 is `colour`, the coefficients of the colour model: see shade_*.wgsl.
// Standard normal values by the sum of four random bytes.
@group(0) @binding(4) var<storage, read> levels: array<f32>;
@group(0) @binding(5) var<storage, read_write> packed: array<u32>;
//#PLANES

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let image = id.y;
    let pixels = frame.width_px * frame.height_px;
    let first = 4u * id.x;
    if first >= pixels {
        return;
    }
    // Without a part there is no change, whatever the shape of the gel.
    let pressed = (presses[image].flags & HAS_PART) != 0u;
    let noisy = (presses[image].flags & HAS_NOISE) != 0u;
    let noise = vec3<f32>(frame.noise_red, frame.noise_green, frame.noise_blue);
    let words = key_words(presses[image].key[0], presses[image].key[1]);
    var bytes = array<u32, 3>(0u, 0u, 0u);
    for (var i = 0u; i < 4u; i++) {
        let pixel = first + i;
        if pixel < pixels {
            let x = pixel % frame.width_px;
            let y = pixel / frame.width_px;
            var change = vec3<f32>(0.0, 0.0, 0.0);
            if pressed {
                change = changed(x, y, image);
            }
            for (var channel = 0u; channel < 3u; channel++) {
                var value = rest[channel * pixels + pixel] + change[channel];
                if noisy {
                    // The clean frame is rounded first: noise can be added to a stored one later.
                    value = f32(rounded(value)) + noise[channel] * standard_normal(words, 3u * pixel + channel);
                }
                let place = 3u * i + channel;
                bytes[place / 4u] |= rounded(value) << (8u * (place % 4u));
            }
        }
    }
    let to = image * frame.image_words + 3u * id.x;
    packed[to] = bytes[0];
    packed[to + 1u] = bytes[1];
    packed[to + 2u] = bytes[2];
}
