"""A nodal system with elements and joints of all kinds that have kernels, far from rest, and what they make of it."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.beam import Beam, Beams
from erls.equations.nodal.joints import GROUND, Joint
from erls.equations.nodal.loads import NodalLoad, NodalLoads
from erls.equations.nodal.rigid_body import RigidBodies, RigidBody
from erls.equations.nodal.section import BeamSection
from erls.integrate.constrained import ConstrainedOptions
from erls.integrate.lie_generalized_alpha import lie_generalized_alpha
from erls.maths import motion_maps as motions
from erls.maths.groups import R3_SO3, SE3, Group
from erls.maths.so3 import Array

GROUPS: dict[str, Group] = {"SE(3)": SE3, "R³×SO(3)": R3_SO3}
TIME, ALPHA, BETA = 0.7, 4.0 / 30.0, 1.0 / 30.0
WEIGHT = np.array([0.3, -0.5, -9.0])


def section(rng: np.random.Generator, massless: bool = False) -> BeamSection:
    """With full matrices."""
    first, second = rng.standard_normal((2, 6, 6))
    inertia = np.zeros((6, 6)) if massless else np.eye(6) + second @ second.T
    return BeamSection(np.eye(6) + first @ first.T, inertia)


def system(group: str) -> NodalSystem:
    """Three curved, twisted beams with full section matrices, two bodies, loads, four joints, two of them driven."""
    rng = np.random.default_rng(3)
    poses = motions.exp(0.6 * rng.standard_normal((5, 6)))
    sections = [section(rng) for _ in range(3)]
    ends = motions.exp(0.4 * rng.standard_normal((3, 2, 6)))
    beams = [Beam((k, k + 1), poses[k : k + 2] @ ends[k], sections[k]) for k in range(3)]
    bodies = [RigidBody(k, 2.0 + k, np.diag([1.0, 1.2, 1.3]), rng.standard_normal(3)) for k in (1, 4)]
    loads = [NodalLoad(k, *rng.standard_normal((2, 3)), follower=k == 1) for k in range(3)]

    def somewhere() -> Array:
        found: Array = motions.exp(0.5 * rng.standard_normal(6))
        return found

    joints = [
        Joint("hinge", "revolute", GROUND, 0, somewhere(), somewhere()),
        Joint("cross", "universal", 3, 4, somewhere(), somewhere()),
        Joint("turned", "revolute", 1, 4, somewhere(), somewhere(), lambda t: (0.3 + t, 1.0, 0.0)),
        Joint("pushed", "prismatic", 2, GROUND, somewhere(), somewhere(), lambda t: (0.3 + t, 1.0, 0.0)),
    ]
    elements = [Beams(beams, poses, WEIGHT), RigidBodies(bodies, WEIGHT), NodalLoads(loads)]
    return NodalSystem(poses, elements, joints, GROUPS[group])


def state(known: NodalSystem) -> tuple[Array, Array, Array, Array]:
    """Increment, velocity, acceleration, multipliers."""
    rng = np.random.default_rng(4)
    v, a = rng.standard_normal((2, known.size))
    return 0.2 * rng.standard_normal(known.size), v, a, rng.standard_normal(known.constraints)


def evaluate(known: NodalSystem) -> dict[str, Array]:
    """By the functions of `erls.equations.stepped` at `state`: residual with violations and norms (n + m + 2,), metres
    per unit of conditions, and the unknowns for `right` with the factored iteration matrix.
    """
    from erls.equations.nodal.compiled import stepped

    steps = stepped(known)
    constants, n, m = (steps.reals, steps.integers), known.size, known.constraints
    increment, v, a, multipliers = state(known)
    start = steps.pack(known.start)
    moved, residual = np.zeros_like(start), np.zeros(n + m + 2)
    sample = known.samples(np.array([TIME]))[0]
    steps.scratch[: len(sample)] = sample
    steps.compose(*constants, steps.scratch, np.ones(n), start, increment, moved)
    steps.residual(*constants, steps.scratch, TIME, moved, v, np.concatenate([a, multipliers]), residual)
    assert steps.factoring is not None
    factors, unknowns = np.zeros(steps.factoring.size), right(known)
    broken = steps.factoring.factor(*constants, steps.scratch, TIME, moved, v, ALPHA, BETA, factors)
    steps.factoring.solve(*constants, factors, unknowns)
    return {
        "residual": residual,
        "status": np.array([float(broken)]),
        "scales": factors[: 2 * m].copy(),
        "unknowns": unknowns,
    }


def right(known: NodalSystem) -> Array:
    """(n + m,) a right-hand side."""
    return np.random.default_rng(5).standard_normal(known.size + known.constraints)


def twin(path: Path) -> None:
    """All of it into a file, with a short run of the slow heavy top."""
    import heavy_top

    found = {f"{group} {k}": x for group in GROUPS for k, x in evaluate(system(group)).items()}
    top = heavy_top.heavy_top("SE(3)")
    spin = heavy_top.SPINS["slow"]
    start = np.concatenate([np.cross(spin, heavy_top.ARM), spin])
    run = lie_generalized_alpha(
        top, (0, 0.02), top.start, start, ConstrainedOptions(step=2e-3, compiled=True)
    )
    assert run.failure is None
    np.savez(path, **found, run=run.y)


if __name__ == "__main__":
    twin(Path(sys.argv[1]))
