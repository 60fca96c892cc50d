"""Interreflection of diffuse surfaces: `gn.scenes.radiosity`."""
