// Pieces of raster.wgsl that look at the centres of pixels.
//# SUB
1
//# STEPS
//# STORE
atomicMax(&heights[start + u32(x)], ordered(h));
//# WANTED
return true;
//# ROW
0xffffffffu
//# COLUMN
