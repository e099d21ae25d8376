// What the regression's passes share. `Regression` and `frame` are bound by the file that uses this one.

// Where a pixel lies in the image: -1 to 1 along its width.
fn place(x_px: f32, y_px: f32) -> vec2<f32> {
    let size = vec2<f32>(f32(frame.width_px), f32(frame.height_px));
    return (vec2<f32>(x_px, y_px) - 0.5 * (size - 1.0)) * (2.0 / size.x);
}

// Place in the floats of an image of a cell of a level's plane.
fn cell(image: u32, plane: u32, level: u32, x: u32, y: u32) -> u32 {
    return image * regression.image_floats + plane + y * regression.columns[level] + x;
}
