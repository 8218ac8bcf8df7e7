"""What a modal model holds of the second-order kinematics of its link."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fe_import.model import Array, IntArray


@dataclass(frozen=True)
class SecondOrder:
    """Second-order field of a link with m modal coordinates, n of them elastic; p = n (n + 1) / 2 pairs.

    In a frame that turns with ω the momentum and the angular momentum about its origin gain

        Ṡ + ω × S,   qᵀ P q̇ + ½ (qᵀ W q) ω,   S = ½ qᵀ S_ab q,

    and weight the potential -g·S. Against the velocities of the linear modes φ themselves it adds q̇_c K_cab q_a q̇_b.

    Attributes
    ----------
    reference : int
        Interface whose displacement and rotation are linear in q.
    momentum : (6, m, m) array
        S_ab = ∫ρ Ψ (symmetric), then P = ∫ρ x × Ψ with the turning of cross sections, which makes it unsymmetric.
    spin : (3, 3, m, m) array
        W; axis of the angular momentum, axis of ω, symmetric in the modes.
    modal : (n, m, m) array
        K_cab = ∫ρ φ_c·Ψ_ab of elastic modes c with the turning of cross sections.
    nodes : (k,) int array
        Rising; those with a stored field.
    translation, rotation : (k, 3, p) arrays
        Ψ of their displacements and rotation vectors, relative to the reference, for the pairs a ≤ b of elastic
        coordinates; rotations are zero where a node has none.
    """

    reference: int
    momentum: Array
    spin: Array
    modal: Array
    nodes: IntArray
    translation: Array
    rotation: Array

    def truncated(self, modes: IntArray) -> SecondOrder:
        """The field of some of the modes (the six rigid-body ones first), in the given order."""
        elastic = np.asarray(modes)[6:] - 6
        number = pair_numbers(self.momentum.shape[1] - 6)
        first, second = np.triu_indices(len(elastic))
        pairs = number[elastic[first], elastic[second]]
        rows, columns = np.ix_(modes, modes)
        return replace(
            self,
            momentum=np.ascontiguousarray(self.momentum[:, rows, columns]),
            spin=np.ascontiguousarray(self.spin[:, :, rows, columns]),
            modal=np.ascontiguousarray(self.modal[np.ix_(elastic, modes, modes)]),
            translation=np.ascontiguousarray(self.translation[:, :, pairs]),
            rotation=np.ascontiguousarray(self.rotation[:, :, pairs]),
        )


def pair_numbers(count: int) -> IntArray:
    """(n, n) number of each pair of coordinates, a ≤ b counted row by row."""
    first, second = np.triu_indices(count)
    result = np.empty((count, count), dtype=np.int64)
    result[first, second] = result[second, first] = np.arange(len(first))
    return result
