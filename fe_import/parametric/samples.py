"""Models of a link at values of its parameters, and matrices of a common basis there."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fe_import.description.link import LinkFile, with_numbers
from fe_import.errors import Cause, FEImportError
from fe_import.modal.inertia import inertia_invariants
from fe_import.model import Array, FEModel, IntArray
from fe_import.models.model import build_model
from fe_import.parametric.interpolation import Arrays
from fe_import.reduction.base import expanded

_KEPT_ENTRIES = 40_000_000  # of matrices of models kept: half a gigabyte
Z_PAIRS = [(a, b) for a in range(3) for b in range(a, 3)]


@dataclass(frozen=True)
class Samples:
    """Models of a link over the box of its parameters, those made lately kept.

    Attributes
    ----------
    link : LinkFile
    """

    link: LinkFile
    _kept: dict[bytes, FEModel] = field(default_factory=dict)

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Corners of the box, one number a parameter."""
        parameters = self.link.description.parameters.values()
        return np.array([p.lower for p in parameters]), np.array([p.upper for p in parameters])

    @cached_property
    def middle(self) -> FEModel:
        """The model in the middle of the box, whose numbers of dofs all others must have."""
        return build_model(self.described((self.bounds[0] + self.bounds[1]) / 2))

    def described(self, place: Array) -> LinkFile:
        """The description at values (n,)."""
        values: dict[str, float] = {}
        for parameter, value in zip(self.link.description.parameters.values(), place.tolist(), strict=True):
            values |= parameter.fields(value)
        return with_numbers(self.link, values)

    def model(self, place: Array) -> FEModel:
        """The model there.

        Raises
        ------
        FEImportError
            BAD_FIELD: its dofs are others than those in the middle.
        """
        key = place.tobytes()
        if key not in self._kept:
            model, middle = build_model(self.described(place)), self.middle
            same = np.array_equal(model.dof_map, middle.dof_map)
            same = same and np.array_equal(model.independent, middle.independent)
            for one, other in zip(model.interface_nodes, middle.interface_nodes, strict=True):
                same = same and np.array_equal(one.coupled_nodes, other.coupled_nodes)
                same = same and np.allclose(one.weights, other.weights, rtol=1e-9, atol=0.0)
            if not same:
                raise FEImportError(
                    Cause.BAD_FIELD,
                    "a family of links keeps its dofs, and the weights of its averaged interfaces",
                    where=f"{self.link.path}: parameters",
                    value=dict(zip(self.link.description.parameters, place.tolist(), strict=True)),
                    remedy='leave averaged faces and the numbers of nodes as they are, or use coupling = "rigid"',
                )
            while self._kept and sum(m.stiffness.nnz + m.mass.nnz for m in self._kept.values()) > _KEPT_ENTRIES:
                del self._kept[next(iter(self._kept))]
            self._kept[key] = model
        return self._kept[key]

    def arrays(self, place: Array, elastic: Array, moving: IntArray) -> Arrays:
        """Matrices at a place of the basis of unit rigid-body motions and elastic fields over the independent dofs.

        Parameters
        ----------
        place : (n,) array
        elastic : (f, k) array
        moving : int array
            Dofs whose part of the basis changes, as those of faces that are moved: kept as well.

        Returns
        -------
        dict of array
            ``stiffness`` (k, k), ``mass`` (6 + k, 6 + k), ``X`` (3, 6 + k, 6 + k), ``Z`` (6, 6 + k, 6 + k) of
            `Z_PAIRS`, ``nodes`` and ``moving``.
        """
        model = self.model(place)
        fields = expanded(model, elastic)
        basis = np.hstack([model.rigid_body_modes(), fields])
        stiffness = fields.T @ (model.stiffness @ fields)
        rigid = np.vstack([np.eye(6), np.zeros((elastic.shape[1], 6))])
        found = inertia_invariants(model.mass, basis, model.dof_map, rigid)
        return {
            "stiffness": (stiffness + stiffness.T) / 2,
            "mass": found.m,
            "X": found.X,
            "Z": np.stack([found.Z[a, b] for a, b in Z_PAIRS]),
            "nodes": model.nodes,
            "moving": fields[moving],
        }
