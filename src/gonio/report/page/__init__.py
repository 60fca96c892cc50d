"""A report: one page that says what a material is, shows it, and holds it to the laws, for people without gonio."""

from __future__ import annotations

import datetime
import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from ...base.light import Light
from ...base.reflectance import Reflectance
from ...declared.arguments import Declared, checked
from ...declared.version import __version__
from ...errors import ParameterError
from ...evaluate.tracing import at_most
from ...facts import finite
from ...facts.subject import Subject
from ...figures._drawing import materials_of
from ...files import replacing, target
from . import browser, lobes, pictures
from .contents import contents_of, summarized
from .guarded import Guarded
from .html import page, script_data

SUFFIXES = (".html", ".htm", ".pdf", ".json")
"""What a report is written as."""

NAME = 60
"""The longest name in a title."""

NUMBERS = 0.7
"""Share of the time that the numbers take; pictures take the rest."""

Progress = Callable[[int, int], None]


@checked
def write_report(
    materials: Mapping[str, Reflectance] | Sequence[Reflectance] | Reflectance,
    path: str | os.PathLike[str],
    lights: Mapping[str, Light] | None = None,
    title: Annotated[str, Declared("title of the page", usual="the names of the materials")] | None = None,
    fits: Annotated[bool, Declared("models are fitted, which takes seconds, and the nearest materials found")] = True,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Write a report of a material, or of several side by side, as one file that needs neither gonio nor a network.

    It says what a material is (formula, parameters, source), where its numbers come from, whether it obeys the laws;
    shows slices, a lobe that can be turned, lit spheres; and has albedos with their uncertainty, fits with their
    residuals, colours, and where there are any spectra, transmission and polarization. See docs/report.md.

    materials  one, a list, or name -> material
    path       .html, a page for the browser; .pdf, printed by Chromium, Chrome or Edge; .json, the numbers alone
    lights     of the spheres: caption -> light; by default a point, a studio and the sky

    Units      angles in degrees, f [1/sr]. In .json NaN is null.
    Error      albedos to 1e-4 (formulas); laws as `gn.check`, fits as `gn.fit`.
    Errors     ParameterError for other names of files, for maps, and for no material; DependencyError where no browser
               prints. A report that cannot be written leaves what was there.

    Example
    >>> gn.write_report(gn.Lambertian(0.5), "matt.json", fits=False)
    >>> import json
    >>> with open("matt.json") as file:
    ...     report = json.load(file)
    ...
    >>> print(round(report["materials"][0]["albedo"]["table"]["values"][0][0], 6))
    0.5
    """
    kind = check_target(path)
    shown = materials_of(materials)
    subjects = [Subject.of(name, m) for name, m in shown.items()]
    captioned = None if lights is None else [(caption, [light]) for caption, light in lights.items()]
    if kind == ".json":
        write_json(path, data(subjects, title or "", fits, progress))
        return
    text = made(subjects, captioned, title or "", fits, progress)
    write_page(path, text)


def check_target(path: str | os.PathLike[str]) -> str:
    """The suffix of a report. Raises the errors of writing one under this name, before anything is computed."""
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise ParameterError(f"{path}: expected a name that ends in {', '.join(SUFFIXES)}")
    if suffix == ".pdf":
        browser.found()
    target(path)
    return suffix


def data(
    subjects: Sequence[Subject], title: str = "", fits: bool = True, progress: Progress | None = None, upto: float = 1.0
) -> dict[str, Any]:
    """What the report says, as JSON data with NaN; `upto`: the share of the progress that this takes."""
    several = []
    for k, subject in enumerate(subjects):
        with at_most(pictures.ELEMENTS):
            several.append(contents_of(subject, fits, _part(progress, k, len(subjects), 0.0, upto)))
    return {
        "title": title or ", ".join(_short(subject.name) for subject in subjects),
        "gonio": __version__,
        "date": datetime.datetime.now().astimezone().isoformat(timespec="seconds"),
        "summary": summarized(several),
        "materials": several,
    }


def _short(name: str) -> str:
    return name if len(name) <= NAME else f"{name[: NAME - 1]}…"


def made(
    subjects: Sequence[Subject],
    lights: Sequence[tuple[str, Iterable[Light]]] | None = None,
    title: str = "",
    fits: bool = True,
    progress: Progress | None = None,
) -> str:
    """The report as a page."""
    report = data(subjects, title, fits, progress, NUMBERS)
    shown = []
    for k, (subject, one) in enumerate(zip(subjects, report["materials"], strict=True)):
        tell = _part(progress, k, len(subjects), NUMBERS, 1.0)
        m = subject.m
        with at_most(pictures.ELEMENTS):
            spheres = pictures.spheres(m, lights or pictures.usual_lights(m), tell)
            of_lobes = Guarded()
            of_lobes.add("lobes", partial(lobes.lobes, m))
            given = of_lobes.parts["lobes"]
            stills = pictures.stills(given) if given else []
        one["left_out"].update(of_lobes.left_out)
        shown.append({"spheres": spheres, "lobes": script_data(finite(given)) if given else "", "stills": stills})
        tell(1.0)
    return page(report, shown)


def write_page(path: str | os.PathLike[str], text: str) -> None:
    """Write a page, as it is or printed."""
    printer = browser.found() if Path(path).suffix.lower() == ".pdf" else None
    with replacing(path) as temporary:
        if printer is None:
            Path(temporary).write_text(text, encoding="utf-8")
        else:
            browser.print_page(text, Path(temporary), printer)


def write_json(path: str | os.PathLike[str], report: dict[str, Any]) -> None:
    """Write what a report says; NaN and infinity are null."""
    with replacing(path) as temporary:
        Path(temporary).write_text(json.dumps(finite(report), indent=1, allow_nan=False), encoding="utf-8")


def _part(progress: Progress | None, k: int, count: int, start: float, stop: float) -> Callable[[float], None]:
    """What is told the share that is done of the k-th of several materials, between two shares of the whole."""
    if progress is None:
        return lambda share: None
    return lambda share: progress(round(1000 * (start + (stop - start) * (k + share) / count)), 1000)
