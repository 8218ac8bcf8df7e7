"""Tables of links that are meshed: solids and shells."""

from __future__ import annotations

from fe_import.description.base import Record, Vector


class Region(Record, frozen=True):
    """The elements of a named set of the mesh, and their material.

    Attributes
    ----------
    set : str
        Element set of the mesh.
    material : str
        A name from ``[materials]``.
    """

    set: str
    material: str


class Stretch(Record, frozen=True):
    """Thickness of a mesh: its distances from a plane grow by factors that change along it.

    Named nodes and places of interfaces go with the mesh.

    Attributes
    ----------
    axis : str
        ``x``, ``y`` or ``z``, in which it grows.
    factors : list of float
        Of the distance from the plane, at each station; between them linear, beyond them as at the last.
    along : str
        Another axis, along which factors change; needed where there is more than one.
    at : list of float
        Stations on that axis, rising.
    about : float
        Where the plane lies on ``axis``.
    """

    axis: str
    factors: list[float]
    along: str = ""
    at: list[float] = []
    about: float = 0.0


class Solid(Record, frozen=True):
    """A link meshed with solid elements.

    Attributes
    ----------
    mesh : str
        An input deck, bulk data, or any file that meshio reads, also packed as ``.gz``; or a geometry (STEP, IGES,
        BREP), which gmsh meshes with tetrahedra of 10 nodes (``pip install 'erls[geometry]'``). The path starts at the
        description.
    size : float, optional
        Of the elements of a geometry [m]; needed for one, and for nothing else. About the least thickness will do.
    faces : dict of (3,) floats
        Names for the surfaces of a geometry next to these positions [m], for interfaces: a point on one, or the centre
        of a bore, which is both its halves. Without a name they are ``surface:N``, by their number in gmsh.
    material : str
        A name from ``[materials]``, for the whole mesh; without it and ``regions`` an input deck brings its materials.
    regions : list of Region
        Instead of ``material``: one for each set of elements, ``[[solid.regions]]``.
    nodes : dict of (3,) floats
        Names for the mesh nodes nearest to these positions [m]; scenes may refer to them.
    stretch : list of Stretch
        Thicknesses other than those of the mesh file, one after the other, ``[[solid.stretch]]``.
    hex8 : str
        How hexahedra of 8 nodes strain: with ``incompatible-modes``, or ``compatible``, which locks in bending.
    raise_order : bool
        Linear elements become quadratic ones, with nodes in the middle of their straight edges.
    mesh_error : float
        Largest error of the first elastic frequencies by the mesh, estimated, as a share: beyond it the health check
        fails, and linear elements (tetrahedra, wedges, pyramids, compatible hexahedra) are refused.
    ignore : list of str
        Keywords, cards and types of elements of the mesh file that the link is to be without.
    """

    mesh: str
    size: float | None = None
    faces: dict[str, Vector] = {}
    material: str = ""
    regions: list[Region] = []
    nodes: dict[str, Vector] = {}
    stretch: list[Stretch] = []
    hex8: str = "incompatible-modes"
    raise_order: bool = False
    mesh_error: float = 0.05
    ignore: list[str] = []


class Layer(Record, frozen=True):
    """A layer of a shell.

    Attributes
    ----------
    material : str
        A name from ``[materials]``.
    thickness : float
        [m]
    angle : float
        Of its fibres, from ``direction`` about the normal [degrees].
    """

    material: str
    thickness: float
    angle: float = 0.0


class ShellRegion(Record, frozen=True):
    """The shells of a named set of the mesh, and what they are made of; as in ``[shell]``.

    Attributes
    ----------
    set : str
        Element set of the mesh.
    material : str
        A name from ``[materials]``.
    thickness : float, optional
        [m]
    layers : list of Layer
        Instead of ``material`` and ``thickness``: from the bottom to the top.
    offset : float
        Height of the middle of the thickness above the nodes, along the normal [m].
    """

    set: str
    material: str = ""
    thickness: float | None = None
    layers: list[Layer] = []
    offset: float = 0.0


class Shell(Record, frozen=True):
    """A link meshed with shells, triangles and quadrangles of 3 and 4 nodes with six components each.

    Beside ``[solid]`` its mesh is that of the solid, and the sets of ``regions`` are the shells. Without any material,
    thickness and layers an input deck brings them (``*SHELL SECTION``, ``PSHELL``).

    Attributes
    ----------
    mesh : str
        As in ``[solid]``; every triangle and quadrangle of it is a shell, of second order four. Left out beside
        ``[solid]``.
    material : str
        A name from ``[materials]``, for the whole mesh.
    thickness : float, optional
        [m]; positive.
    layers : list of Layer
        Instead of ``material`` and ``thickness``: from the bottom to the top, ``[[shell.layers]]``.
    offset : float
        Height of the middle of the thickness above the nodes, along the normal, about which the nodes of an element go
        anticlockwise [m].
    regions : list of ShellRegion
        Instead of these: one for each set of shells, ``[[shell.regions]]``.
    direction : (3,) floats, optional
        Whose projection on the surface is the first axis of layers; needed where these are not isotropic.
    nodes : dict of (3,) floats
        Names for the mesh nodes nearest to these positions [m]; scenes may refer to them.
    drilling : float
        Stiffness by which the surface takes rotations about its normal along, in shares of G times the thickness.
    mass : str
        ``consistent`` with the interpolation of the elements, or ``lumped`` at the nodes.
    mesh_error : float
        Largest error of the first elastic frequencies by the mesh, estimated, as a share: beyond it the health check
        fails. Beside ``[solid]`` that one counts.
    ignore : list of str
        Keywords, cards and types of elements of the mesh file that the link is to be without.
    """

    mesh: str = ""
    material: str = ""
    thickness: float | None = None
    layers: list[Layer] = []
    offset: float = 0.0
    regions: list[ShellRegion] = []
    direction: Vector | None = None
    nodes: dict[str, Vector] = {}
    drilling: float = 0.01
    mass: str = "consistent"
    mesh_error: float = 0.05
    ignore: list[str] = []
