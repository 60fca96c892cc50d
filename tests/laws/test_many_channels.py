"""Materials of many channels: a law holds so many values at a time, and sees a fault in any of the channels."""

from __future__ import annotations

import tracemalloc
from typing import Any

import numpy as np
import pytest
from libraries import thinned

import gonio as gn
from gonio.formula.fields import param
from gonio.laws import LAWS, _probes

MANY = 128


@pytest.fixture
def few_values(monkeypatch):
    """As if memory were a hundredth."""
    monkeypatch.setattr(_probes, "VALUES", _probes.VALUES >> 8)
    monkeypatch.setattr(_probes, "AT_ONCE", _probes.AT_ONCE >> 2)


QUICK = {"positivity", "reciprocity", "isotropy", "derivatives"}


@pytest.mark.parametrize("name", thinned(LAWS, QUICK))
def test_memory_does_not_follow_channels(name, few_values):
    """All pairs of so many channels would take 134 MB at once, all samples 67 MB."""
    m = gn.Microfacet(gn.GGX(0.4), np.linspace(0.1, 0.9, MANY))
    gn.check(gn.Microfacet(gn.GGX(0.4), 0.5), laws=[name])  # what is kept for all materials
    tracemalloc.start()
    gn.check(m, laws=[name])
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 40e6


class _OneChannel(gn.Reflectance):
    """f = a/pi, but that of `a` below 0 or above 1 is what it is."""

    a = param(0.5, -10.0, 10.0, "albedo")

    def formula(self, wi: gn.authoring.Direction, wo: gn.authoring.Direction) -> Any:
        return self.a / np.pi + 0.0 * wi.z


FAULTS = [("positivity", -1e-3), ("energy", 1.1), ("furnace", 1.1), ("cavity", 1.1)]


@pytest.mark.parametrize(("name", "a"), thinned(FAULTS, FAULTS[:2]))
def test_a_fault_in_one_of_many_channels_is_found(name, a, few_values):
    albedos = np.full(MANY, 0.5)
    albedos[77] = a
    assert gn.check(_OneChannel(albedos), laws=[name]).verdicts[name] == "FAIL"
    assert gn.check(_OneChannel(np.full(MANY, 0.5)), laws=[name]).passed


def test_directions_are_fewer_only_beside_many_channels():
    for channels, count in ((None, 1 << 17), (64, 1 << 17), (65, 1 << 16), (401, 1 << 14), (4096, 1 << 11)):
        m = gn.Lambertian(0.5 if channels is None else np.full(channels, 0.5))
        assert _probes.some(m, _probes.PAIRS) == count
        assert sum(len(s.pdf) for s in _probes.samples(m, np.array([0.0, 0.0, 1.0]), 4096)) == 4096
