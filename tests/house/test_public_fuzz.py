"""Everything public, called with arguments of any kind: only `gonio.Error` comes out, and every call ends.

The campaign of 1e5 calls: benchmarks/public_fuzz.py.
"""

from __future__ import annotations

import inspect
from random import Random

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from public_calls import INTEGRALS, Call, Target, call_of, outcome, targets

import gonio as gn

QUICK = [target for target in targets() if target.name not in INTEGRALS]
"""Targets that take milliseconds."""

bounded = settings(
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow, HealthCheck.data_too_large],
)
randoms = st.randoms(use_true_random=False)


def holds(target: Target, random: Random, folder) -> None:
    call = call_of(target, random, folder)
    assert outcome(call) in ("", "refused"), call.text


@settings(bounded, max_examples=400)
@given(target=st.sampled_from(QUICK), random=randoms)
def test_misuse_is_refused_in_our_words(target, random, tmp_path, monkeypatch, uncompiled):
    monkeypatch.chdir(tmp_path)  # files with names of any kind
    holds(target, random, tmp_path)


@pytest.mark.full
@settings(bounded, max_examples=10_000)
@given(target=st.sampled_from(targets()), random=randoms)
def test_misuse_of_everything_is_refused_in_our_words(target, random, tmp_path, monkeypatch, uncompiled):
    monkeypatch.chdir(tmp_path)
    holds(target, random, tmp_path)


def test_everything_public_is_called():
    names = {target.name for target in targets()}
    functions = {name for name in gn.__all__ if inspect.isfunction(getattr(gn, name))}
    classes = {
        name for name in gn.__all__ if inspect.isclass(getattr(gn, name)) and not issubclass(getattr(gn, name), tuple)
    }
    assert functions | classes - {"Error"} <= names
    assert {"Calls.f", "Calls.sample", "Parametrised.replace", "Gridded.with_brdf", "Image.save"} <= names
    assert {"roughness.alpha_from_ward", "radiometry.brdf", "repair.symmetrise", "models", "formats"} <= names
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
