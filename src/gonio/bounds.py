"""How large a material may be: what every reader of texts, and every constructor, refuses at once."""

from __future__ import annotations

NESTED = 16
"""How deep values are nested at most: `Rotated(Lambertian())` is 2 deep, a sum one more than its deepest term."""

EVALUATIONS = 4096
"""How large a material may be, in terms of a sum: each term counts 1, so do pieces such as `GGX`; a coat counts 8, and
`NormalMapped` six times what it holds, whose formula it needs in three pairs of directions."""

CHANNELS = 4096
"""How many channels a parameter in a text may have; arrays from Python may have any number."""

MAX_LENGTH = 20_000
"""Longest expression, in characters."""

MAX_DEPTH = 40
"""How deep brackets, calls and signs may be nested in an expression."""

TRACED = 200_000
"""Operations up to which a formula is traced: recorded to be differentiated, shown or compiled."""

COMPILED = 12_000
"""Operations up to which a formula is compiled, in ten seconds; larger ones, whose time grows with the square, run on
NumPy."""
