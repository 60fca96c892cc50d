"""Integrals over directions: albedo, the nine reflectances, the reflection equation."""
