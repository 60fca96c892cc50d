"""Unit vectors, beside `gn.direction` and `gn.angles`: local frames, half and difference angles, reflection,"""

from .base.frames import from_half_difference as from_half_difference
from .base.frames import half_difference as half_difference
from .base.frames import normalize as normalize
from .base.frames import reflect as reflect
from .base.frames import refract as refract
from .base.frames import to_local as to_local
from .base.frames import to_world as to_world
