"""Values of measurements at angles: on grids and in no grid, between their nodes, as datasets."""
