"""A blind benchmark of `gripgen diagnose`: own physics, own formulas, sealed truth."""
