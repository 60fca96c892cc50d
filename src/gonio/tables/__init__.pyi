"""Values of measurements at angles: on grids and in no grid, between their nodes, as datasets."""

from ..conversion.tabulated import tabulate as tabulate
from ..tables.dataset import from_dataset as from_dataset
from ..tables.dataset import to_dataset as to_dataset
