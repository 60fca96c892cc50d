"""Everything public, called with arguments of any kind: only `gonio.Error` comes out, and every call ends.

The campaign of 1e5 calls: benchmarks/public_fuzz.py.
"""

from __future__ import annotations

import inspect

import face
import pytest
from public_calls import INTEGRALS, Call, Target, calls_of, outcome, targets

import gonio as gn


def hold(chosen: list[Target], count: int, share: float, folder) -> None:
    for target in chosen:
        for call in calls_of(target, count, share, folder):
            assert outcome(call) in ("", "refused"), call.text


def test_misuse_is_refused_in_our_words(tmp_path, monkeypatch, uncompiled):
    monkeypatch.chdir(tmp_path)  # files with names of any kind
    hold([target for target in targets() if target.name not in INTEGRALS], 1, 0.01, tmp_path)  # take milliseconds


@pytest.mark.full
def test_misuse_of_everything_is_refused_in_our_words(tmp_path, monkeypatch, uncompiled):
    monkeypatch.chdir(tmp_path)
    hold(targets(), 12, 0.1, tmp_path)


class Aardvark:
    """A public class that is none yet; what it makes is a material like any other."""

    def __new__(cls) -> gn.Lambertian:
        return gn.Lambertian(0.3)


def aardvark(m: gn.Reflectance, wi: object = None) -> None:
    """A public function that is none yet."""


def test_what_else_is_public_changes_no_call(tmp_path, monkeypatch):
    def texts() -> dict[str, list[str]]:
        return {t.name: [call.text for call in calls_of(t, 2, 0.02, tmp_path)] for t in targets()}

    before = texts()
    assert sum(map(len, before.values())) > 2 * len(before)
    for name, thing in (("Aardvark", Aardvark), ("aardvark", aardvark), ("zzz", aardvark)):
        monkeypatch.setattr(gn, name, thing, raising=False)
    monkeypatch.setattr(gn, "__all__", ["Aardvark", "aardvark", *gn.__all__, "zzz"])
    after = texts()
    assert after.keys() - before.keys() == {"Aardvark", "aardvark", "zzz"}
    with_it = {name: [text for text in after[name] if "<Aardvark>" in text] for name in before}
    assert {name: [text for text in after[name] if text not in with_it[name]] for name in before} == before
    assert any(with_it.values())


def test_everything_public_is_called():
    names = {target.name for target in targets()}
    classes = {n for n, kind in face.classes().items() if not issubclass(kind, tuple) and n[:8] != "results."}
    assert {*face.functions()} | classes - {"Error"} <= names
    assert {"Reflectance.f", "Reflectance.sample", "Parametrised.replace", "Gridded.with_brdf", "Image.save"} <= names
    assert {"radiometry.roughness.alpha_from_ward", "repair.symmetrize", "models", "formats"} <= names
    assert names >= INTEGRALS


def raises(error: Exception) -> Target:
    def call(x: object) -> None:
        raise error

    return Target("call", call, None, tuple(inspect.signature(call).parameters.values()))


@pytest.mark.parametrize("error", [ValueError("x"), TypeError("'x' and 'y'"), AttributeError("x"), gn.Error("")])
def test_the_fuzz_finds_raw_exceptions(error):
    call = Call(raises(error), None, [1], {}, "call(1)")
    assert outcome(call) not in ("", "refused")
    assert outcome(call._replace(target=raises(gn.Error("words")))) == "refused"
    assert outcome(call._replace(positional=[])) == "refused"  # by Python
