"""Shared by formats of rows and of angles: pairs of directions with values, and libbsdf's grids."""
