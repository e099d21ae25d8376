"""Whether a training set of gripgen teaches: networks trained on it meet worlds of other code."""
