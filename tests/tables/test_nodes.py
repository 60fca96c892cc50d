"""Nodes for tables: no more than f needs, found by measuring it."""

import numpy as np
import pytest
from house import PLASTIC

import gonio as gn
from gonio.tables.angle_systems import SYSTEMS, angle_system
from gonio.tables.nodes import needed, own_nodes

GLOSSY = PLASTIC.replace(rho=0.2, alpha=0.4)


def lengths(m, name="angles"):
    system = angle_system(name)
    axes = system.nodes(system.coarse.isotropic if m.is_isotropic() else system.coarse.oriented)
    return [len(x) for x in needed(m, system, axes).values()]


@pytest.mark.parametrize("name", SYSTEMS)
def test_two_nodes_suffice_where_f_does_not_change(name):
    few = lengths(gn.Lambertian([0.1, 0.5]), name)
    assert few == [2, 2, 2] if name in ("angles", "relative") else np.prod(few) <= 2 * 2 * 36  # some are below
    assert lengths(GLOSSY, name) == [*angle_system(name).coarse.isotropic]


def test_an_axis_on_which_f_does_not_depend_is_found():
    assert lengths(gn.Minnaert(0.5, 0.7)) == [31, 31, 2]
    theta = np.radians([0.0, 20.0, 40.0, 60.0, 80.0])
    bent = gn.Gridded(
        "angles",
        {"theta_i": theta, "theta_o": theta[[0, 4]], "phi": [0.0]},
        np.array([1.0, 2.0, 1.5, 3.0, 1.0])[:, None, None] * [[1.0], [2.0]],
    )
    fine = np.radians(np.linspace(0.0, 80.0, 33))
    found = needed(
        bent, angle_system("angles"), {"theta_i": fine, "theta_o": fine, "phi": np.radians([0.0, 90.0, 180.0])}
    )
    assert [len(x) for x in found.values()] == [5, 2, 2]


def test_own_nodes_are_above_the_horizon_and_of_whole_circles():
    axes = {"theta_i": np.radians([0.0, 45.0, 90.0]), "theta_o": [0.1], "phi": np.radians([0.0, 120.0, 240.0])}
    m = gn.Gridded("angles", axes, np.ones((3, 1, 3)))
    found = own_nodes(m)
    np.testing.assert_allclose(np.degrees(found["theta_i"]), [0.0, 45.0, 89.94], atol=0.01)
    assert len(found["theta_o"]) == 1 and len(found["phi"]) == 3
    assert "phi" not in own_nodes(gn.Gridded("angles", {**axes, "phi": [0.0, 0.5, 1.0]}, np.ones((3, 1, 3))))
    assert own_nodes(GLOSSY) == {}
