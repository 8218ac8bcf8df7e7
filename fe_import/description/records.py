"""Link descriptions (TOML): the schema and its defaults.

Every record below is one table of the file; unknown keys are errors with a suggestion.
"""

from __future__ import annotations

from typing import Any

import msgspec

from fe_import.description.base import Inertia, Record, Vector
from fe_import.description.meshes import Shell, Solid
from fe_import.description.parameters import Parameter
from fe_import.description.reduction import Reduction
from fe_import.elements.sections import Section

MOST_PIECES = 1000  # that a link may be split into


class Units(Record, frozen=True):
    """Units of the description and its mesh; converted to SI at the border.

    Attributes
    ----------
    length : str
        ``m``, ``cm``, ``mm``, ``in`` or ``ft``.
    mass : str
        ``kg``, ``g``, ``t``, ``lb``, or with pounds of force ``slug`` (feet) or ``lbf*s2/in`` (inches).
    time : str
        ``s`` or ``ms``.
    unusual : bool
        The link is as large, heavy, soft or light as its figures say: those that look like a slipped unit are reported,
        not refused.
    """

    length: str = "m"
    mass: str = "kg"
    time: str = "s"
    unusual: bool = False


class Material(Record, frozen=True):
    """Linear elastic material, isotropic unless it has a ``transverse_modulus``, in the stated units.

    Attributes
    ----------
    youngs_modulus : float
        E [Pa].
    poissons_ratio : float
        ν, between -1 and 0.5.
    density : float
        ρ [kg/m³].
    thermal_expansion : float, optional
        Coefficient of linear thermal expansion α [1/K]; needed where the link has a ``temperature_change``.
    transverse_modulus : float, optional
        Of a layer of fibres: E2 [Pa] across them, and then E is E1, ν is ν12. Only shells may have such layers.
    shear_modulus : float, optional
        G12 = G13 [Pa]; needed with ``transverse_modulus``.
    transverse_shear_modulus : float, optional
        G23 [Pa]; G12 unless given.
    """

    youngs_modulus: float
    poissons_ratio: float
    density: float
    thermal_expansion: float | None = None
    transverse_modulus: float | None = None
    shear_modulus: float | None = None
    transverse_shear_modulus: float | None = None


class Member(Record, frozen=True):
    """A straight member between two named nodes; its inner nodes are named ``FROM-TO/1`` ... in order.

    Attributes
    ----------
    start, end : str
        Nodes of ``[frame.nodes]``.
    material : str
        A name from ``[materials]``; needed.
    section : str
        A name from ``[sections]``; needed.
    elements : int
        Elements of equal length.
    local_z : (3,) floats, optional
        Direction of the section's height; z, or y for members along z, unless given.
    """

    start: str = msgspec.field(name="from")
    end: str = msgspec.field(name="to")
    material: str = ""
    section: str = ""
    elements: int = 1
    local_z: Vector | None = None


class Frame(Record, frozen=True):
    """A link made of beams.

    Attributes
    ----------
    nodes : dict of (3,) floats
        Positions of named nodes [m], mesh frame.
    members : list of Member
        Beams between them, ``[[frame.members]]``.
    theory : str
        ``timoshenko``, or ``euler-bernoulli``: no shear deformation.
    mass : str
        ``consistent`` with the interpolation of the elements, or ``lumped`` at the nodes.
    rotary_inertia : bool
        Cross sections resist turning.
    torsion : str
        Torsion constant of a section: ``saint-venant``, or ``polar``, Iy + Iz, as some programs take it.
    """

    nodes: dict[str, Vector]
    members: list[Member]
    theory: str = "timoshenko"
    mass: str = "consistent"
    rotary_inertia: bool = True
    torsion: str = "saint-venant"


class Matrices(Record, frozen=True):
    """A link whose mass and stiffness matrices a finite-element program exported.

    Attributes
    ----------
    format : str
        The reader of the files.
    files : dict of str
        Files by their role: ``stiffness``, ``mass``, ``dofs``, ``mesh``, ``nodes``, ``sets``; which of them, the format
        says.
    options : dict
        What the format wants to know besides, see below.
    nodes : dict of int or (3,) floats
        Names of nodes that interfaces, masses and scenes may refer to, by number in that program or by position [m]
        (nearest node).
    """

    format: str
    files: dict[str, str]
    options: dict[str, Any] = {}
    nodes: dict[str, int | Vector] = {}


class PointMass(Record, frozen=True):
    """A rigid mass added to a node.

    Attributes
    ----------
    node : str
        A named node or an interface; in a scene of bodies also a body, or an inner node of a beam.
    mass : float
        [kg]
    inertia : (3,) floats or (3, 3) floats
        About the node [kg m²]: [Ixx, Iyy, Izz], or a symmetric matrix; mesh axes, or those of the node's frame.
    """

    node: str
    mass: float = 0.0
    inertia: Inertia = (0.0, 0.0, 0.0)


class Interface(Record, frozen=True):
    """A node where a joint sits: a node of a frame or of beams, or one that moves with a face.

    Attributes
    ----------
    name : str
        What scenes call it.
    node : str
        A named node; of a solid one that turns (of a beam, of a rigid body of its mesh file), or the set that holds it
        alone. Give this or ``face``.
    face : str
        A node or face set of the mesh.
    coupling : str
        How a face goes with the interface node: it follows, ``rigid`` (RBE2), or the node moves as the face does on
        average, ``averaged`` (RBE3).
    weights : str
        Of ``averaged``: each node's share of the ``area`` (the default on a mesh), or ``uniform``.
    position : (3,) floats, optional
        Of the interface node of a face [m], mesh frame; the centre of the face unless given.
    """

    name: str
    node: str = ""
    face: str = ""
    coupling: str = "rigid"
    weights: str = ""
    position: Vector | None = None


class Recovery(Record, frozen=True):
    """Where stress (solids, shells) or section forces (frames) can be found from the modal coordinates later.

    Attributes
    ----------
    nodes : list of str
        Named nodes.
    sets : list of str
        Node or element sets of the mesh, or members of a frame (``FROM-TO``).
    all : bool
        Everywhere.
    """

    nodes: list[str] = []
    sets: list[str] = []
    all: bool = False


class Rayleigh(Record, frozen=True):
    """Damping matrix ``alpha`` M + ``beta`` K; a mode of the angular frequency ω has the ratio α/2ω + βω/2.

    Attributes
    ----------
    alpha : float
        Share of the mass matrix [1/s].
    beta : float
        Share of the stiffness matrix [s].
    """

    alpha: float = 0.0
    beta: float = 0.0


class Damping(Record, frozen=True):
    """Modal damping, stated in one way; none unless given.

    Attributes
    ----------
    ratio : float, optional
        Damping ratio of all elastic modes; 1 is critical.
    ratios : list of float, optional
        Ratios from the lowest elastic mode on; 0 for modes beyond the list.
    rayleigh : Rayleigh, optional
        Ratios from shares of mass and stiffness.
    """

    ratio: float | None = None
    ratios: list[float] | None = None
    rayleigh: Rayleigh | None = None


class LinkDescription(Record, frozen=True):
    """A link: one of ``frame``, ``solid``, ``shell`` and ``matrices`` (or solid and shell), interfaces, reduction.

    Attributes
    ----------
    interfaces : list of Interface
        Where joints sit, at least one: ``[[interfaces]]``; the first is the inboard one unless a scene says otherwise.
    name : str
        Of the link; that of the file unless given.
    units : Units
        Of the numbers in the description, of its mesh and of exported matrices.
    materials : dict of Material
        By name, ``[materials.NAME]``.
    sections : dict of Section
        Cross sections of beams by name, ``[sections.NAME]``.
    frame : Frame, optional
        The link is made of beams.
    solid : Solid, optional
        The link is meshed with solid elements.
    shell : Shell, optional
        The link is meshed with shells; beside ``solid`` a part of it.
    matrices : Matrices, optional
        The link comes as exported matrices.
    masses : list of PointMass
        Rigid masses on nodes, ``[[masses]]``.
    reduction : Reduction
        How the model is reduced.
    damping : Damping
        Of the elastic modes.
    recovery : Recovery, optional
        Where stress or section forces are wanted; without it the modal file holds nothing for them.
    temperature_change : float, optional
        Of the whole link, made of beams, from the temperature at which it has its stated shape without stress [K].
        0 prepares the modal file for one.
    parameters : dict of Parameter
        Numbers that a family of links may have otherwise, ``[parameters.NAME]``.
    """

    interfaces: list[Interface]
    name: str = ""
    units: Units = Units()
    materials: dict[str, Material] = {}
    sections: dict[str, Section] = {}
    frame: Frame | None = None
    solid: Solid | None = None
    shell: Shell | None = None
    matrices: Matrices | None = None
    masses: list[PointMass] = []
    reduction: Reduction = Reduction()
    damping: Damping = Damping()
    recovery: Recovery | None = None
    temperature_change: float | None = None
    parameters: dict[str, Parameter] = {}

    def files(self) -> list[str]:
        """The files that it names, as they stand there."""
        if self.solid is not None:
            return [self.solid.mesh]
        if self.shell is not None:
            return [self.shell.mesh]
        return [] if self.matrices is None else [name for _, name in sorted(self.matrices.files.items())]
