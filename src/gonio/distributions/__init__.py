"""Distributions of facet normals, one file each: every public class in this folder's files is found and exported."""
