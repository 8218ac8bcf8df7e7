"""The Princeton beam: an aluminium strip with a weight at its tip, turned about its axis, bends both ways and twists.

Geometry and loads are those of the experiment of E. Dowell and J. Traybar (1975), as benchmarks of beam programs use
them. The figures come from an independent solution here: the same strip as an inextensible Kirchhoff rod under a dead
force, a boundary-value problem in position, quaternion and moment for SciPy's collocation. Shear and stretch, which
that rod has not, count (h/L)², below 1e-3.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from body_scenes_data import body_scene
from scipy.integrate import solve_bvp

from erls import simulate
from erls.maths.so3 import Array
from erls.run.bodies.rest import BodyRest
from fe_import.elements.sections import rectangle_torsion_constant

LENGTH, HEIGHT, THICK, E, NU = 0.508, 12.377e-3, 3.2024e-3, 71.7e9, 0.31
EI_FLAT, EI_EDGE = E * HEIGHT * THICK**3 / 12, E * THICK * HEIGHT**3 / 12
GJ = E / (2 * (1 + NU)) * rectangle_torsion_constant(HEIGHT, THICK)
LOADS, ANGLES = (4.448, 8.896, 13.345), (0.0, 30.0, 60.0, 90.0)


def _rotation(q: Array) -> Array:
    """(3, 3, k) of unit quaternions (4, k)."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _rod(force: Array) -> Array:
    """(3,) tip of the inextensible rod: x along it, the flat side's normal along y, its height along z."""
    compliance = 1 / np.array([GJ, EI_EDGE, EI_FLAT])

    def slopes(s: Array, y: Array) -> Array:
        turn = _rotation(y[3:7] / np.linalg.norm(y[3:7], axis=0))
        along = turn[:, 0]
        k1, k2, k3 = compliance[:, None] * np.einsum("jik,jk->ik", turn, y[7:])
        w, x, v, z = y[3:7]
        spin = np.array(
            [-x * k1 - v * k2 - z * k3, w * k1 + v * k3 - z * k2, w * k2 + z * k1 - x * k3, w * k3 + x * k2 - v * k1]
        )
        return np.concatenate([along, spin / 2, -np.cross(along.T, force).T])

    def ends(root: Array, tip: Array) -> Array:
        return np.concatenate([root[:7] - [0, 0, 0, 1, 0, 0, 0], tip[7:]])

    s = np.linspace(0, LENGTH, 41)
    guess = np.zeros((10, 41))
    guess[0], guess[3] = s, 1.0
    guess[7:] = np.outer(np.cross([1.0, 0, 0], force), LENGTH - s)
    found = solve_bvp(slopes, ends, s, guess, tol=1e-9, max_nodes=20000)
    assert found.success
    tip: Array = found.y[:3, -1]
    return tip


def _force(load: float, angle: float) -> Array:
    """Of a weight, with the strip turned by ``angle`` from standing on edge."""
    return load * np.array([0.0, np.sin(np.radians(angle)), -np.cos(np.radians(angle))])


def _scene(force: Array) -> dict[str, Any]:
    return {
        "gravity": [0.0, 0.0, 0.0],
        "simulation": {"type": "statics"},
        "materials": {"aluminium": {"youngs_modulus": E, "poissons_ratio": NU, "density": 0.0}},
        "sections": {"strip": {"shape": "rectangular", "width": THICK, "height": HEIGHT}},
        "nodes": {"root": [0.0, 0.0, 0.0], "tip": [LENGTH, 0.0, 0.0]},
        "beams": [
            {"name": "b", "from": "root", "to": "tip", "elements": 20, "material": "aluminium", "section": "strip"}
        ],
        "connections": [{"name": "clamp", "type": "fixed", "node": "root"}],
        "loads": [{"node": "tip", "force": force.tolist()}],
    }


@pytest.mark.parametrize("load", LOADS)
def test_princeton_beam(tmp_path: Path, load: float) -> None:
    """Deflections both ways against the rod, within 1 % of the larger, in one load step of at most nine iterations."""
    for angle in ANGLES:
        force = _force(load, angle)
        found = simulate(body_scene(tmp_path, _scene(force)), verdict=False)
        assert isinstance(found, BodyRest)
        exact = _rod(force)
        np.testing.assert_allclose(found.position("tip", 1.0), exact, atol=0.01 * float(np.abs(exact[1:]).max()))
        assert found.statics.path[-1].iterations <= 9


def test_the_rod_bends_as_a_cantilever_does() -> None:
    """Of the independent solution: P L³/(3EI) both ways for a small load, and no twist."""
    for angle, bending in ((0.0, EI_EDGE), (90.0, EI_FLAT)):
        force = _force(1e-4, angle)
        assert np.linalg.norm(_rod(force)[1:]) == pytest.approx(1e-4 * LENGTH**3 / (3 * bending), rel=1e-5)
