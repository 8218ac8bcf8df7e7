"""The heavy top of Brüls, Arnold and Cardona (2011): system, reference motion, errors of a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.joints import GROUND, Joint
from erls.equations.nodal.rigid_body import RigidBodies, RigidBody
from erls.integrate.constrained import ConstrainedOptions, ConstrainedSolution
from erls.integrate.lie_generalized_alpha import lie_generalized_alpha
from erls.maths.groups import R3_SO3, SE3
from erls.maths.se3 import pose
from erls.maths.so3 import Array

GROUPS = {"SE(3)": SE3, "R³×SO(3)": R3_SO3}
SPINS = {"fast": np.array([0.0, 150.0, -4.61538]), "slow": np.array([0.0, 1.5, -0.0461538])}
ARM = np.array([0.0, 1.0, 0.0])  # centre of mass from the fixed point


def heavy_top(group: str) -> NodalSystem:
    """One body, its node at the centre of mass, pinned so that Φ = X − Rᵀ x."""
    body = RigidBody(0, 15.0, np.diag([0.234375, 0.46875, 0.234375]))
    pin = Joint("point", "spherical", 0, GROUND, inner_frame=pose(position=-ARM))
    weight = np.array([0.0, 0.0, -9.81])
    return NodalSystem(pose(position=ARM)[None], [RigidBodies([body], weight)], [pin], GROUPS[group])


def spin(group: str, end: float, options: ConstrainedOptions, speed: str = "fast") -> ConstrainedSolution:
    """Run to ``end``; at the start the node's axes are those of the world, so that both groups start alike."""
    omega = SPINS[speed]
    start = np.concatenate([np.cross(omega, ARM), omega])
    system = heavy_top(group)
    return lie_generalized_alpha(system, (0, end), system.start, start, options)


def reference() -> dict[str, Array]:
    """Columns of ``tests/data/heavy_top.csv``: t (k,), and (k, 3) each."""
    path = Path(__file__).parents[1] / "data" / "heavy_top.csv"
    table = np.loadtxt(path, delimiter=",")
    names = ("fast_x", "fast_u", "force", "slow_x")
    return {"t": table[:, 0]} | {n: table[:, 1 + 3 * k : 4 + 3 * k] for k, n in enumerate(names)}


def errors(found: ConstrainedSolution, speed: str = "fast") -> tuple[float, float, float]:
    """Largest errors of position [m], velocity [m/s] and multiplier [N] after t = 0.1 s, where knots meet samples."""
    exact = reference()
    near = np.searchsorted(found.t, exact["t"] - 1e-9).clip(max=len(found.t) - 1)
    met = np.abs(found.t[near] - exact["t"]) < 1e-9
    near, late = near[met], exact["t"][met] > 0.1

    def largest(mine: Array, name: str) -> Array:
        off: Array = np.linalg.norm(mine - exact[name][met], axis=1)
        return off

    if speed == "slow":
        return float(largest(found.y[near, :3], "slow_x").max()), np.nan, np.nan
    position, velocity = largest(found.y[near, :3], "fast_x"), largest(found.v[near, :3], "fast_u")
    force = largest(found.multipliers[near], "force")[late]
    return float(position.max()), float(velocity.max()), float(force.max())


def hidden_constraint(found: ConstrainedSolution) -> float:
    """Largest |Φ̇| = |d(Rᵀ x)/dt| [m/s]."""
    turn, rate = (x[:, 3:12].reshape(-1, 3, 3) for x in (found.y, found.v))
    drift = np.einsum("kji,kj->ki", rate, found.y[:, :3]) + np.einsum("kji,kj->ki", turn, found.v[:, :3])
    return float(np.abs(drift).max())


def energies(found: ConstrainedSolution) -> Array:
    """(k,) kinetic and gravity energy [J]."""
    turn, rate = (x[:, 3:12].reshape(-1, 3, 3) for x in (found.y, found.v))
    tilde = np.einsum("kji,kjl->kil", turn, rate)
    omega = np.stack([tilde[:, 2, 1], tilde[:, 0, 2], tilde[:, 1, 0]], axis=1)
    kinetic = 7.5 * (found.v[:, :3] ** 2).sum(axis=1) + (omega**2) @ np.array([0.234375, 0.46875, 0.234375]) / 2
    total: Array = kinetic + 15 * 9.81 * found.y[:, 2]
    return total
