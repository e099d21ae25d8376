// What host and device share. Kept equal to src/gpu/layout.rs by a test that compares every offset.

// One sensor with its gel.
struct Frame {
    width_px: u32,
    height_px: u32,
    // Words of one packed image.
    image_words: u32,
    // Bins of a colour table; 0 with lights.
    bins: u32,
    thickness_px: f32,
    // What lies this much deeper than the highest vertex cannot be touched: thickness and sag of the gel at rest.
    reach_px: f32,
    restore_depth_fraction: f32,
    // Standard deviation of the noise of red, green and blue, in grey levels.
    noise_red: f32,
    noise_green: f32,
    noise_blue: f32,
}

// One image: where the part is, how hard it is pressed, which noise.
struct PressInput {
    // Rotation times scale: pixels per step of the mesh's vertices, in units of 2^-fraction_bits.
    // Rows: image x, image y, height.
    matrix: array<i32, 9>,
    // The mesh's centre, low and high words of 64-bit numbers in the same unit: x, y, height.
    shift: array<u32, 6>,
    fraction_bits: u32,
    // No vertex is higher, in whole pixels.
    bound_px: i32,
    // Volume of the imprint, in cubic pixels.
    wanted_px3: f32,
    pixels_per_step: f32,
    // Bit 0: a part is there. Bit 1: the image has noise.
    flags: u32,
    key: array<u32, 2>,
}

// How a press ended.
struct Outcome {
    // 0 pressed, 1 nothing in front, 2 deeper than the gel.
    status: u32,
    press_px: f32,
    // Volume at a press as deep as the gel.
    available_px3: f32,
    // Contact deeper than this is restored after each blur.
    core_px: f32,
    // The highest of the part's pixels above the gel at rest.
    top_px: f32,
    // First and last column and row with contact; the last before the first without.
    low_x: u32,
    low_y: u32,
    high_x: u32,
    high_y: u32,
}

// A piece of a mesh.
struct Cluster {
    first_vertex: u32,
    vertices: u32,
    first_triangle: u32,
    triangles: u32,
    // Box around it: centre and half extents, in steps.
    centre: array<i32, 3>,
    half: array<f32, 3>,
}

// The images that show one mesh.
struct Group {
    first_image: u32,
    clusters: u32,
}

// Colours by regression: limits, and where the planes of its surroundings lie. Levels are counted from the finest.
struct Regression {
    mm_per_px: f32,
    // Largest sine of a slope, and height, that the calibration has seen.
    slope_limit: f32,
    height_limit_mm: f32,
    // Pixels along the side of a cell of level 0.
    cell_px: u32,
    columns: vec4<u32>,
    rows: vec4<u32>,
    // First float of each level's planes: smoothed along both axes, along one; differences of levels 2 and 3, ten
    // planes each; colours of levels 0 and 1, three planes each.
    heights: vec4<u32>,
    half_way: vec4<u32>,
    differences: vec4<u32>,
    colours: vec4<u32>,
    // The same for the mean heights of the cells of level 0, and the floats of one image.
    means: u32,
    image_floats: u32,
    unused: vec2<u32>,
}

// A shadow table.
struct Shadows {
    // Pixels around the core of a contact from which rays go out.
    rim_px: u32,
    // Rows and sectors of direction.
    heights: u32,
    directions: u32,
    // Whether the outermost rows hold beyond their heights.
    held: u32,
    first_px: f32,
    per_px: f32,
}

// One blur of shadows along one axis.
struct ShadowBlur {
    radius: i32,
    edge_once: u32,
    down: u32,
}

// Tiles along each side of an image in which pixels beside steps are looked for.
const TILES = 32u;

// Such a tile has 2^this pixels along its side.
fn tile_bits(frame: Frame) -> u32 {
    return max(firstLeadingBit(max(frame.width_px, frame.height_px)), 4u) - 4u;
}

const HAS_PART = 1u;
const HAS_NOISE = 2u;

// Floats as integers of the same order; 0 stands for "no surface".
fn ordered(value: f32) -> u32 {
    let bits = bitcast<u32>(value);
    return select(bits | 0x80000000u, ~bits, bits >= 0x80000000u);
}

fn unordered(code: u32) -> f32 {
    return bitcast<f32>(select(~code, code ^ 0x80000000u, code >= 0x80000000u));
}
