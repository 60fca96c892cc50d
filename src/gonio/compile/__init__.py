"""Graphs as machine code: kernels for NumPy arrays, written in LLVM IR and compiled by llvmlite."""
