"""Lit shapes as pictures."""

from ..interreflection.solving import radiosity as radiosity
from ..pictures.difference import picture_difference as picture_difference
from ..pictures.image import Image as Image
from ..pictures.image import load_image as load_image
from ..scenes.camera import Camera as Camera
from ..scenes.camera import OrthographicCamera as OrthographicCamera
from ..scenes.camera import View as View
from ..scenes.jacobian import picture_jacobian as picture_jacobian
from ..scenes.mesh import Mesh as Mesh
from ..scenes.stokes import render_stokes as render_stokes
from ..scenes.turntable import write_turntable as write_turntable
