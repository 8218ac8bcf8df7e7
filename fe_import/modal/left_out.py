"""Displacement fields that a reduced link leaves out, and the link with them.

A reduced link is the finite-element model over some fields. What it leaves out follows its loads nearly statically, so
the fields that matter are the static answers of the full model to what loads a link in motion, less those of the
reduced one: `fe_import.reduction.left_out` finds them. They stand beside the modes as more coordinates, orthogonal to
them and to each other in strain energy, orthonormal among themselves in mass; the mass couples them to the modes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fe_import.modal.inertia import InertiaInvariants
from fe_import.modal.model import ModalModel
from fe_import.modal.second_order import SecondOrder, pair_numbers
from fe_import.model import Array, IntArray

LEFT_OUT = "left out"  # kind of these coordinates


@dataclass(frozen=True)
class LeftOut:
    """What a reduced link with m modal coordinates leaves out: x fields.

    Attributes
    ----------
    stiffness : (x,) array
        Squared frequencies of the fields by themselves, rising [1/s²].
    translation_shapes : (n, 3, x) array
        Displacement of each node of the modal model per unit coordinate [1/√kg].
    rotation_shapes : (k, 3, x) array
        Rotation of its ``rotation_nodes`` [rad/(m √kg)].
    thermal : (x,) array
        Generalized force of thermal expansion per kelvin; zero unless the link's temperature changes.
    invariants : InertiaInvariants
        Of the modes and the fields, m + x coordinates, from the mass matrix of the finer model.
    refined : bool
        Whether that model has a finer mesh, so that the fields hold what the mesh leaves out, too.
    """

    stiffness: Array
    translation_shapes: Array
    rotation_shapes: Array
    thermal: Array
    invariants: InertiaInvariants
    refined: bool

    @property
    def fields(self) -> int:
        """Number x of fields."""
        return len(self.stiffness)


def extended(model: ModalModel, left: LeftOut, nodes: IntArray) -> ModalModel:
    """A modal model with the fields that it leaves out as further elastic coordinates, linear ones without damping.

    Parameters
    ----------
    model : ModalModel
        The reduced link.
    left : LeftOut
        What it leaves out.
    nodes : (k,) int array
        Where second-order displacements are wanted, beside the interfaces.
    """
    count = left.fields
    shapes = (model.translation_shapes, left.translation_shapes), (model.rotation_shapes, left.rotation_shapes)
    none = np.zeros(count)
    stiffness = np.diag(np.concatenate([np.zeros(model.modes), left.stiffness]))
    stiffness[: model.modes, : model.modes] = model.stiffness
    thermal = model.thermal
    return replace(
        model,
        translation_shapes=np.concatenate(shapes[0], axis=2),
        rotation_shapes=np.concatenate(shapes[1], axis=2),
        stiffness=stiffness,
        invariants=left.invariants,
        frequencies_hz=np.concatenate([model.frequencies_hz, np.sqrt(left.stiffness) / (2 * np.pi)]),
        kinds=model.kinds + (LEFT_OUT,) * count,
        damping_ratios=np.concatenate([model.damping_ratios, none]),
        residuals=np.concatenate([model.residuals, none]),
        recovery=None,
        second_order=None if model.second_order is None else _padded(model, model.second_order, count, nodes),
        thermal=None if thermal is None else replace(thermal, force=np.concatenate([thermal.force, left.thermal])),
    )


def _padded(model: ModalModel, field: SecondOrder, count: int, nodes: IntArray) -> SecondOrder:
    """The field of some nodes, zero for pairs with coordinates that are left out."""
    wanted = np.isin(field.nodes, [*nodes, *(i.node for i in model.interface_nodes)])
    before, after = model.elastic_modes, model.elastic_modes + count
    pairs = pair_numbers(after)[:before, :before][np.triu_indices(before)]

    def of_pairs(values: Array) -> Array:
        result = np.zeros((int(wanted.sum()), 3, after * (after + 1) // 2))
        result[:, :, pairs] = values[wanted]
        return result

    def of_modes(values: Array, *leading: int) -> Array:
        result = np.zeros((*leading, 6 + after, 6 + after))
        result[..., : 6 + before, : 6 + before] = values
        return result

    modal = np.zeros((after, 6 + after, 6 + after))
    modal[:before, : 6 + before, : 6 + before] = field.modal
    return SecondOrder(
        reference=field.reference,
        momentum=of_modes(field.momentum, 6),
        spin=of_modes(field.spin, 3, 3),
        modal=modal,
        nodes=field.nodes[wanted],
        translation=of_pairs(field.translation),
        rotation=of_pairs(field.rotation),
    )
