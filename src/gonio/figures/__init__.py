"""Figures for papers and reports, a call each: of one material or several, drawn with Matplotlib.

Each function returns a figure of Matplotlib. `path` writes it to a .png, .jpg, .pdf or .svg file; where a function
takes `axes`, it draws into those of a figure that is there. Angles are drawn in degrees, f in 1/sr, in colours that
people tell apart whatever colours they see.
"""

from ..declared.namespace import own_names
from .albedo_figure import albedo as albedo
from .difference_figure import difference as difference
from .fate_figure import fate as fate
from .fit_figure import fit as fit
from .gallery_figure import gallery as gallery
from .half_difference_figure import half_difference as half_difference
from .laws_figure import laws as laws
from .overview_figure import overview as overview
from .overview_figure import portrait as portrait
from .polar_figure import polar as polar
from .slices_figure import slices as slices

__all__, __dir__ = own_names(globals())
