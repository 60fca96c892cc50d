"""Stokes vectors and Mueller matrices: axes, filters, degree of polarization, and which matrices can be.

Stokes vectors are (I, Q, U, V) in axes x and y such that x, y and k, the direction that light moves in, are
right-handed: Q = I_x - I_y, U + iV = 2 E_x conj(E_y) with the time factor exp(-i omega t). V > 0 turns clockwise for
who looks into the beam. `m.mueller` has the axes of the surface: see `frames`.
"""

from ..declared.namespace import own_names
from .axes import frames as frames
from .axes import rotator as rotator
from .axes import to_frames as to_frames
from .filters import analyser as analyser
from .filters import polarizer as polarizer
from .filters import retarder as retarder
from .states import angle as angle
from .states import coherency as coherency
from .states import dop as dop
from .states import realizable as realizable

__all__, __dir__ = own_names(globals())
