"""A family of reduced links: what it is made of, and a modal model of any of its members."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fe_import.description.link import LinkFile
from fe_import.errors import Cause, FEImportError
from fe_import.files.toml import choose
from fe_import.modal.damping import damping_ratios
from fe_import.modal.inertia import InertiaInvariants, mass_properties
from fe_import.modal.model import HealthCheck, ModalModel
from fe_import.model import Array, IntArray
from fe_import.parametric.held import HeldFigures, reduced_figures
from fe_import.parametric.interpolation import Arrays, Interpolant
from fe_import.parametric.samples import Z_PAIRS
from fe_import.reduction.base import Basis, no_fixed_interface_modes
from fe_import.reduction.modes import orthonormal_modes

ACCURACY = 1e-3
"""Of frequencies and flexibility of the link held at its inboard interface, as shares."""

_FOR_FIGURES = {"stiffness", "mass", "nodes", "moving"}


@dataclass(frozen=True)
class Bound:
    """Largest errors of a family in its whole range, as shares: three times those found.

    Attributes
    ----------
    frequencies : float
        Of the lowest `fe_import.parametric.held.PROMISED` with the inboard interface held.
    flexibility : float
        Static, of the other interfaces.
    places : int
        At how many that gave nothing to the family they were looked for, besides its corners, or 32 of them.
    """

    frequencies: float
    flexibility: float
    places: int


@dataclass(frozen=True)
class ParametricModel:
    """A family of links, reduced on one basis.

    Attributes
    ----------
    link : LinkFile
        The description, with its parameters.
    middle : ModalModel
        The member in the middle of all ranges, reduced by itself.
    translation_shapes, rotation_shapes : (nodes, 3, k), (turning nodes, 3, k) arrays
        Of the elastic fields of the basis, in the middle.
    moving : int array
        Rows of both, one after the other, that change with the parameters.
    grid : Interpolant
        Of the arrays of `fe_import.parametric.samples.Samples.arrays`; ``nodes`` and ``moving`` only where they change.
    bound : Bound
    """

    link: LinkFile
    middle: ModalModel
    translation_shapes: Array
    rotation_shapes: Array
    moving: IntArray
    grid: Interpolant
    bound: Bound

    @property
    def names(self) -> tuple[str, ...]:
        """Of the parameters."""
        return tuple(self.link.description.parameters)

    @cached_property
    def inboard(self) -> int:
        """Number of the inboard interface."""
        name = self.link.description.reduction.inboard
        return [i.name for i in self.middle.interface_nodes].index(name) if name else 0

    def summary(self) -> dict[str, Any]:
        """The JSON of ``erls reduce --parametric`` without what only the command knows."""
        description = self.link.description
        return {
            "link": self.middle.name,
            "parameters": {name: [p.lower, p.upper] for name, p in description.parameters.items()},
            "fields": self.translation_shapes.shape[2],
            "samples": self.grid.count,
            "bound": {"frequencies": self.bound.frequencies, "flexibility": self.bound.flexibility},
            "places": self.bound.places,
            "frequencies_hz": (self.figures({}).omega / (2 * np.pi)).tolist(),
            "healthy": all(check.ok for check in self.middle.health),
        }

    def place(self, values: Mapping[str, float]) -> Array:
        """(n,) values of the parameters in order; those not named in the middle of their ranges.

        Raises
        ------
        FEImportError
            No such parameter, or a value out of its range.
        """
        where, given = str(self.link.path), self.link.description.parameters
        for name in values:
            choose(name, given, f"{where}: parameters")
        result = []
        for name, parameter in given.items():
            value = values.get(name, (parameter.lower + parameter.upper) / 2)
            if not parameter.lower <= value <= parameter.upper:
                raise FEImportError(
                    Cause.BAD_FIELD,
                    "out of the range that the family was made for",
                    where=f"{where}: parameters.{name}",
                    value=value,
                    limit=f"{parameter.lower} to {parameter.upper}",
                    remedy="choose a value within, or make the family anew with another range",
                )
            result.append(float(value))
        return np.array(result)

    def figures(self, values: Mapping[str, float]) -> HeldFigures:
        """Frequencies and flexibility of a member that is held at its inboard interface."""
        arrays = self.grid.values(self.place(values), _FOR_FIGURES)
        return reduced_figures(arrays["mass"], arrays["stiffness"], self.interfaces(arrays), self.inboard)

    def slopes(self, values: Mapping[str, float], name: str) -> tuple[Array, Arrays]:
        """Derivatives by a parameter: of the frequencies of `figures` [rad/s], and of all arrays of the basis.

        Those of frequencies hold where these are apart.
        """
        place = self.place(values)
        choose(name, self.names, f"{self.link.path}: parameters")
        arrays, slopes = self.grid.values(place, _FOR_FIGURES), self.grid.slopes(place, self.names.index(name))
        interfaces = self.interfaces(arrays)
        found = reduced_figures(arrays["mass"], arrays["stiffness"], interfaces, self.inboard)
        modes = found.fields[:, : len(found.omega)]
        root = slice(6 * self.inboard, 6 * self.inboard + 6)
        # the rigid motion that keeps the interface at rest changes with places: R_0 r + W_0 y = 0
        turning = np.zeros_like(modes)
        change = self.interfaces(slopes, slope=True) if slopes.keys() & {"nodes", "moving"} else None
        if change is not None:
            turning[:6] = -np.linalg.solve(interfaces[root, :6], change[root] @ modes)
        stiffness = np.einsum("km,kl,lm->m", modes[6:], slopes["stiffness"], modes[6:])
        mass = np.einsum("km,kl,lm->m", modes, slopes["mass"], modes)
        mass += 2 * np.einsum("km,kl,lm->m", turning, arrays["mass"], modes)
        return (stiffness - found.omega**2 * mass) / (2 * found.omega), slopes

    def at(self, values: Mapping[str, float]) -> ModalModel:
        """The modal model of a member.

        Its modes are those of the common basis, as many as the description keeps, or all of them. Second-order
        displacements, stress and section forces it has none of.

        Parameters
        ----------
        values : mapping of str to float
            By the names of parameters; those not named are in the middle of their ranges.

        Examples
        --------
        >>> from fe_import import reduce_parametric
        >>> family = reduce_parametric("data/parametric/links/tube.toml")
        >>> round(family.at({"wall": 0.0021}).mass_properties.mass, 4)
        0.2485
        """
        place, description = self.place(values), self.link.description
        arrays, middle, where = self.grid.values(place), self.middle, str(self.link.path)
        translation, rotation, nodes = self._shapes(arrays)
        flat = np.concatenate([translation.reshape(-1, translation.shape[2]), rotation.reshape(-1, rotation.shape[2])])
        rigid = np.vstack([np.eye(6), np.zeros((flat.shape[1] - 6, 6))])
        stiffness = np.zeros_like(arrays["mass"])
        stiffness[6:, 6:] = arrays["stiffness"]
        basis = Basis(flat, 0, rigid, no_fixed_interface_modes())
        interfaces = self.interfaces(arrays)
        modes = orthonormal_modes(
            arrays["mass"], stiffness, basis, description.reduction, interfaces, where, self.inboard
        )
        turn, omega = modes.coordinates, modes.omega
        z = np.empty((3, 3, len(omega), len(omega)))
        for (a, b), part in zip(Z_PAIRS, arrays["Z"], strict=True):
            z[a, b] = turn.T @ part @ turn
            z[b, a] = z[a, b].T
        mass = turn.T @ arrays["mass"] @ turn
        invariants = InertiaInvariants((mass + mass.T) / 2, turn.T @ arrays["X"] @ turn, z, modes.rigid)
        return replace(
            middle,
            nodes=nodes,
            translation_shapes=translation @ turn,
            rotation_shapes=rotation @ turn,
            interface_nodes=tuple(replace(i, position=nodes[i.node]) for i in middle.interface_nodes),
            stiffness=np.diag(omega**2),
            invariants=invariants,
            frequencies_hz=omega / (2 * np.pi),
            kinds=("rigid-body",) * 6 + ("elastic",) * (len(omega) - 6),
            damping_ratios=damping_ratios(description.damping, omega, where),
            residuals=np.zeros(len(omega)),
            full_mass_properties=mass_properties(arrays["mass"][:6, :6]),
            fixed_interface=no_fixed_interface_modes(),
            health=(*self._promise(), *(replace(c, name=f"{c.name} (middle of the family)") for c in middle.health)),
            provenance={**middle.provenance, **self._said(place)},
            second_order=None,
            recovery=None,
            thermal=None,
        )

    def interfaces(self, arrays: Arrays, slope: bool = False) -> Array:
        """(6 n, 6 + k) displacements and rotations of the interfaces; with ``slope`` derivatives of them, of
        those of ``arrays``."""
        translation, rotation, _ = self._shapes(arrays, slope)
        turning = np.searchsorted(self.middle.rotation_nodes, [i.node for i in self.middle.interface_nodes])
        parts = [
            part
            for i, t in zip(self.middle.interface_nodes, turning, strict=True)
            for part in (translation[i.node], rotation[t])
        ]
        return np.concatenate(parts)

    def _shapes(self, arrays: Arrays, slope: bool = False) -> tuple[Array, Array, Array]:
        """(nodes, 3, 6 + k) displacements, (turning, 3, 6 + k) rotations of the basis, and (nodes, 3) nodes; with
        ``slope`` derivatives."""
        one = 0.0 if slope else 1.0
        nodes = arrays.get("nodes", one * self.middle.nodes)
        translation, rotation = one * self.translation_shapes, one * self.rotation_shapes
        if "moving" in arrays:
            flat = np.concatenate(
                [translation.reshape(-1, translation.shape[2]), rotation.reshape(-1, rotation.shape[2])]
            )
            flat[self.moving] = arrays["moving"]
            border = translation.shape[0] * 3
            translation, rotation = flat[:border].reshape(translation.shape), flat[border:].reshape(rotation.shape)
        moved = np.zeros((len(nodes), 3, 6))
        moved[:, :, :3] = one * np.eye(3)
        moved[:, :, 3:] = np.stack([np.cross(e, nodes) for e in np.eye(3)], axis=-1)
        turned = np.zeros((len(rotation), 3, 6))
        turned[:, :, 3:] = one * np.eye(3)
        return np.concatenate([moved, translation], axis=2), np.concatenate([turned, rotation], axis=2), nodes

    def _promise(self) -> tuple[HealthCheck, ...]:
        return (
            HealthCheck("frequencies of the family, held at its inboard interface", self.bound.frequencies, ACCURACY),
            HealthCheck("static flexibility of the family", self.bound.flexibility, ACCURACY),
        )

    def _said(self, place: Array) -> dict[str, str]:
        lack = "not available: the member of a family"
        values = dict(zip(self.names, place.tolist(), strict=True))
        return {"parameters": json.dumps(values), "second_order": lack, "residuals": lack}
