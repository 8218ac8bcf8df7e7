"""Links of a mechanism: a modal model placed on the Denavit-Hartenberg frames, payloads included."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
import scipy.linalg as la

from erls.maths.se3 import pose, twist_transform
from erls.maths.so3 import Array, skew
from erls.mechanism.second_order import LinkSecondOrder, link_second_order
from fe_import.description.records import LinkDescription
from fe_import.elements.link_shells import LinkShells
from fe_import.modal.inertia import InertiaInvariants, MassProperties, mass_properties
from fe_import.modal.model import FixedInterfaceModes, ModalModel
from fe_import.model import InterfaceNode, Surface

T = TypeVar("T")
_MOST_KNOWN = 64  # findings that a link remembers: what varies with every variant must not pile up


@dataclass(frozen=True)
class Payload:
    """A rigid body on a node of a link: centre of mass from the node (3,) [m], mass [kg], and inertia (3, 3) about the
    centre [kg m²], all in mesh axes; ``motor``: it is the motor of the joint that sits there.
    """

    node: int
    offset: Array
    mass: float
    inertia: Array
    motor: bool = False


@dataclass(frozen=True)
class Link:
    """A link in its mesh frame: what the equations of motion need.

    Attributes
    ----------
    name : str
    model : ModalModel
        In orthonormal form, truncated to the modes in use.
    invariants : InertiaInvariants
        Payloads included.
    inboard : InterfaceNode
        Where its own joint sits.
    stiffness : (n,) array
        Squared frequencies of the elastic modes [1/s²].
    damping : (n,) array
        Coefficients of the elastic modes [1/s].
    payloads : tuple of Payload
        Already within ``invariants``.
    description : LinkDescription or None
        Of a link made of beams, for formulations with elements of their own.
    shells : LinkShells or None
        Likewise of one made of shells.
    pieces : tuple of Link
        Substructures that a modal formulation solves for instead, without payloads; empty for a link in one piece.
    intermediate : bool
        Whether it is nothing but a place between two motions of one joint.
    """

    name: str
    model: ModalModel
    invariants: InertiaInvariants
    inboard: InterfaceNode
    stiffness: Array
    damping: Array
    payloads: tuple[Payload, ...] = ()
    description: LinkDescription | None = None
    shells: LinkShells | None = None
    pieces: tuple[Link, ...] = ()
    intermediate: bool = False

    @property
    def elastic_modes(self) -> int:
        """Number of elastic coordinates."""
        return len(self.stiffness)

    @cached_property
    def size(self) -> float:
        """From corner to corner of the box around its nodes [m]."""
        return float(np.linalg.norm(np.ptp(self.model.nodes, axis=0)))

    @cached_property
    def second_order(self) -> LinkSecondOrder | None:
        """Second-order kinematics relative to the inboard interface; None where the modal model holds none."""
        return link_second_order(self)

    def once(self, key: Hashable, find: Callable[[], T]) -> T:
        """What was found of this link before, of the last few keys: variants of a scene share links.

        Parameters
        ----------
        key : hashable
            Names what is found, and all that it depends on beside the link.
        find : callable
            What it gives is not changed by anybody.
        """
        known = self._known
        if (before := known.get(key)) is not None:  # threads share links, and may remove it
            found: T = before
            return found
        while len(known) >= _MOST_KNOWN:
            known.pop(next(iter(known)), None)
        return known.setdefault(key, find())  # type: ignore[no-any-return]

    @cached_property
    def _known(self) -> dict[Hashable, Any]:
        return {}

    def interface_shape(self, interface: InterfaceNode, frame: Array) -> Array:
        """(6, m) displacement and rotation of a frame that moves rigidly with an interface, per modal coordinate.

        Parameters
        ----------
        interface : InterfaceNode
        frame : (4, 4) array
            Undeformed pose of that frame in the mesh frame; the result is in its axes.
        """
        shape = np.vstack(node_shape6(self.model, interface.node))
        arm = pose(position=-interface.position) @ frame
        return np.asarray(twist_transform(arm) @ shape)


def node_shape6(model: ModalModel, node: int) -> tuple[Array, Array]:
    """(3, m) displacement and (3, m) rotation of a node; zeros where it has no rotation."""
    translation, rotation = model.node_shape(node)
    return translation, np.zeros_like(translation) if rotation is None else rotation


def truncated(model: ModalModel, elastic_modes: int) -> ModalModel:
    """A modal model with only its lowest elastic modes."""
    keep = np.arange(6 + elastic_modes)
    return replace(
        model,
        translation_shapes=model.translation_shapes[:, :, keep],
        rotation_shapes=model.rotation_shapes[:, :, keep],
        stiffness=model.stiffness[np.ix_(keep, keep)],
        invariants=model.invariants.truncated(keep),
        frequencies_hz=model.frequencies_hz[keep],
        kinds=model.kinds[: 6 + elastic_modes],
        damping_ratios=model.damping_ratios[keep],
        residuals=model.residuals[keep],
        recovery=None if model.recovery is None else model.recovery.truncated(keep),
        second_order=None if model.second_order is None else model.second_order.truncated(keep),
        thermal=None if model.thermal is None else model.thermal.truncated(keep),
    )


_TURNS = np.stack([skew(e) for e in np.eye(3)])


def payload_invariants(model: ModalModel, node: int, offset: Array, mass: float, inertia: Array) -> InertiaInvariants:
    """Invariants of a rigid body on a node.

    Parameters
    ----------
    model : ModalModel
    node : int
    offset : (3,) array
        Centre of mass from the node, mesh axes [m].
    mass : float
        [kg]
    inertia : (3, 3) array
        About the payload's centre of mass, mesh axes [kg m²].
    """
    translation, rotation = node_shape6(model, node)
    shape = np.vstack([translation - skew(offset) @ rotation, rotation])
    weight = np.zeros((6, 6))
    weight[:3, :3], weight[3:, 3:] = mass * np.eye(3), inertia
    turned = np.concatenate([_TURNS @ shape[:3], _TURNS @ shape[3:]], axis=1)  # (3, 6, m), about each axis
    return InertiaInvariants(
        m=shape.T @ weight @ shape,
        X=shape.T @ weight @ turned,
        Z=(turned.swapaxes(1, 2) @ weight)[:, None] @ turned,
        rigid=model.invariants.rigid,
    )


def rigid_model(
    name: str,
    mass: float,
    centre_of_mass: Array,
    inertia: Array,
    interfaces: Mapping[str, Array],
    surface: Surface | None = None,
) -> ModalModel:
    """A rigid link as a modal model with six rigid-body modes.

    Massless or slender links are legal: directions without inertia are scaled with the link's size instead of mass.

    Parameters
    ----------
    name : str
    mass : float
        [kg]
    centre_of_mass : (3,) array
        In the mesh frame [m].
    inertia : (3, 3) array
        About the centre of mass [kg m²].
    interfaces : mapping of (3,) arrays
        Positions of the interface nodes and other named points, mesh frame [m].
    surface : Surface, optional
        What it is drawn as, instead of lines from point to point.
    """
    nodes = np.stack(list(interfaces.values()))
    c = skew(centre_of_mass)
    moment = mass * c
    mass_matrix = np.block([[mass * np.eye(3), -moment], [moment, inertia - mass * c @ c]])
    size = max(float(np.linalg.norm(np.ptp(nodes, axis=0))), 1e-3)
    norm = mass_matrix
    if np.linalg.eigvalsh(mass_matrix).min() <= 1e-12 * max(mass, 1e-300):
        norm = np.diag([1.0] * 3 + [size**2] * 3)
    factor = np.linalg.cholesky(norm)
    inverse = np.linalg.inv(factor).T  # (6, 6) rigid-body twists of the modes
    translation = np.stack([inverse[:3] - skew(x) @ inverse[3:] for x in nodes])
    rotation = np.repeat(inverse[None, 3:], len(nodes), axis=0)
    turned = [la.block_diag(skew(e), skew(e)) for e in np.eye(3)]
    # the same body as one node at its centre of mass
    shape = np.vstack([inverse[:3] - c @ inverse[3:], inverse[3:]])
    weight = la.block_diag(mass * np.eye(3), inertia)
    names = list(interfaces)
    return ModalModel(
        name=name,
        form="orthonormal",
        nodes=nodes,
        node_names={n: k for k, n in enumerate(names)},
        translation_shapes=translation,
        rotation_nodes=np.arange(len(nodes)),
        rotation_shapes=rotation,
        interface_nodes=tuple(
            InterfaceNode(n, k, nodes[k], np.array([k]), np.ones(1), "node") for k, n in enumerate(names)
        ),
        stiffness=np.zeros((6, 6)),
        invariants=InertiaInvariants(
            m=shape.T @ weight @ shape,
            X=np.stack([shape.T @ weight @ a @ shape for a in turned]),
            Z=np.stack([np.stack([(a @ shape).T @ weight @ b @ shape for b in turned]) for a in turned]),
            rigid=factor.T,
        ),
        frequencies_hz=np.zeros(6),
        kinds=("rigid-body",) * 6,
        damping_ratios=np.zeros(6),
        residuals=np.zeros(6),
        full_mass_properties=MassProperties(mass, centre_of_mass, inertia),
        fixed_interface=FixedInterfaceModes(np.zeros(0), np.zeros((0, 6))),
        health=(),
        lines=np.array([[k, k + 1] for k in range(len(nodes) - 1)], dtype=np.int64).reshape(-1, 2),
        triangles=np.zeros((0, 3), dtype=np.int64),
        provenance={"source": "rigid link of the scene"},
        surface=surface,
    )


def link_mass_properties(link: Link) -> MassProperties:
    """Mass properties with payloads."""
    return mass_properties(link.invariants.rigid_mass_matrix)
