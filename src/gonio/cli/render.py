"""`gonio render`: a picture of a material on a lit shape."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any, NamedTuple

import click

from ..declared.arguments import Declared
from ..errors import ParameterError, visible
from ..facts.public import public
from . import options
from .command import TypedArguments, command, option
from .terminal import bar, echo

Place = tuple[float, float, float]


class _TypedStage(NamedTuple):
    """What is around the shape, and the camera, as typed."""

    ground: str | None
    camera: Place | None
    look_at: Place | None
    angle: float | None

    def read(self) -> dict[str, Any]:
        """`ground` and `camera` of pictures."""
        ground = None if self.ground is None else options.TypedMaterial(self.ground).read()
        return {"ground": ground, "camera": self._camera()}

    def _camera(self) -> Any:
        if self.camera is None:
            for name, value in (("--look-at", self.look_at), ("--angle", self.angle)):
                if value is not None:
                    raise ParameterError(f"{name}: of no camera; expected its place too, --camera 1.5,-3,1.6")
            return None
        across = USUAL if self.angle is None else self.angle
        return public("scenes.Camera")(self.camera, self.look_at or (0.0, 0.0, 0.0), field_of_view=across)


USUAL = math.radians(35.0)
ACROSS = Declared("across that camera's picture", math.radians(0.01), math.radians(175.0), "rad", usual=USUAL)
PLACE = Declared("place of a pinhole camera", usual="far away, along +y, from above where there is --ground")
LOOK_AT = Declared("what that camera looks at", usual="0,0,0")


stage_options = options.together(
    "stage",
    _TypedStage,
    click.option("--ground", metavar="MATERIAL", help="Material of a level plane below, which takes shadows."),
    option("--camera", kind=Place, means=PLACE, metavar="X,Y,Z"),
    option("--look-at", kind=Place, means=LOOK_AT, metavar="X,Y,Z"),
    option("--angle", kind=float, means=ACROSS),
)


@command("render", short_help="Render MATERIAL on a lit shape.")
@options.material_argument
@options.output_option("Picture to write: .png, .exr or .hdr.")
@options.lit_options
@stage_options
@options.exposure_option
@options.with_light_help
def render(
    material: options.TypedMaterial,
    output: Path,
    lit: options.Lit,
    stage: _TypedStage,
    exposure: float,
    asked: TypedArguments,
) -> None:
    """Render MATERIAL on a lit shape.

    A .png is sRGB with a transparent background; .exr and .hdr hold linear radiance.
    """
    from ..base.shown_channels import is_coloured
    from ..pictures.image import check_target

    start = time.perf_counter()
    check_target(output, exposure)
    m, shown = material.read(), {**lit.read(), **stage.read()}
    if output.suffix.lower() != ".exr" and not is_coloured(m, shown["channels"]):
        names = ", ".join(map(str, m.channel_names or range(m.channels or 1)))
        advice = f"choose three, --channels RED,GREEN,BLUE, or one of {names:.90}; or write .exr"
        raise ParameterError(f"{output}: a picture of {m.channels} channels, expected 1 or 3; {advice}")
    with bar("rendering") as progress:
        picture = asked.call("render", m, progress=progress, **shown)
    picture.save(output, exposure)
    height, width = picture.pixels.shape[:2]
    what = f"{material.title} {lit}, {width} x {height}, {picture.samples} samples per pixel"
    echo(visible(f"{output}: {what}, {options.since(start)}"))
