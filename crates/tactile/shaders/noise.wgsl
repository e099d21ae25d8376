// Stage noise: sensor noise, rounding to 8 bits and packing. CPU twin: src/noise.rs and pixel_noise.rs of gripgen-twin, with the same
// hash and values.

fn scramble(word: u32) -> u32 {
    var h = word;
    h ^= h >> 16u;
    h *= 0x85ebca6bu;
    h ^= h >> 13u;
    h *= 0xc2b2ae35u;
    return h ^ (h >> 16u);
}

// The two words that an image's key becomes.
fn key_words(low: u32, high: u32) -> vec2<u32> {
    let first = scramble(low ^ scramble(high));
    return vec2<u32>(first, scramble(high ^ scramble(low + first)));
}

// A standard normal number for value `index` of an image.
fn standard_normal(words: vec2<u32>, index: u32) -> f32 {
    let hash = scramble(scramble(index ^ words.x) + words.y);
    let pairs = (hash & 0x00ff00ffu) + ((hash >> 8u) & 0x00ff00ffu);
    return levels[(pairs & 0xffffu) + (pairs >> 16u)];
}

fn rounded(value: vec3<f32>) -> vec3<u32> {
    return vec3<u32>(floor(clamp(value, vec3<f32>(0.0), vec3<f32>(255.0)) + 0.5));
}
