"""What formats of rows and of angles share: pairs of directions with values, and grids as libbsdf has them."""
