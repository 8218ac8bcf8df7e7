"""One basis for a box of parameters: fields of a link at those places where the basis is worst, until none is bad."""

from __future__ import annotations

import itertools

import numpy as np
import scipy.linalg as la

from fe_import.errors import Cause, FEImportError
from fe_import.model import Array, FEModel
from fe_import.parametric.held import HeldFigures, exact_figures, reduced_figures
from fe_import.parametric.samples import Samples
from fe_import.reduction import REDUCTIONS
from fe_import.reduction.base import expanded
from fe_import.solver.watch import say

MOST_FIELDS = 200
_MOST_CORNERS = 32
_NEW = 0.01  # of the energy of a field, its root: what is left of smaller ones changes frequencies by 1e-4 / 2


def training_places(lower: Array, upper: Array) -> Array:
    """(p, n) corners of the box (some of them, where there are many) and centres of its faces."""
    count = len(lower)
    if 2**count <= _MOST_CORNERS:
        corners = np.array(list(itertools.product((-1.0, 1.0), repeat=count)))
    else:
        corners = np.random.default_rng(0).choice((-1.0, 1.0), (_MOST_CORNERS, count))
    x = np.concatenate([corners, np.eye(count), -np.eye(count)])
    return np.asarray((lower + upper) / 2 + x * (upper - lower) / 2)


class CommonBasis:
    """Elastic fields over the independent dofs.

    Parameters
    ----------
    samples : Samples
    inboard : int
        The interface that is held in what is promised.
    """

    def __init__(self, samples: Samples, inboard: int) -> None:
        self.samples, self.inboard = samples, inboard
        self.exact: dict[bytes, HeldFigures] = {}
        middle, link = samples.middle, samples.link
        self.fields: Array = np.zeros((len(middle.independent), 0))
        options = link.description.reduction
        self.add(middle, REDUCTIONS[options.method](middle, options, str(link.path)).vectors[middle.independent])
        self.add(middle, self.figures((samples.bounds[0] + samples.bounds[1]) / 2).fields)

    def figures(self, place: Array) -> HeldFigures:
        """Exact ones."""
        key = place.tobytes()
        if key not in self.exact:
            self.exact[key] = exact_figures(self.samples.model(place), self.inboard)
        return self.exact[key]

    def errors(self, place: Array) -> tuple[float, float]:
        """Of the basis alone, with the matrices of this place."""
        model = self.samples.model(place)
        fields = expanded(model, self.fields)
        basis = np.hstack([model.rigid_body_modes(), fields])
        mass, stiffness = basis.T @ (model.mass @ basis), fields.T @ (model.stiffness @ fields)
        return self.figures(place).errors(
            reduced_figures(mass, (stiffness + stiffness.T) / 2, basis[model.interface_dofs], self.inboard)
        )

    def add(self, model: FEModel, fields: Array) -> int:
        """Take what is new of fields (f, k) of a model into the basis; how many that are.

        What is new is measured by the energy in that model: in another shape of the link, what only bends there
        stretches.
        """
        mass, stiffness = model.reduced_matrices()
        rigid = model.rigid_body_modes()[model.independent]
        forces = mass @ rigid
        fields = fields - rigid @ np.linalg.solve(rigid.T @ forces, forces.T @ fields)
        size = np.sqrt(np.einsum("fk,fk->k", fields, stiffness @ fields).clip(min=0.0))
        fields = fields[:, size > 1e-6 * size.max()] / size[size > 1e-6 * size.max()]
        if self.fields.shape[1]:
            weighted = stiffness @ self.fields
            scale = 1 / np.sqrt(np.einsum("fk,fk->k", self.fields, weighted))
            gram = la.cho_factor(scale[:, None] * (self.fields.T @ weighted) * scale)
            for _ in range(2):  # once more against rounding
                fields = fields - self.fields @ (
                    scale[:, None] * la.cho_solve(gram, scale[:, None] * (weighted.T @ fields))
                )
        squared, ways = la.eigh(fields.T @ (stiffness @ fields))
        new = squared > _NEW**2
        self.fields = np.hstack([self.fields, fields @ (ways[:, new] / np.sqrt(squared[new]))])
        if self.fields.shape[1] > MOST_FIELDS:
            raise FEImportError(
                Cause.BAD_FIELD,
                f"one basis for all values of the parameters would need more than {MOST_FIELDS} fields",
                where=f"{self.samples.link.path}: parameters",
                value=self.fields.shape[1],
                limit=MOST_FIELDS,
                remedy="narrow the ranges, or have fewer parameters",
            )
        return int(new.sum())

    def enrich(self, places: Array, wanted: float) -> None:
        """Add exact fields of the worst place until the errors at all of them are as wanted."""
        while True:
            worst = [max(self.errors(place)) for place in places]
            at = int(np.argmax(worst))
            say(f"common basis of {self.fields.shape[1]} fields: off by {worst[at]:.1e} at most")
            if worst[at] <= wanted or not self.add(self.samples.model(places[at]), self.figures(places[at]).fields):
                return
