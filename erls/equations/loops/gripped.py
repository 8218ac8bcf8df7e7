"""Contacts whose points may stick, on a tree that loops close: what is found of the tree has the modes of the closed
chain.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import fields
from functools import partial
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from erls.equations.formulation import ContactSeries
from erls.equations.loops.rubbing import grip_force
from erls.equations.serial.state_series import ReactionSeries
from erls.equations.switches.gripped import grips_in, held_joints, lent
from erls.equations.switches.grips import NO_GRIPS, Grips
from erls.maths.contact_places import MODE, STICKS
from erls.maths.jit import plain
from erls.maths.so3 import Array

if TYPE_CHECKING:
    from erls.equations.loops.closed_chain import ClosedChain
    from erls.equations.loops.compiled import CompiledLoops

S = TypeVar("S", ContactSeries, ReactionSeries)
_INDEPENDENT = 1e-6  # of a row, what others leave of it


def loop_grips(chain: ClosedChain, system: CompiledLoops) -> Grips:
    """Modes in one of the compiled forms."""
    tree, joints = chain.bare.compiled, held_joints(chain.mechanism)
    if tree is None or not (chain.mechanism.grips or joints):
        return NO_GRIPS
    from erls.equations.loops import actuated  # here: kernels of loops are for loops alone

    return grips_in(chain.mechanism, system, actuated.forces if joints else tree.residual, joints)


class Rubbed(NamedTuple):
    """Joints that may stick, where closing joints do, at a closed state: first those of the tree.

    Attributes
    ----------
    forces : (g,) array
        Friction.
    sticks : (g,) bool array
    coordinates : (g,) array
    rows : (g, n) array
        Rates over those of the chain.
    """

    forces: Array
    sticks: NDArray[np.bool_]
    coordinates: Array
    rows: Array


def rubbed(chain: ClosedChain, t: float, y: Array, v: Array) -> Rubbed:
    """What friction does to them."""
    system = chain.exact
    places = [at for at, _ in system.given.grips]
    with gripped(chain, t, y, v):
        found = system.closure(t, y, v)
        seen = [(y[at], v[at]) for at in places]
        seen += [(found.efforts[k].coordinate, found.efforts[k].rate) for k in system.sticking]
        laws = system.gripped_laws(system.reals)
        forces = [plain(grip_force)(law, *at) for law, at in zip(laws, seen, strict=True)]
        sticks = np.array([law[MODE] == STICKS for law in laws], dtype=bool)
    rows = list(np.eye(chain.size)[places])
    for k in system.sticking:
        free = chain.mechanism.loops[k].freedom
        assert free is not None
        rows.append(found.moves[k][free.freedom.row, chain.bare.free])
    return Rubbed(np.array(forces), sticks, np.array([at for at, _ in seen]), np.array(rows))


def held_friction(chain: ClosedChain, t: float, y: Array, v: Array) -> tuple[Array, Array]:
    """(joints,) and (loops,) friction of such joints."""
    tree, closing = np.zeros(len(chain.mechanism.joints)), np.zeros(len(chain.mechanism.loops))
    if chain.mechanism.gripped:
        forces, places = rubbed(chain, t, y, v).forces, [at for at, _ in chain.exact.given.grips]
        tree[chain.bare.free_joints[places]] = forces[: len(places)]
        closing[chain.exact.sticking] = forces[len(places) :]
    return tree, closing


def resting(chain: ClosedChain, found: Rubbed, conditions: Array) -> list[int]:
    """Of such joints that stick those whose rest is no consequence of conditions (r, n), and of the others'."""
    basis = la.orth((conditions / chain.metres).T)
    result: list[int] = []
    for k in np.flatnonzero(found.sticks).tolist():
        row = found.rows[k] / chain.metres
        rest, size = row, float(np.linalg.norm(row))
        for _ in range(2):  # once more against rounding
            rest = rest - basis @ (basis.T @ rest)
        left = float(np.linalg.norm(rest))
        if left > _INDEPENDENT * size:
            basis = np.column_stack([basis, rest / left])
            result.append(k)
    return result


def gripped(chain: ClosedChain, t: float, y: Array, v: Array) -> AbstractContextManager[None]:
    """Meanwhile contacts have the modes that follow from a closed state."""
    return chain.exact_grips.settled(t, y, v, partial(chain.accelerate, chain.exact))


def by_states(chain: ClosedChain, found: Callable[..., S], *states: Array) -> S:
    """What is found of the tree at times (k,), with coordinates, rates and what else is given (k, n): one by one where
    contacts have modes.
    """
    if not chain.exact_grips.names or not len(states[0]):
        return found(*states)
    assert chain.bare.compiled is not None
    each = []
    for k in range(len(states[0])):
        at = [part[k : k + 1] for part in states]
        with (
            gripped(chain, float(at[0][0]), at[1][0], at[2][0]),
            lent(chain.exact_grips, chain.mechanism, chain.bare.compiled),
        ):
            each.append(found(*at))
    names = [field.name for field in fields(each[0])]
    return type(each[0])(*(np.concatenate([getattr(one, name) for one in each]) for name in names))
