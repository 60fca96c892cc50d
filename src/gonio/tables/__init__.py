"""Values of measurements at angles: on grids and in no grid, between their nodes, as datasets."""

from ..declared.namespace import on_use

__getattr__, __dir__, __all__ = on_use(
    __name__,
    {
        "tabulate": "conversion.tabulated",
        "from_dataset": "tables.dataset",
        "to_dataset": "tables.dataset",
    },
)
