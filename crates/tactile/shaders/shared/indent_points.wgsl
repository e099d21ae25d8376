// Pieces of indent.wgsl that look at nine points of each pixel beside a step.
//# SECOND
true
//# STEPS
@group(0) @binding(6) var<storage, read> steps: array<f32>;
@group(0) @binding(7) var<storage, read> points: array<u32>;
@group(0) @binding(8) var<storage, read> stepped: array<u32>;
//# POINTS
let weight = steps[start + pixel];
if weight > 0.0 {
    var sum = vec2<f32>();
    for (var k = 0u; k < 9u; k++) {
        sum += touch(points[9u * (start + pixel) + k], pixel, top, press);
    }
    here += weight * (sum / 9.0 - here);
}
//# AGAIN
let before = outcomes[image];
newton.press = before.press_px;
newton.available = before.available_px3;
var found = 0u;
for (var row = 0u; row < TILES; row++) {
    found |= stepped[TILES * image + row];
}
if before.status != 0u || found == 0u {
    newton.running = 0u;
}
