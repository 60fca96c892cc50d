"""Numerical methods that know no reflectance: cubature, lattices, filling of holes."""
