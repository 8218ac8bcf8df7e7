"""Links made in Python, without a file: from the tables of a description, or from matrices in memory."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import scipy.sparse as sp

from fe_import.description.check import check_link
from fe_import.description.link import LinkFile
from fe_import.description.records import LinkDescription
from fe_import.errors import Cause, FEImportError
from fe_import.files.toml import convert
from fe_import.modal.model import ModalModel
from fe_import.model import FEModel
from fe_import.models.model import add_masses, to_si
from fe_import.reduce import reduce_model

_ARRAYS = "link_from_matrices"


def make_link(name: str = "link", *, folder: Path | str = ".", **tables: Any) -> LinkFile:
    """A link from the tables that its description would hold; checked as one.

    Parameters
    ----------
    name : str
    folder : Path or str
        Where relative paths of meshes and matrices start.
    **tables
        ``frame``, ``materials``, ``sections``, ``interfaces`` and the others, as mappings, lists of them, or records of
        `fe_import.description.records`; arrays may stand for lists of numbers.

    Returns
    -------
    LinkFile
        For `fe_import.reduce_link`.

    Raises
    ------
    FEImportError
        Naming field, value and remedy.

    Examples
    --------
    >>> from fe_import import make_link, reduce_link
    >>> arm = make_link(
    ...     "arm",
    ...     materials={"steel": {"youngs_modulus": 2.1e11, "poissons_ratio": 0.3, "density": 7850.0}},
    ...     sections={"flat": {"shape": "rectangular", "height": 0.02, "width": 0.004}},
    ...     frame={
    ...         "nodes": {"root": [0.0, 0.0, 0.0], "tip": [0.5, 0.0, 0.0]},
    ...         "members": [{"from": "root", "to": "tip", "elements": 4, "material": "steel", "section": "flat"}],
    ...     },
    ...     interfaces=[{"name": "root", "node": "root"}, {"name": "tip", "node": "tip"}],
    ... )
    >>> round(reduce_link(arm).mass_properties.mass, 9)
    0.314
    """
    path = Path(folder) / f"{name}.toml"
    data = msgspec.to_builtins({**tables, "name": name}, str_keys=True, enc_hook=_plain)
    return LinkFile(path, described(data, f"make_link: {name}"))


def link_from_matrices(
    stiffness: Any,
    mass: Any,
    nodes: Any,
    interfaces: Mapping[str, Any],
    *,
    dof_map: Any = None,
    name: str = "link",
    options: Mapping[str, Any] | None = None,
) -> ModalModel:
    """Reduce a link whose mass and stiffness are arrays.

    Parameters
    ----------
    stiffness, mass : (d, d) arrays or sparse matrices
        Over all dofs, free of supports [N/m, kg], symmetric.
    nodes : (n, 3) array
        Places of the nodes in the mesh frame [m].
    interfaces : mapping
        Name -> a node with rotations, or some nodes that follow the interface, by their number in ``nodes``; or a table
        with ``nodes`` (these) and the fields of ``[[interfaces]]`` (``coupling``, ``weights``, ``position``).
    dof_map : (n, 6) int array, optional
        Row of each displacement and rotation (x, y, z each) of a node, -1 where it lacks one. Unless given, nodes
        follow each other with three rows, or with six where there are as many.
    name : str
        Of the link.
    options : mapping, optional
        Other tables of a link description: ``reduction``, ``damping``, ``masses``, ``units``.

    Returns
    -------
    ModalModel
        As `fe_import.reduce_link` gives it.

    Raises
    ------
    FEImportError
        Arrays that do not belong together, nodes that are not there, matrices that are none of a free link.

    Examples
    --------
    >>> import numpy as np
    >>> from fe_import import link_from_matrices
    >>> places = np.array([[x, y, z] for x in (0.0, 1.0) for y, z in ((0, 0), (1, 0), (0, 1))])
    >>> i, j = np.triu_indices(6, 1)  # a truss, every node of a prism with every other
    >>> bars = np.zeros((15, 6, 3))
    >>> bars[np.arange(15), i], bars[np.arange(15), j] = places[i] - places[j], places[j] - places[i]
    >>> rows = bars.reshape(15, 18)
    >>> truss = link_from_matrices(1e6 * rows.T @ rows, np.eye(18), places, {"foot": [0, 1, 2], "head": [3, 4, 5]})
    >>> round(truss.mass_properties.mass, 9)
    6.0
    """
    from fe_import.models.matrices import export_model

    places = _numbers(nodes, "nodes").astype(np.float64)
    if places.ndim != 2 or places.shape[1] != 3:
        raise _fault("nodes are an (n, 3) array of places", places.shape, "nodes")
    tables: list[dict[str, Any]] = []
    sets = dict[str, Any]()
    numbers = dict[str, int]()
    for each, given in interfaces.items():
        table = dict(given) if isinstance(given, Mapping) else {"nodes": given}
        twice = next((field for field in ("node", "face") if field in table), "")
        if twice:
            raise _fault("an interface is given by its nodes", table[twice], f"interfaces.{each}.{twice}")
        own = np.unique(np.atleast_1d(_numbers(table.pop("nodes", []), f"interfaces.{each}")))
        if own.dtype.kind not in "iu" or not own.size or not 0 <= own[0] <= own[-1] < len(places):
            raise _fault("an interface needs numbers of nodes", own.tolist(), f"interfaces.{each}")
        numbers, sets = (numbers | {each: int(own[0])}, sets) if own.size == 1 else (numbers, sets | {each: own})
        tables.append({**table, "name": each, "node" if own.size == 1 else "face": each})
    given = {"format": "arrays", "files": {}, "nodes": numbers}
    description = described(joined(options, {"name": name, "interfaces": tables, "matrices": given}, _ARRAYS), _ARRAYS)
    export = _export(stiffness, mass, places, dof_map, sets)
    return reduced(export_model(export, description, _ARRAYS), description, _ARRAYS)


def _export(stiffness: Any, mass: Any, places: Any, dof_map: Any, sets: Mapping[str, Any]) -> Any:
    """The arrays as an export, once their shapes are those of one link."""
    from fe_import.exports.base import Export

    stiffness, mass = _numbers(stiffness, "stiffness"), _numbers(mass, "mass")
    size, count = np.shape(stiffness)[0] if np.ndim(stiffness) else 0, len(places)
    if np.shape(stiffness) != (size, size) or np.shape(mass) != (size, size):
        raise _fault("stiffness and mass are square, of one size", (np.shape(stiffness), np.shape(mass)), "stiffness")
    if dof_map is None:
        each = size // count if count else 0
        if size != each * count or each not in (3, 6):
            raise _fault("there are neither three nor six rows for each node", size, "dof_map")
        dof_map = np.full((count, 6), -1)
        dof_map[:, :each] = np.arange(size).reshape(count, each)
    rows = _numbers(dof_map, "dof_map")
    used = rows[rows >= 0] if rows.dtype.kind in "iu" else rows
    if rows.shape != (count, 6) or rows.dtype.kind not in "iu" or not np.array_equal(np.sort(used), np.arange(size)):
        raise _fault("dof_map is (n, 6), and has each row of the matrices once", rows.shape, "dof_map")
    return Export(
        mass=sp.csc_array(mass),
        stiffness=sp.csc_array(stiffness),
        nodes=places,
        labels=np.arange(count, dtype=np.int64),
        dof_map=rows.astype(np.int64),
        node_sets={name: own.astype(np.int64) for name, own in sets.items()},
        notes={"program": "arrays"},
    )


def joined(options: Mapping[str, Any] | None, given: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Tables that a caller adds to those that the arguments of a function make.

    Raises
    ------
    FEImportError
        BAD_FIELD: one stands in both.
    """
    for key in options or {}:
        if key in given:
            message, remedy = "the arguments say this", "take it out of options"
            raise FEImportError(Cause.BAD_FIELD, message, where=f"{where}: options.{key}", remedy=remedy)
    return {**(options or {}), **given}


def described(data: dict[str, Any], where: str) -> LinkDescription:
    """A description from its tables, checked.

    Raises
    ------
    FEImportError
        Naming field, value and remedy.
    """
    description = convert(data, LinkDescription, where)
    check_link(description, where)
    return description


def reduced(model: FEModel, description: LinkDescription, where: str) -> ModalModel:
    """A model in memory reduced as its description says, its masses and units included."""
    model = to_si(add_masses(model, description.masses, where), description, where)
    return reduce_model(model, LinkFile(Path(where), description, _content(model)))


def _content(model: FEModel) -> bytes:
    """What a link depends on that no file holds."""
    digest = hashlib.sha256(np.ascontiguousarray(model.nodes).tobytes())
    for matrix in (model.mass, model.stiffness):
        canonical = sp.csc_array(matrix)
        for part in (canonical.indptr, canonical.indices, canonical.data):
            digest.update(np.ascontiguousarray(part).tobytes())
    return digest.digest()


def _plain(value: Any) -> Any:
    """What tables may hold beside plain values and records."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    return str(value)


def _numbers(value: Any, field: str) -> Any:
    """An array or a sparse matrix of real numbers."""
    try:
        found = value if sp.issparse(value) else np.asarray(value)
    except ValueError:  # rows of several lengths
        raise _fault("no array of numbers", type(value).__name__, field) from None
    if found.dtype.kind not in "iuf":
        raise _fault("no array of real numbers", str(found.dtype), field)
    return found


def _fault(message: str, value: Any, field: str) -> FEImportError:
    remedy = "give K and M over all rows, places of nodes, and which rows are theirs"
    return FEImportError(Cause.BAD_FIELD, message, where=f"{_ARRAYS}: {field}", value=value, remedy=remedy)
