"""From measurement to model: fits, their uncertainty, the choice between models, and plans of what to measure next."""

from ..fitting.many import fit_many as fit_many
from ..fitting.maps.map_chunks import fit_map_chunks as fit_map_chunks
from ..fitting.maps.maps import fit_map as fit_map
from ..fitting.problem import fit_problem as fit_problem
from ..fitting.selection import select_model as select_model
