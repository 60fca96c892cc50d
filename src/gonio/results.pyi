"""What functions return, for annotations and `isinstance`; nobody makes these."""

from .base.results import Sample as Sample
from .bridges.source.result import ShaderSource as ShaderSource
from .fitting.maps.maps import FitMap as FitMap
from .fitting.maps.photometric_stereo import PhotometricStereo as PhotometricStereo
from .fitting.maps.texel_data import TexelData as TexelData
from .fitting.result import Fit as Fit
from .integrals.fate import Fate as Fate
from .interreflection.result import Radiosity as Radiosity
from .pictures.difference import PictureDifference as PictureDifference
from .reconstruction.basis import ReflectanceBasis as ReflectanceBasis
from .reconstruction.planning.plan import Plan as Plan
from .reconstruction.planning.table_plan import TablePlan as TablePlan
from .reconstruction.posterior import Reconstruction as Reconstruction
from .reconstruction.retro import RetroFacets as RetroFacets
