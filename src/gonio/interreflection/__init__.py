"""Interreflection of diffuse surfaces: `gn.radiosity`."""
