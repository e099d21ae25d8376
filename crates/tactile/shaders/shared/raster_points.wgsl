// Pieces of raster.wgsl that look at nine points of each pixel beside a step.
//# SUB
3
//# STEPS
@group(0) @binding(8) var<storage, read> steps: array<f32>;
@group(0) @binding(9) var<storage, read> stepped: array<u32>;
//# STORE
let pixel = start + u32(x) / 3u;
if steps[pixel] > 0.0 {
    atomicMax(&heights[9u * pixel + 3u * (u32(row) % 3u) + u32(x) % 3u], ordered(h));
}
//# WANTED
let tile = tile_bits(frame);
let size = vec2<i32>(i32(frame.width_px), i32(frame.height_px)) - 1;
let low = vec2<u32>(clamp(vec2<i32>(left, top), vec2<i32>(), size)) >> vec2<u32>(tile);
let high = vec2<u32>(clamp(vec2<i32>(right, bottom), vec2<i32>(), size)) >> vec2<u32>(tile);
let columns = (0xffffffffu >> (31u - high.x)) & (0xffffffffu << low.x);
var found = 0u;
for (var y = low.y; y <= high.y; y++) {
    found |= stepped[TILES * image + y];
}
return (found & columns) != 0u;
//# ROW
stepped[TILES * image + ((u32(row) / 3u) >> tile_bits(frame))]
//# COLUMN
let tile = (u32(x) / 3u) >> tile_bits(frame);
if (tiles & (1u << tile)) == 0u {
    x = i32(3u * ((tile + 1u) << tile_bits(frame))) - 1;
    continue;
}
