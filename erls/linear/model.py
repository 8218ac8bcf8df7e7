"""A linear model: matrices of second and of first order, poles, modes, zeros."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as la

from erls.equations.linearization import Linearization, small_modes
from erls.errors import Cause, SceneError, SimulationError
from erls.files.optional import optional_package
from erls.linear.channels import checked
from erls.linear.zeros import off_poles, transmission_zeros
from erls.maths.so3 import Array
from fe_import.model import IntArray

_ZERO = 1e-9  # of the fastest pole: a real part that rounding and differences may leave
_INSTANT = 1e-5  # of a pole: the same in a state that moves, where rates of directions are right to 1e-7


class Channel(NamedTuple):
    """An input or output, and its unit."""

    name: str
    unit: str


class Mode(NamedTuple):
    """A pole with its motion.

    Attributes
    ----------
    pole : complex
        [1/s]; of a pair the one above.
    shape : (n,) complex array
        Of the coordinates, the largest displacement 1 m.
    seen : (p,) complex array
        Of the outputs.
    moves : str
        The coordinate that moves farthest.
    """

    pole: complex
    shape: Array
    seen: Array
    moves: str

    @property
    def damped_frequency_hz(self) -> float:
        """Of what is heard."""
        return self.pole.imag / (2 * np.pi)

    @property
    def frequency_hz(self) -> float:
        """Without damping."""
        return abs(self.pole) / (2 * np.pi)

    @property
    def damping_ratio(self) -> float:
        """Negative where it grows; 0 at rest."""
        return 0.0 - self.pole.real / abs(self.pole) if self.pole else 0.0


@dataclass(frozen=True)
class LinearModel:
    """Small motions of a mechanism about a state, with inputs u and outputs y.

        M z̈ + D ż + K z = F₀ ∫∫u + F₁ ∫u + F₂ u,    ẋ = A x + B u,    y = C x + D u

    z are f coordinates that conditions of loops and nodes leave, x = (z, ż) and, of every input that is the
    acceleration of a prescribed or wanted motion, its place, then its rate.

    Attributes
    ----------
    scene : str
    at : str
        The state.
    time : float
        [s]
    inputs, outputs : tuple of Channel
    mass, damping, stiffness : (f, f) arrays
        Of the mechanism; damping with gyroscopic forces, stiffness with all that forces change with the place.
    ways : (n, f) array
        N: coordinates of the mechanism move by N z.
    coordinates : tuple of str
        (n,) names.
    metres : (n,) array
        Displacement per unit of each coordinate [m].
    forces : (3, f, r) array
        What every input does to the coordinates by its place, by its rate, and by itself; a force does by itself alone.
    seen : (3, p, f) array
        Outputs per unit of z, ż and z̈.
    through : (3, p, r) array
        Outputs per unit of ∫∫u, ∫u and u.
    moved : (r,) bool array
        Which inputs are accelerations of motions.
    values : (p,) array
        Outputs in the state itself.
    steady : bool
        Whether the mechanism is at rest, but for joints that move evenly as prescribed, so that the model holds for
        longer than the instant.
    warnings : tuple of str
    """

    scene: str
    at: str
    time: float
    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]
    mass: Array
    damping: Array
    stiffness: Array
    ways: Array
    coordinates: tuple[str, ...]
    metres: Array
    forces: Array
    seen: Array
    through: Array
    moved: Array
    values: Array
    steady: bool
    warnings: tuple[str, ...] = ()

    @property
    def size(self) -> int:
        """Number of coordinates f."""
        return len(self.mass)

    @cached_property
    def states(self) -> tuple[str, ...]:
        """Names of x."""
        own = self.coordinates if self.ways.shape[0] == self.size else [f"z{k + 1}" for k in range(self.size)]
        motions = [self.inputs[k].name.removesuffix(".acceleration") for k in np.flatnonzero(self.moved)]
        return (
            *own,
            *(f"rate of {name}" for name in own),
            *(f"motion of {name}" for name in motions),
            *(f"rate of the motion of {name}" for name in motions),
        )

    @cached_property
    def _solved(self) -> tuple[Array, Array, Array]:
        """M⁻¹ of stiffness, damping and forces."""
        try:
            factor = la.cho_factor((self.mass + self.mass.T) / 2, check_finite=False)
        except la.LinAlgError:
            raise SimulationError(
                Cause.SINGULAR_MASS,
                "a motion that nothing resists has no place in a state-space model",
                where=self.at,
                remedy="give every moving part a mass and a moment of inertia",
            ) from None
        stiff, damped = (la.cho_solve(factor, part, check_finite=False) for part in (self.stiffness, self.damping))
        pushed = [la.cho_solve(factor, part, check_finite=False) for part in self.forces]
        return stiff, damped, np.array(pushed).reshape(self.forces.shape)

    @cached_property
    def _accelerations(self) -> tuple[Array, Array]:
        """(f, states) and (f, r): z̈ of states and inputs."""
        stiff, damped, pushed = self._solved
        motion = pushed[:2][:, :, self.moved]
        return np.hstack([-stiff, -damped, motion[0], motion[1]]), pushed[2]

    @cached_property
    def A(self) -> Array:
        """(s, s) of the states."""
        f, k = self.size, int(self.moved.sum())
        result = np.zeros((2 * (f + k),) * 2)
        result[:f, f : 2 * f] = np.eye(f)
        result[f : 2 * f] = self._accelerations[0]
        result[2 * f : 2 * f + k, 2 * f + k :] = np.eye(k)
        return result

    @cached_property
    def B(self) -> Array:
        """(s, r) of the inputs."""
        f, k = self.size, int(self.moved.sum())
        result = np.zeros((2 * (f + k), len(self.inputs)))
        result[f : 2 * f] = self._accelerations[1]
        result[2 * f + k :][np.arange(k), np.flatnonzero(self.moved)] = 1.0
        return result

    @cached_property
    def C(self) -> Array:
        """(p, s) of the states."""
        direct = np.hstack([self.seen[0], self.seen[1], self.through[0][:, self.moved], self.through[1][:, self.moved]])
        return np.asarray(direct + self.seen[2] @ self._accelerations[0])

    @cached_property
    def D(self) -> Array:
        """(p, r) of the inputs."""
        return np.asarray(self.through[2] + self.seen[2] @ self._accelerations[1])

    @cached_property
    def modes(self) -> tuple[Mode, ...]:
        """Of the mechanism, slow ones first, and each pair once; integrators of motions are not among them."""
        poles, shapes = small_modes(Linearization(self.mass, self.damping, self.stiffness, self.ways))
        found = []
        for pole, z in zip(poles.tolist(), shapes.T, strict=True):
            if pole.imag < 0:
                continue
            moved = self.ways @ z
            metres = self.metres * np.abs(moved)
            far = int(metres.argmax())
            scale = moved[far] * self.metres[far] or 1.0
            seen = (self.seen[0] + pole * self.seen[1] + pole**2 * self.seen[2]) @ z
            found.append(Mode(pole, moved / scale, seen / scale, self.coordinates[far]))
        return tuple(sorted(found, key=lambda mode: (abs(mode.pole), -mode.pole.real)))

    @property
    def poles(self) -> Array:
        """(2 f,) complex, of the mechanism [1/s]."""
        own = [(mode.pole,) if not mode.pole.imag else (mode.pole, mode.pole.conjugate()) for mode in self.modes]
        return np.array([pole for pair in own for pole in pair], dtype=complex)

    @property
    def unstable(self) -> tuple[Mode, ...]:
        """Modes that grow, by more than noise."""
        return tuple(mode for mode in self.modes if mode.pole.real > 0 and not self.noise(mode.pole))

    def noise(self, pole: complex) -> bool:
        """Whether the real part of a pole is no more than what rounding and differences make: it neither grows nor
        decays, as far as the model tells.
        """
        return abs(pole.real) <= max(_ZERO * self._fastest, 0.0 if self.steady else _INSTANT * abs(pole))

    @cached_property
    def _fastest(self) -> float:
        return float(np.abs(self.poles).max(initial=0.0))

    def part(
        self, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None
    ) -> tuple[IntArray, IntArray]:
        """Numbers of inputs and of outputs, all unless given.

        Raises
        ------
        SceneError
            BAD_REFERENCE.
        """
        found = []
        for what, asked, known in (("input", inputs, self.inputs), ("output", outputs, self.outputs)):
            names = [channel.name for channel in known]
            wanted = names if asked is None else checked(what, asked, names)
            found.append(np.array([names.index(name) for name in wanted], dtype=np.int64))
        return found[0], found[1]

    def zeros(self, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None) -> Array:
        """(k,) complex transmission zeros [1/s] between inputs and outputs, all unless given.

        At a zero s the pencil [A - s, B; C, D] loses rank: some motion of the inputs is not seen at any of the outputs,
        or some combination of the outputs is not moved by any of the inputs. More of one than of the other have few
        zeros or none. Left out are those on poles, of modes that these inputs do
        not move or these outputs do not see, and those beyond 1e4 times the fastest pole, which count as infinite.

        Raises
        ------
        SceneError
            BAD_FIELD: no inputs, or no outputs; BAD_REFERENCE: there is no such input or output.
        """
        own, seen = self.part(inputs, outputs)
        if not len(own) or not len(seen):
            message, remedy = "zeros are those from inputs to outputs", "name one of each at least"
            where = "outputs" if len(own) else "inputs"
            raise SceneError(Cause.BAD_FIELD, message, where=where, value=0, limit=1, remedy=remedy)
        found = transmission_zeros(self.A, self.B[:, own], self.C[seen], self.D[np.ix_(seen, own)])
        return off_poles(found, self.poles)

    def state_space(self) -> Any:
        """As a `scipy.signal.StateSpace`."""
        from scipy.signal import StateSpace

        return StateSpace(self.A, self.B, self.C, self.D)

    def control(self) -> Any:
        """As a ``control.StateSpace`` of the package python-control, whose names have ``_`` in place of dots.

        Raises
        ------
        SceneError
            BAD_FIELD: the package is not there.
        """
        control = optional_package("control", "LinearModel.control")
        own = ([c.name for c in self.inputs], [c.name for c in self.outputs], self.states)
        inputs, outputs, states = ([name.replace(".", "_") for name in names] for names in own)
        return control.ss(self.A, self.B, self.C, self.D, inputs=inputs, outputs=outputs, states=states)
