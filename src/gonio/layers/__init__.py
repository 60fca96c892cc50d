"""Stacks of layers: interfaces and media, added and doubled in a Fourier basis of the azimuth, as one reflectance."""
