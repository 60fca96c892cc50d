"""Which directions to measure: plans for models and for tables."""

from .reconstruction.planning.directions import plan as plan
from .reconstruction.planning.goniometer import Goniometer as Goniometer
from .reconstruction.reconstructing import plan_table as plan_table
