"""Link descriptions that tests vary, written to a folder, and independent computations on their models."""

from __future__ import annotations

import copy
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray
from solid_meshes import box

from fe_import.description.link import LinkFile, load_link
from fe_import.modal.model import ModalModel
from fe_import.model import FEModel
from fe_import.models.model import build_model
from fe_import.reduce import reduce_model

Array = NDArray[np.float64]

# a frame without symmetry, out of every plane, with a tall section and 42 dofs
FRAME: dict[str, Any] = {
    "materials": {"m": {"youngs_modulus": 7e10, "poissons_ratio": 0.33, "density": 2700.0}},
    "sections": {"s": {"shape": "rectangular", "width": 0.01, "height": 0.02}},
    "frame": {
        "nodes": {"root": [0.1, 0.0, 0.0], "elbow": [0.5, 0.1, 0.05], "tip": [0.6, 0.5, -0.1]},
        "members": [
            {"from": "root", "to": "elbow", "elements": 3, "material": "m", "section": "s"},
            {"from": "elbow", "to": "tip", "elements": 3, "material": "m", "section": "s"},
        ],
    },
    "interfaces": [{"name": "hub", "node": "root"}, {"name": "hand", "node": "tip"}],
}

SOLID: dict[str, Any] = {
    "materials": {"m": {"youngs_modulus": 7e10, "poissons_ratio": 0.33, "density": 2700.0}},
    "solid": {"mesh": "box.inp", "material": "m", "mesh_error": 1e3},  # coarse
    "interfaces": [{"name": "hub", "face": "x0"}, {"name": "hand", "face": "x1"}],
}


def toml(value: Any) -> str:
    """A TOML value, tables inline."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{toml(str(k))} = {toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(toml(v) for v in value) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"').replace("\0", "\\u0000")
        return f'"{escaped}"'
    return repr(float(value) if isinstance(value, np.floating) else value)


def write_toml(path: Path, data: dict[str, Any]) -> Path:
    """Write a table as a TOML file."""
    path.write_text("".join(f"{key} = {toml(value)}\n" for key, value in data.items()), encoding="utf-8")
    tomllib.loads(path.read_text(encoding="utf-8"))
    return path


def merged(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """A copy of nested tables with changes."""
    result = copy.deepcopy(base)
    for key, value in changes.items():
        old = result.get(key)
        result[key] = merged(old, value) if isinstance(old, dict) and isinstance(value, dict) else value
    return result


def frame_link(folder: Path, **changes: Any) -> LinkFile:
    """`FRAME` with changes, from ``folder``/link.toml."""
    return load_link(write_toml(folder / "link.toml", merged(FRAME, changes)))


def straight_link(folder: Path, length: float, elements: int, **changes: Any) -> LinkFile:
    """A straight link along x from the origin."""
    frame = {
        "nodes": {"root": [0.0, 0.0, 0.0], "tip": [length, 0.0, 0.0]},
        "members": [{"from": "root", "to": "tip", "elements": elements, "material": "m", "section": "s"}],
    }
    base = merged(FRAME, {"frame": None})
    return load_link(write_toml(folder / "link.toml", merged({**base, "frame": frame}, changes)))


def write_box(path: Path, scale: float = 1.0, kind: str = "hex20", along: int = 3) -> Path:
    """An Abaqus mesh of 3 x 1 x 1 hexahedra with 20 nodes, 0.3 x 0.02 x 0.03 times ``scale``, sets x0 and x1."""
    mesh = box(kind, (along, 1, 1), (0.3, 0.02, 0.03))
    lines = ["*NODE"]
    lines += [f"{k}, " + ", ".join(repr(float(x * scale)) for x in p) for k, p in enumerate(mesh.nodes, start=1)]
    lines += [f"*ELEMENT, TYPE=C3D{mesh.only.element.size}, ELSET=all"]
    for k, nodes in enumerate(mesh.only.elements, start=1):
        numbers = [str(k), *(str(n + 1) for n in nodes)]
        lines += [", ".join(numbers[at : at + 16]) + "," for at in range(0, len(numbers), 16)]
    for name in ("x0", "x1"):
        lines += [f"*NSET, NSET={name}"]
        lines += [f"{n + 1}," for n in mesh.node_sets[name]]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def solid_link(folder: Path, **changes: Any) -> LinkFile:
    """`SOLID` with changes, and its mesh."""
    write_box(folder / "box.inp")
    return load_link(write_toml(folder / "link.toml", merged(SOLID, changes)))


def random_rotation(seed: int) -> Array:
    """A proper rotation matrix."""
    q = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))[0]
    return np.asarray(q * np.linalg.det(q))


def dense(model: FEModel) -> tuple[Array, Array, Array]:
    """Mass, stiffness over the independent dofs, and unit rigid motions there."""
    mass, stiffness = model.reduced_matrices()
    return mass.toarray(), stiffness.toarray(), model.rigid_body_modes()[model.independent]


def boundary(model: FEModel) -> NDArray[np.int64]:
    """Positions of the interface dofs among the independent dofs."""
    place = np.full(model.mass.shape[0], -1)
    place[model.independent] = np.arange(len(model.independent))
    return place[model.interface_dofs]


def interface_shapes(modal: ModalModel) -> Array:
    """(6 interfaces, m) displacements and rotations of all interfaces per unit modal coordinate."""
    return np.vstack([part for i in modal.interface_nodes for part in modal.node_shape(i.node)])


def held(rows: Array) -> Array:
    """Columns that span the modal coordinates for which ``rows`` do not move."""
    size = np.abs(rows).max(axis=0)
    scale = 1 / np.where(size > 0, size, 1.0)
    return np.asarray(scale[:, None] * la.null_space(rows * scale, rcond=1e-10))


def clamped_flexibility(modal: ModalModel) -> Array:
    """(6, 6) displacement of the second interface per unit load there, the first one clamped."""
    shapes = interface_shapes(modal)
    basis = held(shapes[:6])
    tip = shapes[6:12] @ basis
    return np.asarray(tip @ la.solve(basis.T @ modal.stiffness @ basis, tip.T, assume_a="sym"))


def clamped_frequencies(modal: ModalModel, clamped: int = 6) -> Array:
    """Frequencies [Hz] with the first ``clamped`` interface components held."""
    basis = held(interface_shapes(modal)[:clamped])
    mass = basis.T @ modal.invariants.m @ basis
    return 1 / np.sqrt(la.eigh(mass, basis.T @ modal.stiffness @ basis, eigvals_only=True)[::-1]) / (2 * np.pi)


def frequencies(mass: Array, stiffness: Array, count: int) -> Array:
    """Lowest frequencies [Hz] of a supported model, solved for 1/ω² (the lowest are the accurate ones)."""
    scale = 1 / np.sqrt(np.diag(stiffness))
    both = np.outer(scale, scale)
    mu = la.eigh(mass * both, stiffness * both, eigvals_only=True)[::-1]
    return np.asarray(1 / np.sqrt(mu[:count]) / (2 * np.pi))


def free_frequencies(model: FEModel, count: int) -> Array:
    """Lowest elastic frequencies [Hz] of a free model by subspace iteration in extended precision.

    With K + αM in place of K, each solve refined in extended precision: no digit is lost to the rigid motions.
    """
    mass, stiffness, rigid = dense(model)
    long = np.longdouble
    m, k = mass.astype(long), stiffness.astype(long)
    alpha = la.eigh(stiffness, mass, eigvals_only=True, subset_by_index=[6, 6])[0]
    shifted = stiffness + alpha * mass
    scale = 1 / np.sqrt(np.diag(shifted))
    factor = la.cho_factor(shifted * np.outer(scale, scale))
    exact = k + long(alpha) * m

    def solve(right: Any) -> Any:
        x = np.zeros_like(right)
        for _ in range(4):
            rest = (scale[:, None] * (right - exact @ x)).astype(float)
            x = x + (scale[:, None] * la.cho_solve(factor, rest)).astype(long)
        return x

    def orthonormal(columns: Any, before: list[Any]) -> list[Any]:
        done = list(before)
        for c in columns:
            for _ in range(2):
                for d in done:
                    c = c - d * (d @ (m @ c))
            done.append(c / np.sqrt(c @ (m @ c)))
        return done[len(before) :]

    still = orthonormal(rigid.astype(long).T, [])
    start = np.random.default_rng(0).standard_normal((len(mass), min(count + 8, len(mass) - 6)))
    x = np.stack(orthonormal(start.astype(long).T, still), axis=1)
    old = np.zeros(count)
    for _ in range(100):
        x = np.stack(orthonormal(solve(m @ x).T, still), axis=1)
        _, turn = la.eigh((x.T @ (k @ x)).astype(float))
        x = x @ turn.astype(long)
        values = np.sort((np.einsum("ij,ij->j", x, k @ x) / np.einsum("ij,ij->j", x, m @ x)).astype(float))[:count]
        if np.abs(values - old).max() < 1e-13 * values[0]:
            break
        old = values
    return np.asarray(np.sqrt(values) / (2 * np.pi))


def both(link: LinkFile) -> tuple[FEModel, ModalModel]:
    """The full model of a link, and the reduced one."""
    model = build_model(link)
    return model, reduce_model(model, link)


def whole(method: str, dofs: int, interfaces: int = 2) -> dict[str, Any]:
    """Options that keep every mode of a model."""
    counts = {
        "craig-bampton": {"fixed_interface_modes": dofs - 6 * interfaces},
        "craig-chang": {"free_modes": dofs - 6},
        "mode-displacement": {"free_modes": dofs - 6},
    }
    return {"method": method, **counts.get(method, {})}
