"""Bounds on the size of materials: every reader of texts, and every constructor, refuses larger ones at once."""

from __future__ import annotations

NESTED = 16
"""The largest depth of nested values: `Rotated(Lambertian())` is 2 deep, a sum one more than its deepest term."""

EVALUATIONS = 4096
"""The largest size of a material, in terms of a sum: each term counts 1, so do parts such as `GGX`; a coat counts 8,
and `NormalMapped` six times its part, whose formula it needs in three pairs of directions."""

CHANNELS = 4096
"""The most channels of a parameter in a text; arrays from Python may have any number."""

MAX_LENGTH = 20_000
"""The longest expression, in characters."""

MAX_DEPTH = 40
"""The largest depth of nested brackets, calls and signs in an expression."""

COMPILED = 12_000
"""Operations up to which a formula is compiled, in ten seconds; the time grows with the square. Larger ones run on
NumPy."""
