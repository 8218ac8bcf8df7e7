"""Contacts whose points may stick, on a tree that loops close: what is found of the tree has the modes of the closed
chain.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import fields
from functools import partial
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from erls.equations.formulation import ContactSeries
from erls.equations.serial.state_series import ReactionSeries
from erls.equations.switches.gripped import grips_in, lent
from erls.equations.switches.grips import NO_GRIPS, Grips
from erls.maths.so3 import Array

if TYPE_CHECKING:
    from erls.equations.loops.closed_chain import ClosedChain
    from erls.equations.loops.compiled import CompiledLoops

S = TypeVar("S", ContactSeries, ReactionSeries)


def loop_grips(chain: ClosedChain, system: CompiledLoops) -> Grips:
    """Modes in one of the compiled forms."""
    tree = chain.bare.compiled
    if tree is None or not chain.mechanism.grips:
        return NO_GRIPS
    return grips_in(chain.mechanism, system, tree.residual)


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
