"""Formats of pictures, one file each, which `pictures/image.py` discovers.

A module declares the first bytes of its files (STARTS: bytes -> name), their suffixes (SUFFIXES) and the one that it
writes (WRITTEN). `read(source)` returns a `Picture`. `encode(image, path, exposure)` refuses or announces values that
the format cannot hold, and returns a function that writes the rest to a path. One that reads codes as they are has also
GRAY, as STARTS, and `gray(source)`, which returns them.
"""
