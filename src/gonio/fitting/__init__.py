"""From measurement to model: fits, their uncertainty, the choice between models, and plans of what to measure next."""

from ..declared.namespace import on_use

__getattr__, __dir__, __all__ = on_use(
    __name__,
    {
        "fit_many": "fitting.many",
        "fit_map": "fitting.maps.maps",
        "fit_map_chunks": "fitting.maps.map_chunks",
        "fit_problem": "fitting.problem",
        "select_model": "fitting.selection",
    },
)
