"""Whether a static start is stable: its links with the joints held, and small motions with the joints released."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from erls.equations.formulation import Formulation
from erls.equations.linearization import Linearization, roots
from erls.errors import Cause, SimulationError
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism

_NEAR = 0.1  # of the size of the mechanism: an equilibrium that is farther away says little of the motion
LARGEST = 600
"""Coordinates of a system whose roots are looked for; those of more take minutes."""


class Bearing(NamedTuple):
    """What loads leave of the stiffness of links with the joints held.

    Attributes
    ----------
    left : float
        `erls.equations.linearization.stiffness_left`: 1 without load, 0 at buckling.
    link : str
        The link that bends most where least is left; empty without flexible links.
    """

    left: float
    link: str

    @property
    def sound(self) -> bool:
        """Whether the links bear their loads."""
        return self.left > 0


@dataclass(frozen=True)
class Stability:
    """Of a static start.

    Attributes
    ----------
    stiffness_left : float
        What loads leave of the stiffness of the links with the joints held: 1 without load, 0 at buckling.
    softest_link : str
        Where least is left; empty without flexible links.
    root : complex or None
        Rightmost root of s² M + s (C + G) + K with the joints released [1/s]; None where nothing can move, the system
        has more than `LARGEST` coordinates, or the start is `tumbling`.
    distance : float
        Of an equilibrium with the joints released, by the acceleration and the root [m]; infinite where that is none.
    size : float
        Of the mechanism [m].
    """

    stiffness_left: float
    softest_link: str
    root: complex | None
    distance: float
    size: float

    @property
    def near_equilibrium(self) -> bool:
        """Whether the motion begins near an equilibrium with the joints released, so that its root tells of it."""
        return self.distance <= _NEAR * self.size

    @property
    def line(self) -> str:
        """Of the report of a run."""
        held = f"{100 * self.stiffness_left:.3g} % of the stiffness left under load with the joints held"
        if self.softest_link:
            held += f" (link {self.softest_link!r})"
        if self.root is None:
            return f"static start: {held}"
        imaginary = f" ± {abs(self.root.imag):.4g} i" if self.root.imag else ""
        away = "" if self.near_equilibrium or self.root.real <= 0 else ", far from an equilibrium"
        root = f"{self.root.real:.4g}{imaginary} 1/s{away}"
        return f"static start: {held}; rightmost root with the joints released {root}"

    def summary(self) -> dict[str, Any]:
        """The key ``stability`` of the JSON of ``erls simulate``."""
        root = self.root
        return {
            "stiffness_left": self.stiffness_left,
            "softest_link": self.softest_link or None,
            "root": None if root is None else {"real": root.real, "imaginary": root.imag},
            "near_equilibrium": self.near_equilibrium,
        }


@runtime_checkable
class Started(Protocol):
    """A formulation that knows how stable its static start is."""

    @property
    def stability(self) -> Stability:
        """Of its static start."""


def tumbling(mechanism: Mechanism, v: Array) -> bool:
    """Whether rotation vectors turn at a start (n,): what is constant along that motion is not so in them.

    Parameters
    ----------
    mechanism : Mechanism
    v : (n,) array
        Rates of independent coordinates, those of joints first.
    """
    return any(v[k : k + 3].any() for k in mechanism.rotation_vector_places)


def stability_of(
    bearing: Bearing, motions: Linearization | None, acceleration: Array, metres: Array, size: float
) -> Stability:
    """Of a static start with the joints released.

    Parameters
    ----------
    bearing : Bearing
        With the joints held.
    motions : Linearization or None
        Small motions with the joints released, where they have constant coefficients.
    acceleration : (n,) array
        Of the start.
    metres : (n,) array
        Per unit of each coordinate.
    size : float
        Of the mechanism [m].
    """
    root, distance = None, np.inf
    if motions is not None and 0 < motions.size <= LARGEST:
        root = complex(roots(motions)[0])
        if root.real > 0:
            distance = float(np.abs(metres * acceleration).max()) / abs(root) ** 2
    return Stability(*bearing, root, distance, size)


def start_stability(formulation: Formulation) -> Stability | None:
    """Of a static start; None of other starts, of formulations that do not know it, and where nothing can be solved.

    Parameters
    ----------
    formulation : Formulation
        What is integrated: of the pieces, where links are split.
    """
    if not formulation.mechanism.static_start or not isinstance(formulation, Started):
        return None
    try:
        return formulation.stability
    except (SimulationError, np.linalg.LinAlgError):  # a mass matrix that is singular is told by the run
        return None


def unstable(link: str, share: float, beyond: bool) -> SimulationError:
    """A link buckles at a share of its loads; there is an equilibrium beyond, or none was found."""
    there = "" if beyond else "; no equilibrium was found beyond that"
    remedy = "stiffen the link, or let it bear less; start from deformation = 'zero', or turned to where loads bend it"
    return SimulationError(
        Cause.UNSTABLE_START,
        f"link {link!r} buckles under its loads, the joints held: it bears {share:.3g} of them{there}",
        where="initial.deformation",
        value=f"{1 / share:.3g} times what it buckles at",
        limit="below 1",
        remedy=f"{remedy}; initial.allow_unstable = true starts on the unstable equilibrium" if beyond else remedy,
    )


def too_soft(what: str, deflection: float, size: float) -> SimulationError:
    """Links that deflect farther than their equations hold."""
    return SimulationError(
        Cause.NO_EQUILIBRIUM,
        f"{what} within small displacements",
        where="initial.deformation",
        value=f"deflection {deflection:.3g} m",
        limit=f"{size:.3g} m, the size of a link",
        remedy="start from deformation = 'zero', or check stiffness and gravity",
    )
