"""Mueller matrices of files: KAIST's as Mitsuba reads them, NIST's in their axes; flagged."""

from __future__ import annotations

import numpy as np
import pytest
from places import real

import gonio as gn
from gonio.formats import kaist
from gonio.polarization import realizable, to_frames

GOLD = gn.Microfacet(gn.GGX(0.5), gn.Conductor(1.2, 6.0))


def pairs(n: int, low: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(5)
    theta, phi = np.arccos(rng.uniform(low, 1.0, (2, n))), rng.uniform(0.0, 2.0 * np.pi, (2, n))
    return gn.direction(theta[0], phi[0]), gn.direction(theta[1], phi[1])


def fields(*shape: int) -> dict[str, np.ndarray]:
    """A file of random matrices on few nodes."""
    M = np.random.default_rng(3).uniform(0.0, 1.0, (*shape[::-1], 5, 4, 4)).astype("f4")
    axes = zip(kaist.ENDS.items(), shape, strict=True)
    nodes = {name: (np.linspace(*ends, n) * np.pi).astype("f4")[None] for (name, ends), n in axes}
    return {**nodes, "wvls": np.array(kaist.WAVELENGTHS, "u2"), "M": M}


def test_a_kaist_file_gives_its_matrices_about_the_facet():
    stored = fields(5, 5, 9)
    m = kaist.KAIST(stored)
    wi, wo = gn.directions.from_half_difference(0.125 * np.pi, 0.0, 0.25 * np.pi, 0.25 * np.pi)
    facet = to_frames(m.mueller(wi, wo), wi, wo, "facet")
    np.testing.assert_allclose(facet, stored["M"][5, 2, 1], atol=2e-6)
    assert m.polarizes
    np.testing.assert_allclose(m.mueller(wi, wo)[..., 0, 0], m.f(wi, wo), rtol=1e-12)


@pytest.mark.parametrize("element", [(0, 1), (1, 0), (1, 2), (2, 2), (2, 3), (3, 0), (3, 3)])
@pytest.mark.slow_because("Mitsuba compiles each BSDF anew")
def test_mitsuba_reads_the_same_matrices_from_a_kaist_file(element, tmp_path):
    mi = pytest.importorskip("mitsuba")
    if "llvm_ad_spectral_polarized" not in mi.variants():
        pytest.skip("this Mitsuba has no llvm_ad_spectral_polarized")
    stored = fields(7, 7, 9)
    only = np.zeros_like(stored["M"])
    only[..., 0, 0], only[(..., *element)] = 1.0, stored["M"][(..., *element)]
    m = kaist.KAIST({**stored, "M": only})
    gn.save(m, tmp_path / "one.pbsdf", format="KAIST")
    wi, wo = pairs(400)
    mi.set_variant("llvm_ad_spectral_polarized")
    expected = of_mitsuba(mi, tmp_path / "one.pbsdf", wi, wo, 500.0)
    found = to_frames(m.mueller(wi, wo), wi, wo, "mitsuba")[:, 1]
    np.testing.assert_allclose(found, expected, atol=1e-4)


def of_mitsuba(mi, path, wi, wo, wavelength: float) -> np.ndarray:
    import drjit as dr

    bsdf = mi.load_dict({"type": "measured_polarized", "filename": str(path), "wavelength": wavelength})
    si = dr.zeros(mi.SurfaceInteraction3f, len(wi))
    si.wi = mi.Vector3f(wo.T)
    si.wavelengths = wavelength
    value = bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(wi.T))
    rows = [[np.array(value[i, j])[0] + np.zeros(len(wi)) for j in range(4)] for i in range(4)]
    return np.moveaxis(np.array(rows), -1, 0) / wi[:, 2, None, None]


def test_a_polarizing_material_is_written_with_its_matrices(tmp_path):
    gn.save(GOLD, tmp_path / "gold.pbsdf", resolution=(45, 23, 9))
    m = gn.load(tmp_path / "gold.pbsdf")
    wi, wo = pairs(300, 0.3)
    M, truth = m.mueller(wi, wo)[:, 0], GOLD.mueller(wi, wo)
    off = np.abs(M - truth).max(axis=(-1, -2)) / np.abs(truth).max()
    assert np.nanmax(off) < 0.02


def test_matrices_that_cannot_be_are_kept_and_flagged():
    stored = fields(5, 5, 9)
    m = kaist.KAIST(stored)
    verdict = gn.check(m, laws=["realizability"])["realizability"]
    assert verdict.verdict == "breaks"
    assert np.array_equal(m.matrices, stored["M"])


def test_nists_rows_are_given_back_in_the_axes_of_the_surface():
    m = gn.load(real("nist_ptfe/PTFE.data.532.csv"))
    wi, wo = (gn.direction(m.rows[:, k], m.rows[:, k + 1]) for k in (0, 2))
    expected = to_frames(m.matrices, wi, wo, "surface", given="xyxy")
    off = np.abs(m.mueller(wi, wo)[:, 0] - expected).max(axis=(-1, -2)) / expected[:, 0, 0]
    assert np.median(off) < 0.004 and off.max() < 0.06
    assert realizable(expected).all()
    assert "not realizable" not in m.about


def test_ptfe_scatters_horizontal_light_more_and_is_the_same_on_both_sides():
    """Q = I_s - I_p in the file, and its axes turn as "xyxy" says: M01 and M10 of light along the normal are those of
    an isotropic surface, and M(-phi) = D M(phi) D with D = diag(1, 1, -1, -1)."""
    m = gn.load(real("nist_ptfe/PTFE.data.532.csv"))
    wi, wo = (gn.direction(m.rows[:, k], m.rows[:, k + 1]) for k in (0, 2))
    M = to_frames(m.matrices, wi, wo, "facet", given="xyxy") / m.matrices[:, :1, :1]
    slant = (m.rows[:, 0] < 0.01) & (m.rows[:, 2] > np.radians(50.0))
    means, spread = M[slant].mean(0), M[slant].std(0)
    assert means[0, 1] > 0.012 and means[1, 0] > 0.006
    assert max(abs(means[0, 2]), abs(means[2, 0])) < 0.003
    assert (spread[:2, :2] < 0.02).all()
