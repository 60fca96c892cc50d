"""Graphs as LLVM IR: programs, vectors of lanes, elementary functions, access to memory, this processor."""
