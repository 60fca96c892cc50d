"""What test_promise.py runs in a copy of gonio: python promised.py WORK

Brings the copy's manual up to date, looks for the things that CONTRIBUTING.md adds wherever they should be known, and
prints, as JSON, place -> whether it is there, or what it fails with.
"""

import doctest
import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import make  # docs/make.py of the copy
import materials
import numpy as np
from click.testing import CliRunner

import gonio as gn
from gonio.catalogue.expressions import read
from gonio.cli.commands import cli
from gonio.facts.public import form
from gonio.formats import formats
from gonio.formula.json_form import from_json
from gonio.laws import LAWS, table
from gonio.laws._overview import models as models_of_overview

WORK = Path(sys.argv[1])
WI, WO = gn.direction(0.7, 0.0), gn.direction(np.array([0.4, 1.0]), 2.5)


def page(name: str) -> str:
    path = make.DOCS / name
    return path.read_text(encoding="utf-8") if path.exists() else ""


def gonio(*words: str) -> str:
    """What a command prints; "" where it fails."""
    result = CliRunner().invoke(cli, list(words))
    return result.output if result.exit_code == 0 else ""


def refused(call: Callable[[], object]) -> str:
    """The error of a call."""
    try:
        call()
    except gn.Error as error:
        return str(error)
    raise AssertionError("expected an error")


def example(name: str) -> doctest.DocTest:
    """The example of a public function."""
    return doctest.DocTestParser().get_doctest(getattr(gn, name).__doc__, {"gn": gn}, name, None, 0)


def works(text: str, laws: tuple[str, ...]) -> Iterator[tuple[str, Callable[[], bool]]]:
    """What holds of a material that an expression makes."""
    file = str(WORK / "material.json")

    def sampled() -> bool:
        m = gn.expression(text)
        s = m.sample(WO, np.full((2, 2), 0.3))
        return bool(np.isclose(m.pdf(s.wi, WO), s.pdf).all() and (m.f(WI, WO) > 0.0).all())

    def saved() -> bool:
        gn.save(gn.expression(text), file)
        return gn.load(file) == gn.expression(text) and "type" in gn.expression(text).to_json()

    yield "expression", lambda: gn.expression(repr(gn.expression(text))) == gn.expression(text)
    yield "f, pdf, sample", sampled
    yield "JSON", saved
    yield "albedo", lambda: 0.0 < gn.albedo(gn.expression(text), WI) < 1.0
    yield "check", lambda: gn.check(gn.expression(text), laws=laws).passed
    yield "gonio info", lambda: gonio("info", text) != ""
    yield "gonio cite", lambda: "gonio" in gonio("cite", text)


def listed(name: str, suite: list[type]) -> Iterator[tuple[str, Callable[[], bool]]]:
    """Where a class with a page is named."""
    yield "gn.", lambda: name in gn.__all__ and name in dir(gn) and getattr(gn, name).__name__ == name
    yield "gn.cite", lambda: name in gn.cite(name)
    yield "unknown names", lambda: name in refused(lambda: gn.expression("Nothing()"))
    yield "the suite's list", lambda: name in [kind.__name__ for kind in suite]
    yield (
        "no reference yet",
        lambda: name in {k.__name__ for k in suite} - {r.model.__name__ for r in materials.REFERENCE},
    )
    yield "its page", lambda: page(f"models/{name}.md").startswith(f"# {name}\n")
    yield "the index", lambda: f"[`{name}`]({name}.md)" in page("models/README.md")


def model() -> Iterator[tuple[str, Callable[[], bool]]]:
    yield from listed("HenyeyGreenstein", materials.MODELS)
    yield from works("HenyeyGreenstein(0.3, g=0.5)", tuple(LAWS))
    yield "gonio check --all", lambda: "HenyeyGreenstein" in models_of_overview()
    yield "verdicts", lambda: "| [`HenyeyGreenstein`](HenyeyGreenstein.md) | pass |" in page("models/laws.md")
    yield "a parameter's meaning", lambda: "single-scattering" in gonio("info", "HenyeyGreenstein(0.3)")


def distribution() -> Iterator[tuple[str, Callable[[], bool]]]:
    yield from listed("UniformFacets", materials.DISTRIBUTIONS)
    yield from works("Microfacet(UniformFacets())", ("energy", "pdf", "sampling"))


def fresnel() -> Iterator[tuple[str, Callable[[], bool]]]:
    yield from listed("GeneralizedSchlick", materials.FRESNELS)
    yield from works("Microfacet(GGX(0.3), GeneralizedSchlick(0.1, n=3))", ("reciprocity", "derivatives"))


def masking() -> Iterator[tuple[str, Callable[[], bool]]]:
    yield from works('Microfacet(GGX(0.5), 1.0, "implicit")', ("reciprocity", "energy"))
    yield "a wrong word", lambda: "'implicit'" in refused(lambda: gn.Microfacet(masking="nothing"))
    yield "gonio info of others", lambda: "implicit" in gonio("info", "Microfacet()")
    yield "the page of Microfacet", lambda: "`implicit`" in page("models/Microfacet.md")
    yield (
        "the suite's draws",
        lambda: "implicit" in {drawn["masking"] for drawn in materials.structures(gn.Microfacet)},
    )


def light() -> Iterator[tuple[str, Callable[[], bool]]]:
    text = "ReflectorLight([0, -3, 0], [0, 1, 0], intensity=9)"
    picture = str(WORK / "lit.png")
    render = ("render", "Lambertian(0.5)", "-o", picture, "--size", "4", "--samples", "1", "-l")
    yield "gn.", lambda: "ReflectorLight" in gn.__all__
    yield "expression", lambda: read(text) == read(repr(read(text)))
    yield "JSON", lambda: from_json(read(text).to_json()) == read(text)
    yield (
        "radiance",
        lambda: bool((gn.reflected_radiance(gn.Lambertian(0.5), gn.ReflectorLight((0, 0, 2)), WO) > 0).all()),
    )
    yield "gonio render -l", lambda: picture in gonio(*render, text)


def law() -> Iterator[tuple[str, Callable[[], bool]]]:
    yield "its place", lambda: list(LAWS)[:5] == ["positivity", "reciprocity", "isotropy", "pole", "energy"]
    yield "gn.check", lambda: gn.check(gn.Lambertian(0.5), laws=["pole"]).passed
    yield "gonio check", lambda: "pass  pole" in gonio("check", "Lambertian(0.5)")
    yield "gonio check --help", lambda: "pole along the normal f" in " ".join(gonio("check", "--help").split())
    yield "a wrong name", lambda: "pole" in refused(lambda: gn.check(gn.Lambertian(0.5), laws=["nothing"]))
    yield "gonio check --all", lambda: "pole" in table({})[0]
    yield "its page", lambda: "\n| pole | largest change of f" in page("check.md")
    yield "verdicts", lambda: " | pole | " in page("models/laws.md").split("|---")[0]


def shape() -> Iterator[tuple[str, Callable[[], bool]]]:
    picture = str(WORK / "shape.png")
    render = ("render", "Lambertian(0.5)", "-o", picture, "--size", "4", "--samples", "1", "--shape", "spindle")
    lit = {"shape": "spindle", "size": 8, "samples": 1}
    yield "gn.render", lambda: gn.render(gn.Lambertian(0.5), gn.ConstantLight(1.0), **lit).pixels.max() > 0.4
    yield "gonio render", lambda: picture in gonio(*render)
    yield "gonio render --help", lambda: "spindle" in gonio("render", "--help")
    wrong = {"shape": "nothing"}
    yield (
        "a wrong word",
        lambda: "'spindle'" in refused(lambda: gn.render(gn.Lambertian(0.5), gn.ConstantLight(1.0), **wrong)),
    )


def format() -> Iterator[tuple[str, Callable[[], bool]]]:
    file, other, again = WORK / "white.polar", WORK / "white.csv", WORK / "again.polar"
    file.write_text("POLAR TABLE\nin 0 85\nout 0 40 90\nturn 0 180\n" + "0.1 0.1 0.1\n" * 4)
    yield "gn.load", lambda: gn.load(file).is_mirrored
    yield "gn.save", lambda: gn.save(gn.load(file), again) is None and gn.load(again) == gn.load(file)
    yield "nobody else's", lambda: [m.NAME for m in formats() if m.matches(file.read_bytes(), 32)] == ["polar table"]
    yield "f, albedo", lambda: bool(np.allclose(gn.albedo(gn.load(file), WI), 0.1 * np.pi, atol=1e-3))
    yield "expression", lambda: gn.expression(f'0.5 * load("{file.as_posix()}")', files=True).f(WI, WO).shape == (2,)
    yield "check", lambda: gn.check(gn.load(file), laws=["energy"]).passed
    yield "gonio info", lambda: "polar table" in gonio("info", str(file))
    yield "gonio formats", lambda: "polar table" in gonio("formats") and "polar table" in gonio("formats", "--json")
    yield "gonio convert", lambda: str(other) in gonio("convert", str(file), str(other))
    yield "an unknown file", lambda: "polar table (.polar)" in refused(lambda: gn.load(__file__))
    yield "its row", lambda: "\n| polar table | .polar | yes | yes |" in page("formats.md")


def function() -> Iterator[tuple[str, Callable[[], bool]]]:
    typed = ("gloss", "Lambertian(0.5)", "--theta-i", "20", "--share", "50")
    yield "gn.", lambda: "gloss" in gn.__all__ and "gloss" in dir(gn)
    yield "its example", lambda: doctest.DocTestRunner().run(example("gloss")) == (0, 1)
    yield "a wrong value", lambda: "in degrees?" in refused(lambda: gn.gloss(gn.Lambertian(0.5), 45.0))
    yield "gonio gloss", lambda: np.isclose(float(gonio(*typed)), 0.25 / np.pi)
    yield "gonio gloss --json", lambda: np.isclose(json.loads(gonio(*typed, "--json")), 0.25 / np.pi)
    yield "gonio gloss --help", lambda: "polar angle of the light [degrees]" in gonio("gloss", "--help").lower()
    yield "its form", lambda: [*form("gloss").fields] == ["theta_i", "share"]
    yield "the stub", lambda: "import gloss as gloss" in (make.DOCS.parent / "src/gonio/__init__.pyi").read_text()


def found(look: Callable[[], bool]) -> bool | str:
    """Whether a thing is there; what went wrong, if that is another thing than that it is not known."""
    try:
        return bool(look())
    except (gn.Error, AttributeError, KeyError, StopIteration, ValueError) as error:
        return f"{type(error).__name__}: {error}"


if __name__ == "__main__":
    make.main(["--text"])
    kinds = (model, distribution, fresnel, masking, light, law, shape, format, function)
    print(json.dumps({f"{kind.__name__}: {what}": found(look) for kind in kinds for what, look in kind()}))
