"""Vibrations of a mechanism about its rigid motion: at a frozen configuration, without loads, joints as they are held.

Prescribed joints and conditions are rows B u = 0 of displacements u, controllers and springs are stiffness between
links; what is left vibrates by NᵀK N and NᵀM N, N a basis of what the rows leave free. Nodal elements are those of the
equivalent static loads (`erls.optimization.frozen`).

Where lengths or motions change from design to design, N does. Modes Φ of all nodes are then brought to what the rows of
the other design leave free: of an eigenvalue, (M - μ K) Φ = Bᵀ λ, that finds the part (δB Φ)ᵀ λ of its change, too.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import scipy.linalg as la

from erls.equations.nodal.equations import Nodal
from erls.equations.system import metre_scales
from erls.maths.saddle import dense
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.optimization.eigenvalues import HeldLink
from erls.optimization.frozen import Frozen
from erls.optimization.link_numbers import LinkNumbers
from fe_import.model import IntArray


@dataclass(frozen=True)
class HeldMechanism(HeldLink):
    """A mechanism at one time.

    Attributes
    ----------
    ways : (n, d) array
        N.
    within : (d, n) array
        Of displacements of all nodes, what is nearest to them, turns counted by their lengths.
    """

    ways: Array = field(default_factory=lambda: np.zeros((0, 0)))
    within: Array = field(default_factory=lambda: np.zeros((0, 0)))


def held_mechanism(
    mechanism: Mechanism, nodal: Nodal, frozen: Frozen, numbers: LinkNumbers, x: Array, at: IntArray
) -> list[HeldMechanism]:
    """What vibrates at some of the times, as a link between its ends.

    Parameters
    ----------
    mechanism : Mechanism
        With the joints and payloads of the design.
    nodal, frozen : Nodal, Frozen
        Of a mechanism of the same lengths.
    numbers : LinkNumbers
    x : (v,) array
        The design, whose sections links get.
    at : (k,) array
        Numbers of the times.
    """
    links = list(mechanism.links)
    for k, number in enumerate(mechanism.bodies):
        described = numbers.at(k, x)
        if described is not None and links[number].description is not None:
            links[number] = replace(links[number], description=described)
    bare = replace(mechanism, links=tuple(links), gravity=np.zeros(3), loads=(), contacts=())
    system = nodal.with_sections(bare).system
    rest, none = np.zeros(system.size), np.zeros(system.constraints)
    result = []
    for k in at.tolist():
        t, q = float(frozen.times[k]), system.at(frozen.frames[k, frozen.links] @ frozen.local)
        stiffness = dense(system.stiffness_and_damping(t, q, rest, rest, none)[0])
        mass = dense(system.mass_matrix(t, q))
        ways, within = _free(dense(system.constraint_matrix(t, q)), metre_scales(system))
        held, weight = ((part + part.T) / 2 for part in (ways.T @ matrix @ ways for matrix in (stiffness, mass)))
        result.append(HeldMechanism(held, weight, ways=ways, within=within))
    return result


def _free(rows: Array, metres: Array) -> tuple[Array, Array]:
    """N and its inverse from displacements nearest to it: with turns in metres, and rows that weigh the same."""
    scaled = rows / metres
    sizes = np.linalg.norm(scaled, axis=1, keepdims=True)
    free = la.null_space(scaled / np.where(sizes > 0, sizes, 1.0))
    return free / metres[:, None], free.T * metres
