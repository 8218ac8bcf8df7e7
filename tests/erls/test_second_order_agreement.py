"""To which order two body frames agree with second-order kinematics: forces of FFR in both frames at one state.

Links that ring have deflections ε, elastic rates √ε and elastic accelerations 1 (ε ~ 1/E). Terms of the Lagrangian that
the link model leaves out, each its own, and what is left between the forces on the elastic coordinates:

    q q̇²      ε²        ε          without the effect ``modal_inertia``
    ω q² q̇    ε^(5/2)   ε^(3/2)    with it, while joints turn: displacements of third order in q
    q² q̇²     ε³        ε²         with it, while joints rest

Over n vibrations displacements hence differ by n times ε², ε^(5/2), ε³, and joint torques by n times ε, ε^(3/2), ε². At
a given time n grows with ε^(-1/2). ERLS, anchored on inboard interfaces, has the forces of tangent frames
(`test_kernels_stiffened`).

Masses are lumped: a consistent mass matrix depends on the axes that it is written in, by (element / wave)².
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scenes

from erls.equations.ffr.formulation import Ffr
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import ALL

SIZES = 1e-3 * 2.0 ** -np.arange(5)


@pytest.fixture(scope="module")
def chain(tmp_path_factory: pytest.TempPathFactory) -> Mechanism:
    """Three L-shaped links out of one plane, a payload that turns at the end."""
    folder = tmp_path_factory.mktemp("agreement")
    payload = {"point": "end", "mass": 0.3, "offset": [0.02, 0.0, 0.01], "inertia": [1e-3, 2e-3, 3e-3]}
    path = scenes.three_links(folder, payloads=[payload])
    frame = {"mass": "lumped", "rotary_inertia": False}
    reduction = {"fixed_interface_modes": 2, "elastic_modes": 6}
    (scenes.l_link(folder, 4, frame=frame, reduction=reduction)).rename(folder / "arm.toml")
    return replace(scenes.mechanism(path), effects=ALL)


def _apart(chain: Mechanism, effects: frozenset[str], turning: float) -> Array:
    """(sizes,) elastic forces along mean axes less those at the interfaces."""
    chain = replace(chain, effects=effects)
    systems = [Ffr(chain, "mean-axis"), Ffr(chain)]
    rng = np.random.default_rng(5)
    n, f = systems[0].size, len(systems[0].free_joints)
    omega = np.sqrt(systems[0].stiffness)
    angles, rates, accelerations = rng.normal(size=(3, f))
    q, qd, qdd = rng.normal(size=(3, n - f)) / omega
    result = np.zeros(len(SIZES))
    for k, size in enumerate(SIZES):
        y = np.concatenate([angles, size * q])
        v = np.concatenate([turning * rates, np.sqrt(size) * 30 * qd])
        a = np.concatenate([turning * accelerations, 900 * qdd])
        forces = [system.residual(0.0, y, v, a)[f:] for system in systems]
        result[k] = np.abs(forces[0] - forces[1]).max()
    return result


@pytest.mark.parametrize(
    ("off", "turning", "order"), [({"modal_inertia"}, 0.0, 1.0), (set(), 3.0, 1.5), (set(), 0.0, 2.0)]
)
def test_order_of_agreement(chain: Mechanism, off: set[str], turning: float, order: float) -> None:
    """Exponents within 0.1, over halved deflections."""
    apart = _apart(chain, ALL - off, turning)
    found = np.log2(apart[:-1] / apart[1:])
    assert found[-1] == pytest.approx(order, abs=0.1)
