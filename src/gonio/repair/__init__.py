"""Repairs of measurements: functions that change a measurement on request, and report the change.

    m = gn.repair.fill_holes(m, "smooth")
    print(m.repairs[-1])       # cells, share, largest and mean change of f, albedo before and after, figures

Every function takes a Gridded measurement and returns a new one, with one more `Repair` in its history, `m.repairs`.
`resample` takes any reflectance, `merge_scans` several measurements. Standard uncertainties are propagated as those of
independent errors, if a function does not say otherwise. gonio never repairs anything without being asked.
"""

from ..declared.namespace import own_names
from .apertures import aperture_averaged as aperture_averaged
from .apertures import aperture_removed as aperture_removed
from .apertures import through_aperture as through_aperture
from .grazing import extrapolate_to_grazing as extrapolate_to_grazing
from .holes import fill_holes as fill_holes
from .negatives import remove_negatives as remove_negatives
from .resampling import resample as resample
from .scans import merge_scans as merge_scans
from .signature import subtract_signature as subtract_signature
from .symmetry import symmetrize as symmetrize

__all__, __dir__ = own_names(globals())
