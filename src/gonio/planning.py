"""Which directions to measure: plans for models and for tables."""

from .declared.namespace import on_use

__getattr__, __dir__, __all__ = on_use(
    __name__,
    {
        "plan": "reconstruction.planning.directions",
        "plan_table": "reconstruction.reconstructing",
        "Goniometer": "reconstruction.planning.goniometer",
    },
)
