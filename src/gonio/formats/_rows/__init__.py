"""Shared by formats of rows and of angles: pairs of directions with values, and grids as libbsdf has them."""
