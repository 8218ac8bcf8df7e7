"""The table ``links`` of a chain."""

from __future__ import annotations

from typing import Any

from erls.scene.records import Pose, Record
from fe_import.description.base import Inertia, Vector
from fe_import.description.records import Damping


class RigidBody(Record, frozen=True):
    """A rigid link, in the link's frame.

    Attributes
    ----------
    mass : float
        [kg]
    points : dict of (3,) floats
        Named positions [m]. Each is an interface, where joints may sit, and a node for points and loops: the first is
        the inboard one, the second the outboard one, unless the link names others.
    centre_of_mass : (3,) floats
        [m]
    inertia : (3,) floats or (3, 3) floats
        About the centre of mass [kg m²]: [Ixx, Iyy, Izz], or a symmetric matrix.
    surface : str
        STL or OBJ file of at most 20 000 triangles, in metres in the link's frame, that pictures show instead of lines
        from point to point; the path starts at the scene. It is drawn only and has no mass.
    """

    mass: float
    points: dict[str, Vector]
    centre_of_mass: Vector = (0.0, 0.0, 0.0)
    inertia: Inertia = (0.0, 0.0, 0.0)
    surface: str = ""


class MeshPose(Pose, frozen=True):
    """Pose of the link's mesh frame.

    Attributes
    ----------
    frame : str
        In which frame: the link's Denavit-Hartenberg frame, ``dh``, or the frame of its inboard joint, ``joint``.
    """

    frame: str = "dh"


class Link(Record, frozen=True):
    """A link: exactly one of ``model``, ``modal_file`` and ``rigid``.

    Attributes
    ----------
    name : str
        What reports, points, loops and ``--set`` call it.
    model : str
        Link description, reduced on the fly; the path starts at the scene.
    modal_file : str
        Modal file; the path starts at the scene.
    rigid : RigidBody, optional
        A rigid link, stated here.
    flexible : bool
        False: rigid, with the mass of the model.
    elastic_modes : int, optional
        Keep only the lowest elastic modes of the model; all unless given.
    substructures : int
        Of ``ffr``: rigidly joined pieces of a link made of beams, each with a frame of its own that turns with the
        deformation; mode counts then hold for every piece. ``nodal`` needs none.
    reduction : dict
        With ``model``: fields that replace those of its table ``[reduction]``.
    changes : dict
        With ``model``: values that replace those of its other tables, in tables of the same names:
        ``changes = { sections.tube.outer_diameter = 0.04 }``; ``--set links.NAME.model.sections...`` writes them here.
    inboard : str
        Interface of the link's own joint; the first unless given.
    outboard : str
        Interface of the joints on it that name none; the second unless given.
    mesh_pose : MeshPose
        Where the mesh frame sits.
    damping : Damping, optional
        Instead of that of the model.
    temperature_change : float, optional
        Instead of that of the model [K]; it needs the expansion of its materials.
    """

    name: str
    model: str = ""
    modal_file: str = ""
    rigid: RigidBody | None = None
    flexible: bool = True
    elastic_modes: int | None = None
    substructures: int = 1
    reduction: dict[str, Any] = {}
    changes: dict[str, Any] = {}
    inboard: str = ""
    outboard: str = ""
    mesh_pose: MeshPose = MeshPose()
    damping: Damping | None = None
    temperature_change: float | None = None
