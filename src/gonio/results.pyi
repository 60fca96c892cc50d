"""Classes of what functions and methods return, for annotations and `isinstance`: nobody calls these."""

from .base.frames import HalfDifferenceAngles as HalfDifferenceAngles
from .base.history import Repair as Repair
from .base.results import Sample as Sample
from .bridges.source.result import ShaderSource as ShaderSource
from .conversion.conversion import Conversion as Conversion
from .facts.compiled import Kernel as Kernel
from .fitting.maps.maps import FitMap as FitMap
from .fitting.maps.photometric_stereo import PhotometricStereo as PhotometricStereo
from .fitting.maps.texel_data import TexelData as TexelData
from .fitting.problem import Problem as Problem
from .fitting.result import Fit as Fit
from .fitting.selection import Selection as Selection
from .instrument.measure import Simulated as Simulated
from .integrals.fate import Fate as Fate
from .interreflection.result import Radiosity as Radiosity
from .laws._verdict import Report as Report
from .pictures.difference import PictureDifference as PictureDifference
from .reconstruction.basis import ReflectanceBasis as ReflectanceBasis
from .reconstruction.nearness import Matches as Matches
from .reconstruction.planning.plan import Plan as Plan
from .reconstruction.planning.table_plan import TablePlan as TablePlan
from .reconstruction.posterior import Reconstruction as Reconstruction
from .reconstruction.retro import RetroFacets as RetroFacets
from .remote_sensing.fitting import KernelFit as KernelFit
from .scenes.stokes import StokesPicture as StokesPicture
from .uncertainty.quoted import Quoted as Quoted
