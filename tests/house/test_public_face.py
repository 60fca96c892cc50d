"""What people and their editors see of gonio: signatures, help, the stub, lists of contents, classes of their own."""

import importlib
import inspect
import os
import pkgutil
import pydoc
import re
import subprocess
import sys
import typing
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from runpy import run_path
from textwrap import dedent

import face
import numpy as np
import pytest
from materials import DISTRIBUTIONS, FRESNELS, MODELS, public
from places import ROOT
from sweeps import every

import gonio as gn
from gonio import authoring
from gonio.base.light import Light
from gonio.base.reflectance import Reflectance
from gonio.base.sums import Scaled, Sum
from gonio.declared import discover
from gonio.declared.contents import WIDTH
from gonio.declared.namespace import namespaces
from gonio.errors import AccessError, NotFoundError, ParameterError
from gonio.formula.classes import aliases, takes_fields
from gonio.formula.fields import CLASSES, Option, Param, param
from gonio.formula.json_form import from_json, names
from gonio.formula.maskings import MASKINGS
from gonio.formula.parametrised import Parametrised
from gonio.formula.value import Value

LIGHTS = public(Light, discover.modules("gonio.lights"))
KINDS = [k for k in (*MODELS, *DISTRIBUTIONS, *FRESNELS, *LIGHTS, Scaled) if takes_fields(k)]
named = every(kind=KINDS)


# Bases.


def test_private_bases_are_abstract():
    """Whatever a file of these folders derives from, and does not show, refuses as the public bases do."""
    rooms = [importlib.import_module(f"gonio.{room}") for room in ("models", "distributions", "lights")]
    files = {f"{room.__name__}.{file.name}" for room in rooms for file in pkgutil.iter_modules(room.__path__)}
    classes = [
        value for name in files for value in vars(importlib.import_module(name)).values() if inspect.isclass(value)
    ]
    bases = {base for kind in classes if kind.__module__ in files for base in kind.__mro__[1:]}
    private = {
        k for k in bases if k.__module__ in files and any(n[0] == "_" for n in (k.__name__, *k.__module__.split(".")))
    }
    assert private
    for kind in private:
        with pytest.raises(ParameterError, match=rf"{kind.__name__}\(\): an abstract base, without"):
            kind()


# Signatures and help.


@named
def test_signatures_take_what_constructors_take(kind):
    signature = inspect.signature(kind)
    declared = [name for name in kind._declares if name not in kind.fields]
    assert list(signature.parameters) == [*kind.fields, *aliases(kind), *declared]
    given = {n: f.default for n, f in kind.fields.items() if f.default is not None}
    for name in given:
        arguments = signature.bind_partial(**{name: given[name]})
        if (
            all(p.default is not p.empty or p.name == name for p in signature.parameters.values())
            and kind is not Scaled
        ):
            assert kind(*arguments.args, **arguments.kwargs) == kind()
    with pytest.raises(TypeError):
        signature.bind(no_such_parameter=1.0)
    assert {p.annotation for p in signature.parameters.values()} <= {"float | Array", "Array"} | {
        *kind._declares.values(),
        *(f.accepts for f in kind.fields.values()),
    }


def test_signature_of_ggx():
    signature = inspect.signature(gn.GGX)
    assert str(signature) == (
        "(alpha_x: 'float | Array' = 0.2, alpha_y: 'float | Array' = 'alpha_x', *, alpha: 'float | Array' = Ellipsis)"
    )
    assert gn.GGX(*signature.bind(0.3, "alpha_x").args) == gn.GGX(alpha=0.3)
    assert inspect.getdoc(gn.GGX).endswith("""

Parameters
    alpha_x = 0.2       slope scale along x; 0.001 to 1
    alpha_y = alpha_x   slope scale along y; 0.001 to 1
    alpha               sets alpha_x and alpha_y""")


def test_signatures_of_parts_options_and_what_must_be_given():
    microfacet, light = inspect.signature(gn.Microfacet), inspect.signature(gn.EnvironmentLight)
    assert microfacet.parameters["distribution"].annotation == "Distribution"
    assert microfacet.parameters["fresnel"].annotation == "Fresnel | float | Array"
    assert microfacet.parameters["masking"].annotation == f"Literal[{', '.join(map(repr, MASKINGS))}]"
    assert light.parameters["image"].default is inspect.Parameter.empty
    with pytest.raises(TypeError, match="image"):
        light.bind()


def test_constructors_of_their_own_keep_their_signatures():
    assert list(inspect.signature(Sum).parameters) == ["terms", "wavelengths"]
    assert list(inspect.signature(gn.Gridded).parameters)[:3] == ["parameterization", "axes", "values"]
    assert list(inspect.signature(gn.TabulatedFacets).parameters) == ["theta", "values"]


@named
def test_help_shows_every_parameter_with_bounds_unit_and_meaning(kind):
    text = pydoc.render_doc(kind, renderer=pydoc.plaintext)
    parameters = inspect.getdoc(kind).rpartition("\n\nParameters\n")[2]
    assert parameters.splitlines()[0].strip() in text
    for (name, field), line in zip(kind.fields.items(), parameters.splitlines(), strict=False):
        assert re.match(rf"    {name}\b.* {re.escape(field.doc)}", line)
        if isinstance(field, Param):
            assert f"{field.low:g}" in line
            assert field.unit == "1" or f"[{field.unit}]" in line
        if isinstance(field, Option):
            assert all(repr(choice) in line for choice in field.choices)
    for alias in aliases(kind):
        assert f"    {alias} " in parameters


def test_written_docstrings_stay_as_they_are():
    assert "Parameters" not in discover.docstring(gn.GGX)
    assert inspect.getdoc(gn.GGX).startswith(discover.docstring(gn.GGX) + "\n\nParameters\n")
    assert inspect.getdoc(gn.Reflectance) == discover.docstring(gn.Reflectance)
    assert gn.GGX().__doc__ == gn.GGX.__doc__


def test_help_without_docstrings():
    """python -OO leaves them out; the source has them."""
    code = "import inspect, gonio as gn; print(inspect.getdoc(gn.GGX))"
    shown = subprocess.run([sys.executable, "-OO", "-c", code], capture_output=True, text=True, check=True).stdout
    assert "Trowbridge" in shown and "slope scale along x; 0.001 to 1" in shown


# The stub.


def test_the_stubs_are_up_to_date():
    pages = run_path(str(ROOT / "docs" / "stubs.py"))["pages"]()
    assert {*pages} == {*(ROOT / "src").rglob("*.pyi")}
    for path, text in pages.items():
        assert path.read_text(encoding="utf-8") == text, f"{path.name}: run python3 dev.py docs"


def test_the_stub_has_every_public_name():
    stub = (ROOT / "src" / "gonio" / "__init__.pyi").read_text(encoding="utf-8")
    for name in [*gn.__all__, "__version__"]:
        assert re.search(rf"^(class|def) {name}\b|^from \S+ import \w+ as {name}$", stub, re.MULTILINE), name


@pytest.mark.texts
def test_type_checkers_accept_and_refuse(tmp_path):
    """Strict mypy accepts passes.py, and refuses the lines of fails.py, and no other, for the reasons given there."""
    pytest.importorskip("mypy")
    folder = Path(__file__).parent / "typed"
    files = [folder / "passes.py", folder / "fails.py"]
    options = ["--config-file=", "--strict", "--follow-imports=silent", f"--cache-dir={tmp_path}"]
    environment = {**os.environ, "MYPYPATH": str(Path(gn.__file__).parents[1])}
    command = [sys.executable, "-m", "mypy", *options, *map(str, files)]  # in this process it would leave 0.4 GB
    shown = subprocess.run(command, env=environment, capture_output=True, text=True).stdout
    errors = re.findall(r"(\w+)\.py:(\d+): error: .*\[(.*)\]", shown)
    lines = enumerate(files[1].read_text(encoding="utf-8").splitlines(), 1)
    wanted = [("fails", str(number), line.split("# error: ")[1]) for number, line in lines if "# error: " in line]
    assert errors == wanted, shown


# Names.


def test_the_face_fits_one_screen():
    """What stands in expressions and the verbs of every day are flat; the others are in namespaces."""
    assert len(gn.__all__) <= 170
    twice = [name for name, count in Counter(map(str.lower, gn.__all__)).items() if count > 1]
    assert twice == ["reflectance"], "names that differ by case alone: Nicodemus' quantity, and what has it, do"


def test_what_functions_return_is_public():
    """... or of a public class, or prints as a table of contents."""
    public, unnamed = {*face.classes().values()}, set()
    for function in face.functions().values():
        written, returned = inspect.unwrap(function), None
        with suppress(NameError):  # of a library that only a type checker imports
            returned = eval(str(written.__annotations__.get("return")), written.__globals__)
        for kind in (returned, *typing.get_args(returned)):
            if inspect.isclass(kind) and kind.__module__.startswith("gonio") and not issubclass(kind, (Mapping, list)):
                unnamed |= set() if public & {*kind.__mro__} else {kind}
    assert not unnamed, "name these in gonio/results.py"


def test_no_public_name_is_a_file_of_its_folder():
    """`import gonio.scenes.x` makes x the file, and hides the name."""
    for place, module in namespaces():
        if "__getattr__" in vars(module) and hasattr(module, "__path__"):
            files = {file.name for file in pkgutil.iter_modules(module.__path__)}
            assert not files & {*module.__all__}, place


def test_a_name_that_is_elsewhere_is_told_with_its_place():
    for module, name, told in (
        (gn, "fit_map", "it is gn.fitting.fit_map"),
        (gn.fitting, "plan", "it is gn.planning.plan"),
        (gn.scenes, "albedo", "it is gn.albedo"),
        (gn.fitting, "fit_mup", "did you mean 'fit_map'"),
        (gn, "Light", r"it is gonio\.authoring\.Light"),
        (gn, "turntable", r"did you mean gn\.scenes\.write_turntable"),
        (gn, "read_image", r"did you mean gn\.scenes\.load_image"),
    ):
        with pytest.raises(AttributeError, match=f"no attribute {name!r}; {told}"):
            getattr(module, name)
    with pytest.raises(AccessError, match=r"write gn\.tables\.tabulate\(m\)"):
        _ = gn.Lambertian().tabulate


# Lists of what there is.


def test_contents_by_name():
    assert list(gn.models().values()) == sorted([*MODELS, gn.Stack], key=lambda k: k.__name__.lower())
    assert set(gn.distributions().values()) == set(DISTRIBUTIONS)
    assert set(gn.fresnel_terms().values()) == set(FRESNELS)
    assert set(gn.lights().values()) == set(LIGHTS)
    assert gn.formats()["MERL"].SUFFIXES == (".binary",)
    assert "Sum" not in gn.models() and "Scaled" not in gn.models()
    assert "Lambertain" not in gn.models() and gn.models().get("Lambertain") is None
    with pytest.raises(NotFoundError, match="did you mean 'Lambertian'"):
        gn.models()["Lambertain"]
    with pytest.raises(TypeError):
        gn.models()["Lambertian"] = gn.GGX


@pytest.mark.parametrize("name", ["models", "lights", "distributions", "fresnel_terms", "formats", "materials"])
def test_contents_print_with_a_line_for_each(name):
    shown = getattr(gn, name)()
    lines = repr(shown).splitlines()
    assert len(lines) == len(shown)
    for thing, line in zip(shown, lines, strict=True):
        assert re.match(rf"{re.escape(getattr(thing, 'name', thing))}  +\S", line)
        assert len(line) <= WIDTH


def test_what_contents_say():
    lines = dict(line.split("  ", 1) for line in repr(gn.models()).splitlines())
    assert lines["Lambertian"].strip() == "Ideal diffuse reflection"
    assert re.search(r"^ALTA +rows .*\.alta.*\)$", repr(gn.formats()), re.MULTILINE)
    assert re.search(r"^MCD43A1 .*read only$", repr(gn.formats()), re.MULTILINE)


def test_folders_stay_modules():
    assert repr(gn.models) == "<module 'gonio.models'; gonio.models() lists what it holds>"
    code = "import gonio.models.abc as a, gonio.formats.merl as b, gonio as gn; from gonio import lights; "
    code += "print(a.ABC is gn.ABC, gn.formats()['MERL'] is b, len(lights()) > 3, gn.models.abc is a)"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert shown.split() == ["True"] * 4


# The door of model authors.


def test_authoring_holds_what_contents_import():
    """Each name is imported by some model, distribution, Fresnel term, light or format, or says how to write one."""
    used = Counter()
    for folder in ("models", "distributions", "lights", "formula/fresnel", "formats"):
        for path in (ROOT / "src" / "gonio" / folder).rglob("*.py"):
            used.update(re.findall(r"\w+", path.read_text(encoding="utf-8")))
    assert set(authoring.__all__) - set(used) <= {"typed", "Number", "Array", "half_vector", "cross"}
    for name in authoring.__all__:
        assert getattr(authoring, name) is not None


# What an object shows.

CALLED = {
    *("f", "f_angles", "pdf", "sample", "jacobian", "mueller", "delta_reflectance", "delta_mueller", "reradiation"),
    *("at", "replace", "under", "with_channels", "to_json", "is_isotropic"),
    *("parameters", "fields", "channels", "channel_names", "wavelengths"),
    *("has_delta", "polarizes", "fluoresces"),
}
"""What users call of a material, and read of it."""
CONTRACT = Path(str(inspect.getsourcefile(Reflectance)))


def public_names(thing):
    return {name for name in dir(thing) if not name.startswith("_")}


def test_a_material_shows_what_users_call_and_what_models_write():
    """Nothing of the machine: functions of all values are in `formula/tree.py`, its attributes have an underscore."""
    written = {name for name in vars(Reflectance) if not name.startswith("_")} - CALLED | {"validate"}
    shown = public_names(gn.Lambertian())
    assert shown == CALLED | written | {"rho"}
    assert len(shown) == 42


def test_one_file_says_the_contract_of_a_material():
    """From top to bottom: whatever a material shows beside its fields stands in it, but for what any value has."""
    lines = CONTRACT.read_text().splitlines()
    assert len(lines) <= 250
    assert Reflectance.__mro__[1:3] == (Parametrised, Value)
    assert CALLED - set(vars(Reflectance)) == {"replace", "parameters"}


def test_the_contract_gives_the_arguments_of_its_calls():
    calls = re.findall(r"^    (\w+) = \w+\.(\w+)  # (\(.*?\)): ", CONTRACT.read_text(), re.M)
    for name, function, written in calls:
        arguments = [*inspect.signature(getattr(Reflectance, name)).parameters.values()][1:]
        bare = [p.replace(annotation=p.empty) for p in arguments]
        assert (function, written) == (name, str(inspect.Signature(bare)))
    assert {"f", "pdf", "sample", "jacobian", "under"} < {name for name, *_ in calls}


def test_all_values_share_few_names():
    assert public_names(Parametrised) == {"at", "fields", "parameters", "replace", "to_json", "validate"}


# Classes of one's own.


def test_a_class_says_what_it_is_beside_its_base():
    with pytest.raises(ParameterError, match=r"write it beside the base: class _A\(Reflectance, oriented=True\)"):

        class _A(gn.Reflectance):
            oriented = True


@pytest.mark.parametrize(
    ("hook", "words"),
    [
        ({"sides": "Across"}, r"class _A: sides = 'Across'; expected front, across, both; did you mean 'across'\?"),
        ({"sides": "both"}, r"class _A: sides = 'both'; a material of both sides writes turned\(back\)"),
        ({"hints": 0.5}, r"class _A: hints = 0.5; expected hints = Hints\(seam=...\)"),
    ],
)
def test_hooks_that_nothing_knows_are_refused(hook, words):
    with pytest.raises(ParameterError, match=words):
        type("_A", (gn.Reflectance,), {"formula": lambda self, wi, wo: 0.3} | hook)


def test_a_class_of_two_parametrised_bases_has_the_fields_of_both():
    class _A(gn.Reflectance):
        a = param(0.1, 0.0, 1.0, "a")

    class _B(gn.Reflectance):
        b = param(0.2, 0.0, 1.0, "b")

    class _Both(_A, _B):
        c = param(0.3, 0.0, 1.0, "c")
        formula = gn.Lambertian.formula

    assert set(_Both.fields) == {"a", "b", "c"}
    assert {n: p.value for n, p in _Both(b=0.5).parameters.items()} == {"a": 0.1, "b": 0.5, "c": 0.3}


def test_a_second_class_of_one_name_is_refused():
    with pytest.raises(ParameterError, match=r"GGX is taken by gonio\.distributions\.ggx\.GGX.*another name"):
        type("GGX", (gn.Reflectance,), {"__module__": "__main__"})
    assert CLASSES["GGX"] is gn.GGX
    with pytest.raises(ParameterError, match=r"OfTwoModules is taken by one\.OfTwoModules"):
        for module in ("one", "other"):
            type("OfTwoModules", (gn.Reflectance,), {"__module__": module})


def test_a_cell_run_again_replaces_its_class():
    cell = {"__module__": "__main__", "rho": param(0.5, 0.0, 1.0, "albedo"), "formula": gn.Lambertian.formula}
    first, second = (type("Cell", (gn.Reflectance,), dict(cell)) for _ in range(2))
    assert CLASSES["Cell"] is second is not first
    assert isinstance(from_json(first(0.3).to_json()), second)
    assert gn.models()["Cell"] is second


@pytest.mark.parametrize("name", ["f", "pdf", "formula", "parameters", "replace"])
def test_a_parameter_that_hides_a_method_is_refused(name):
    """`f = param(...)` was taken, and m.f(wi, wo) then a number that is called."""
    with pytest.raises(ParameterError, match=f"Hiding: {name} is an attribute that the class inherits"):
        type("Hiding", (gn.Reflectance,), {"__module__": "__main__", name: param(0.5, 0.0, 1.0, "hides")})
    assert "Hiding" not in CLASSES


def test_names_with_an_underscore_stay_out_of_texts():
    type("_Hidden", (gn.Reflectance,), {"__module__": "__main__"})
    type("Hidden", (gn.Reflectance,), {"__module__": "tools._hidden"})
    assert not {"_Hidden", "Hidden"} & set(names())


@pytest.mark.parametrize(("module", "words"), [("__main__", "script or notebook"), ("paints.skin", "'paints.skin'")])
def test_json_of_a_class_that_is_missing_says_what_to_import(module, words):
    data = type("Missing", (gn.Reflectance,), {"__module__": module, "formula": gn.Lambertian.formula})().to_json()
    assert data == {"type": "Missing", "module": module}
    del CLASSES["Missing"]
    with pytest.raises(NotFoundError, match=f"'Missing'.*{words}.*load again"):
        from_json({"type": "Sum", "terms": [data]})


def test_json_of_gonios_own_classes_names_no_module():
    assert gn.Lambertian(0.5).to_json() == {"type": "Lambertian", "rho": 0.5}


SCRIPT = """
    import pickle, sys, multiprocessing
    import gonio as gn
    from gonio.authoring import Direction, Reflectance, Fresnel, param

    class Skin(Reflectance):
        "Skin: f = rho/pi."
        rho = param(0.5, 0.0, 1.0, "albedo")
        def formula(self, wi: Direction, wo: Direction):
            return self.rho / 3.14159

    class Half(Fresnel):
        def F(self, cos_theta):
            return 0.5 + 0.0 * cos_theta

    def of_another_process(m):
        return repr(m)

    if __name__ == "__main__":
        m = 0.5 * Skin(0.3) + gn.Microfacet(gn.GGX(0.2), Half())
        assert gn.expression(repr(m)) == m
        gn.save(m, sys.argv[1])
        assert gn.load(sys.argv[1]) == m
        assert pickle.loads(pickle.dumps(m)) == m
        assert gn.models()["Skin"] is Skin and gn.fresnel_terms()["Half"] is Half
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            assert pool.map(of_another_process, [m]) == [repr(m)]
        print("done")
"""


def test_classes_of_a_script_work_in_texts_json_pickle_and_other_processes(tmp_path):
    script, saved = tmp_path / "skin.py", tmp_path / "skin.json"
    script.write_text(dedent(SCRIPT))
    shown = subprocess.run([sys.executable, str(script), str(saved)], capture_output=True, text=True)
    assert shown.stdout == "done\n", shown.stderr
    with pytest.raises(gn.errors.FormatError, match="'Skin' was defined in a script or notebook"):
        gn.load(saved)


def test_classes_of_ones_own_are_pytrees_at_once():
    jax = pytest.importorskip("jax")
    import gonio.bridges.jax  # noqa: F401  (materials become pytrees)

    class Late(gn.Reflectance):
        rho = param(0.5, 0.0, 1.0, "albedo")

        def formula(self, wi, wo):
            return self.rho * wi.z

    class _Private(Late):
        pass

    for kind in (Late, _Private):
        wi = jax.numpy.array([0.0, 0.6, 0.8])
        slope = jax.grad(lambda m, wi=wi: m.f(wi, wi).sum())(kind(0.3))
        assert isinstance(slope, kind)
        np.testing.assert_allclose(slope.rho, 0.8, rtol=1e-6)
