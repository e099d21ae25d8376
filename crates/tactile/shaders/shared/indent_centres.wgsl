// Pieces of indent.wgsl that look at the centres of pixels.
//# SECOND
false
//# STEPS
//# POINTS
//# AGAIN
