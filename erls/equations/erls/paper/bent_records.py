"""Records of the second-order displacements of a link with n modal coordinates, `erls.equations.erls.paper.bent`."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

from erls.equations import compiled_system as contract
from erls.maths.calls import caller
from erls.maths.jit import ENABLED
from erls.maths.records import Matrix, Stack, reader, room, table_size
from erls.maths.so3 import Array

OF_LINK: Any = None
if ENABLED:
    from numba import types as _t

    OF_LINK = _t.void(_t.int64, contract.REALS, contract.INTEGERS, contract.REALS)

call_correct_twist = caller(OF_LINK, "erls.equations.erls.paper.bent:correct_twist")
call_bent_forces = caller(OF_LINK, "erls.equations.erls.paper.bent:bent_forces")
call_bent_mass = caller(OF_LINK, "erls.equations.erls.paper.bent:bent_mass")


class BentBody(NamedTuple):
    """Second-order displacements ½ qᵀ Ψ q of a link; of no entries without them.

    Attributes
    ----------
    per_mass : (6, 6) array
        M₀⁻¹.
    coupling : (6, n, n) array
        S_ab and Pᵀ: C = [S_ab q; qᵀ P].
    odd : (3, n, n) array
        (P - Pᵀ)/2.
    spin : (9, n, n) array
        W.
    warp : (e, n, n) array
        K of modal inertia, q meeting the last index; of no entries without the effect.
    per_modal : (e, e) array
        σ⁻¹.
    """

    per_mass: Matrix
    coupling: Stack
    odd: Stack
    spin: Stack
    warp: Stack
    per_modal: Matrix


class BentState(NamedTuple):
    """Memory of a link with second-order displacements.

    Attributes
    ----------
    coupling, coupling_rate : (6, n) arrays
        C and Ċ.
    spun : (9, n) array
        W q.
    moment, moment_rate : (3,) arrays
        S = ½ qᵀ S_ab q and its derivative.
    square, square_rate : (3, 3) arrays
        ½ qᵀ W q and its derivative.
    more, more_rate, share, share_rate : (6,) arrays
        C q̇ + H ν and its derivative; M₀⁻¹ times momentum and force.
    odd : (n,) array
    change : (6, 6 + n) array
        Corrected twist per (ν, q̇).
    changed : (6 + n, 6 + n) array
        Mass matrix of the corrected twist.
    warp, warp_rate, warp_spare : (e, n) arrays
        K(q), K(q̇).
    lag, lag_rate, pushed, pushed_rate : (e,) arrays
        k = K q̇, its derivative, q̇_e + σ⁻¹ k and its derivative.
    """

    coupling: Annotated[Array, "6 n"]
    coupling_rate: Annotated[Array, "6 n"]
    spun: Annotated[Array, "9 n"]
    moment: Annotated[Array, "3"]
    moment_rate: Annotated[Array, "3"]
    square: Annotated[Array, "3 3"]
    square_rate: Annotated[Array, "3 3"]
    more: Annotated[Array, "6"]
    more_rate: Annotated[Array, "6"]
    share: Annotated[Array, "6"]
    share_rate: Annotated[Array, "6"]
    odd: Annotated[Array, "n"]
    change: Annotated[Array, "6 a"]
    changed: Annotated[Array, "a a"]
    warp: Annotated[Array, "e n"]
    warp_rate: Annotated[Array, "e n"]
    warp_spare: Annotated[Array, "e n"]
    lag: Annotated[Array, "e"]
    lag_rate: Annotated[Array, "e"]
    pushed: Annotated[Array, "e"]
    pushed_rate: Annotated[Array, "e"]


def bent_state(modes: int, bent: bool, warped: bool) -> BentState:
    """Memory for a link with n = ``modes``, if it is bent; with modal inertia if it is warped."""
    n = modes if bent else 0
    return room(BentState, n=n, a=6 + n if bent else 0, e=n - 6 if warped else 0)


read_bent_body, read_bent_state = reader(BentBody), reader(BentState)
BENT_BODY, BENT_STATE = table_size(BentBody), table_size(BentState)
