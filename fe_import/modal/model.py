"""The modal model of a link: what a reduction gives. Its file is the subject of `fe_import.modal.file`."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fe_import.modal.inertia import InertiaInvariants, MassProperties, mass_properties
from fe_import.modal.recovery_maps import RecoveryMaps
from fe_import.modal.second_order import SecondOrder
from fe_import.modal.thermal import ThermalExpansion
from fe_import.model import Array, IntArray, InterfaceNode, Surface

NO_LIMIT = float(np.finfo(np.float64).max)  # a figure that is reported, not judged; finite, as all in a file
MESH_ERROR = "error of the first frequencies by the mesh"  # begin of the name of the check that estimates it


@dataclass(frozen=True)
class HealthCheck:
    """One check of a reduction: passed when ``value`` does not exceed ``limit``; `NO_LIMIT` only reports."""

    name: str
    value: float
    limit: float

    @property
    def judged(self) -> bool:
        """Whether it has a limit."""
        return self.limit < NO_LIMIT

    @property
    def ok(self) -> bool:
        """Whether the check passed."""
        return bool(self.value <= self.limit)


@dataclass(frozen=True)
class FixedInterfaceModes:
    """Modes with all interfaces clamped: frequencies [Hz] and share of the mass properties that each carries.

    ``effective_mass`` is (k, 6): fraction of the link's mass (x, y, z) and of its inertia about the centre of
    mass (about x, y, z).
    """

    frequencies_hz: Array
    effective_mass: Array


@dataclass(frozen=True)
class ModalModel:
    """A reduced link: mode shapes, reduced matrices, inertia invariants and where they came from.

    Attributes
    ----------
    name : str
    form : str
        ``"orthonormal"`` (6 rigid-body modes, then elastic modes in rising frequency, mass-orthonormal) or
        ``"physical"`` (interface displacements, then fixed-interface modal coordinates; for other programs).
    nodes : (n, 3) array
        Undeformed positions in the mesh frame [m].
    node_names : dict
        Index of nodes that have a name.
    translation_shapes : (n, 3, m) array
        Displacement of each node per unit modal coordinate.
    rotation_nodes : (k,) int array
        Nodes that carry rotations.
    rotation_shapes : (k, 3, m) array
        Their rotations per unit modal coordinate.
    interface_nodes : tuple of InterfaceNode
    stiffness : (m, m) array
        UᵀKU.
    invariants : InertiaInvariants
        Reduced mass (``invariants.m``), first- and second-order terms.
    frequencies_hz : (m,) array
        Free-free frequencies; 0 for rigid-body modes.
    kinds : tuple of str
        ``"rigid-body"`` or what moves in the mode ("bending", "torsion", "axial", "interface", "interior").
    damping_ratios : (m,) array
        Modal damping; 0 unless the link description gives it.
    residuals : (m,) array
        By how much the frequencies are too high, as shares of them, by the forces that each mode leaves in the full
        model; 0 for a mode of it.
    full_mass_properties : MassProperties
        Of the full finite-element model, for comparison.
    fixed_interface : FixedInterfaceModes
    health : tuple of HealthCheck
    lines, triangles : (l, 2), (t, 3) int arrays
        For pictures.
    heights : (n, 2) array
        Of the bottom and the top of shells above each node, along their normals, for pictures; (0, 2) without any [m].
    surface : Surface or None
        Of a rigid link, what pictures show instead.
    provenance : dict of str
        Source file, SHA-256, tool versions, method, options.
    recovery : RecoveryMaps or None
        Stress or section forces, when the link description asks for them.
    second_order : SecondOrder or None
        Second-order kinematics; the provenance says why there are none.
    thermal : ThermalExpansion or None
        Where the link description gives a temperature change.
    """

    name: str
    form: str
    nodes: Array
    node_names: dict[str, int]
    translation_shapes: Array
    rotation_nodes: IntArray
    rotation_shapes: Array
    interface_nodes: tuple[InterfaceNode, ...]
    stiffness: Array
    invariants: InertiaInvariants
    frequencies_hz: Array
    kinds: tuple[str, ...]
    damping_ratios: Array
    residuals: Array
    full_mass_properties: MassProperties
    fixed_interface: FixedInterfaceModes
    health: tuple[HealthCheck, ...]
    lines: IntArray
    triangles: IntArray
    provenance: dict[str, str] = field(default_factory=dict)
    recovery: RecoveryMaps | None = None
    second_order: SecondOrder | None = None
    thermal: ThermalExpansion | None = None
    heights: Array = field(default_factory=lambda: np.zeros((0, 2)))
    surface: Surface | None = None

    @property
    def modes(self) -> int:
        """Number of modal coordinates m (rigid-body ones included)."""
        return len(self.frequencies_hz)

    @property
    def elastic_modes(self) -> int:
        """Number of elastic modes, m - 6."""
        return self.modes - 6

    @property
    def mass_properties(self) -> MassProperties:
        """Mass, centre of mass and inertia of the reduced link."""
        return mass_properties(self.invariants.rigid_mass_matrix)

    def interface(self, name: str) -> InterfaceNode | None:
        """The interface node of that name, or None."""
        return next((i for i in self.interface_nodes if i.name == name), None)

    def node_shape(self, node: int) -> tuple[Array, Array | None]:
        """(3, m) displacement and (3, m) rotation of a node per unit modal coordinate; None if none."""
        place = np.flatnonzero(self.rotation_nodes == node)
        rotation = self.rotation_shapes[place[0]] if len(place) else None
        return self.translation_shapes[node], rotation
