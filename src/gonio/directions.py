"""Unit vectors, beside `gn.direction` and `gn.angles`: local frames, half and difference angles, reflection,
refraction."""

from .declared.namespace import on_use

__getattr__, __dir__, __all__ = on_use(
    __name__,
    {
        "from_half_difference": "base.frames",
        "half_difference": "base.frames",
        "normalize": "base.frames",
        "reflect": "base.frames",
        "refract": "base.frames",
        "to_local": "base.frames",
        "to_world": "base.frames",
    },
)
