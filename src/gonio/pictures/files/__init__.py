"""Files of pictures, one format each: found by what they declare.

A module says by which first bytes its files are known (STARTS: bytes -> name), which suffixes they have (SUFFIXES) and
which of them it writes (WRITTEN); `read(source)` gives a `Picture`, and `encode(picture, path, exposure)` refuses or
announces what the format cannot hold and gives what writes the rest.
"""
