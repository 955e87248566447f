"""Arithmetic that knows nothing of wires: types, sums of logarithms, stacks of matrices, resampling."""
