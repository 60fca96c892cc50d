"""`gonio render`: a picture of a material on a lit shape."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..errors import ParameterError, visible
from ..scenes.shapes import SHAPES
from . import options
from .angles import Angle
from .terminal import bar, echo

if TYPE_CHECKING:
    from ..scenes.camera import Camera

SAMPLES = "Samples per pixel; the most where there is --noise.  [default: 32; 65536 with --noise]"
NOISE = "Go on until the noise is this share of the mean radiance, 0.01 say."
CHECKPOINT = "File that keeps what is done: the same command goes on from there after it was ended."
CAMERA = "Place of a pinhole camera.  [default: far away, along +y, from above where there is --ground]"
SEED = "Of the random numbers: the same seed, the same picture."


@click.command(short_help="Render MATERIAL on a lit shape.")
@options.material_argument
@options.output_option("Picture to write: .png, .exr or .hdr.")
@options.lights_option
@options.replace_option
@click.option(
    "--shape", default="sphere", show_default=True, help=f"What to render: {', '.join(SHAPES)}, or a mesh: bunny.ply."
)
@click.option("--ground", metavar="MATERIAL", help="Material of a level plane below, which takes shadows.")
@click.option("--camera", metavar="X,Y,Z", help=CAMERA)
@click.option("--look-at", metavar="X,Y,Z", help="What that camera looks at.  [default: 0,0,0]")
@click.option("--angle", type=Angle(0.01, 175.0), help="Across that camera's picture.  [default: 35]")
@click.option("--backdrop", is_flag=True, help="Show the light behind everything, such as the sky.")
@click.option("--size", default=512, show_default=True, help="Width and height in pixels.")
@click.option("--samples", type=int, help=SAMPLES)
@click.option("--noise", type=float, metavar="SHARE", help=NOISE)
@click.option("--checkpoint", type=click.Path(dir_okay=False, path_type=Path), help=CHECKPOINT)
@options.bands_option
@click.option("--seed", default=0, type=click.IntRange(min=0), show_default=True, help=SEED)
@click.option("--exposure", default=0.0, show_default=True, help="Stops by which a .png is brightened.")
@options.with_light_help
def render(
    material: str,
    output: Path,
    lights: tuple[str, ...],
    replaced: tuple[str, ...],
    shape: str,
    ground: str | None,
    camera: str | None,
    look_at: str | None,
    angle: float | None,
    backdrop: bool,
    size: int,
    samples: int | None,
    noise: float | None,
    checkpoint: Path | None,
    bands: str | None,
    seed: int,
    exposure: float,
) -> None:
    """Render MATERIAL on a lit shape.

    A .png is sRGB with a transparent background; .exr and .hdr hold linear radiance.
    """
    from ..base.shown_channels import is_coloured
    from ..pictures.image import check_target
    from ..scenes.rendering import render as render_image

    start = time.perf_counter()
    check_target(output, exposure)
    m = options.read_material(material, replaced)
    sources, chosen = options.read_lights(lights), options.bands_of(bands)
    floor = None if ground is None else options.read_material(ground, ())
    view = _camera(camera, look_at, angle)
    if output.suffix.lower() != ".exr" and not is_coloured(m, chosen):
        names = ", ".join(map(str, m.channel_names or range(m.channels or 1)))
        advice = f"choose three, --bands RED,GREEN,BLUE, or one of {names:.90}; or write .exr"
        raise ParameterError(f"{output}: a picture of {m.channels} channels, expected 1 or 3; {advice}")
    with bar("rendering") as progress:
        picture = render_image(
            *(m, sources, shape, size, samples, seed),
            progress=progress,
            bands=chosen,
            noise=noise,
            checkpoint=checkpoint,
            camera=view,
            ground=floor,
            backdrop=backdrop,
        )
    picture.save(output, exposure)
    what = f"{options.title_of(material, replaced)} {options.under(lights)}"
    echo(visible(f"{output}: {what}, {size} x {size}, {picture.samples} samples per pixel, {options.since(start)}"))


def _camera(eye: str | None, look_at: str | None, angle: float | None) -> Camera | None:
    from ..scenes.camera import Camera

    if eye is None:
        for name, value in (("--look-at", look_at), ("--angle", angle)):
            if value is not None:
                raise ParameterError(f"{name} {value}: of no camera; expected its place too, --camera 1.5,-3,1.6")
        return None
    across = 35.0 if angle is None else angle
    target = options.place(look_at or "0,0,0", "--look-at")
    return Camera(options.place(eye, "--camera"), target, field_of_view=math.radians(across))
