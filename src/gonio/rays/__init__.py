"""Rays: which triangle a ray meets first, and whether it meets any. Triangles only; no reflectance, no light."""
