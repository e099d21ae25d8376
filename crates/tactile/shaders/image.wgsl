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

// Red, green and blue of a pixel.
fn colours(pixel: u32, image: u32, words: vec2<u32>) -> vec3<u32> {
    let pixels = frame.width_px * frame.height_px;
    if pixel >= pixels {
        return vec3<u32>();
    }
    var value = vec3<f32>(rest[pixel], rest[pixels + pixel], rest[2u * pixels + pixel]);
    // Without a part there is no change, whatever the shape of the gel.
    if (presses[image].flags & HAS_PART) != 0u {
        let y = pixel / frame.width_px;
        value += changed(pixel - y * frame.width_px, y, image);
    }
    if (presses[image].flags & HAS_NOISE) != 0u {
        // The clean frame is rounded first: noise can be added to a stored one later.
        let clean = vec3<f32>(rounded(value));
        let first = 3u * pixel;
        value = vec3<f32>(
            clean.x + frame.noise_red * standard_normal(words, first),
            clean.y + frame.noise_green * standard_normal(words, first + 1u),
            clean.z + frame.noise_blue * standard_normal(words, first + 2u),
        );
    }
    return rounded(value);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let image = id.y;
    let first = 4u * id.x;
    if first >= frame.width_px * frame.height_px {
        return;
    }
    let words = key_words(presses[image].key[0], presses[image].key[1]);
    let a = colours(first, image, words);
    let b = colours(first + 1u, image, words);
    let c = colours(first + 2u, image, words);
    let d = colours(first + 3u, image, words);
    let to = image * frame.image_words + 3u * id.x;
    packed[to] = a.x | (a.y << 8u) | (a.z << 16u) | (b.x << 24u);
    packed[to + 1u] = b.y | (b.z << 8u) | (c.x << 16u) | (c.y << 24u);
    packed[to + 2u] = c.z | (d.x << 8u) | (d.y << 16u) | (d.z << 24u);
}
