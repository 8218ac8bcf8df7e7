"""Standard input data (SID): the text alone gives Wallrapp's equations of a body, which are compared with those of the
floating frames here, with sums over the masses of a mesh, and with closed forms.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from link_files import frame_link, solid_link, straight_link
from numpy.typing import NDArray

from erls.equations.ffr.body_frame import elastic_basis
from erls.equations.ffr.standard_data import StandardData
from erls.mechanism.effects import ALL
from erls.mechanism.links import Link
from fe_import.errors import Cause, FEImportError
from fe_import.modal.model import ModalModel
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link
from fe_import.writers.resting import resting_body
from fe_import.writers.sid import write_sid

Array = NDArray[np.float64]
DIGITS = 1e-10  # of the largest figure: sums of some ten numbers of twelve digits


@dataclass
class Block:
    """Numbers, texts, blocks within."""

    values: dict[str, str] = field(default_factory=dict)
    inner: dict[str, Block] = field(default_factory=dict)

    def at(self, q: Array) -> Array:
        """The polynomial at some coordinates."""
        shape = [int(self.values[key]) for key in ("nrow", "nq", "ncol")]
        zeroth, first = np.zeros((shape[0], shape[2])), np.zeros(shape)
        for key, value in self.values.items():
            if found := re.fullmatch(r"(m[01])\(([\d, ]+)\)", key):
                place = tuple(int(i) - 1 for i in found[2].split(","))
                (zeroth if found[1] == "m0" else first)[place] = float(value.replace("D", "e"))
        assert self.values["order"] == "1" or not first.any()
        assert (self.values["structure"] == "0") == (not zeroth.any() and not first.any())
        return np.asarray(zeroth + np.einsum("ikj,k->ij", first, q))


def read(path: Path) -> tuple[list[int], Block]:
    """Counts of nodes and modes of the first line; what stands in the part."""
    first, *lines = path.read_text("ascii").splitlines()
    blocks = [Block()]
    for line in lines:
        key, equals, value = (part.strip() for part in line.partition("="))
        if key.startswith("end "):
            ended = blocks.pop()
            assert key[4:] in (name.split(" = ")[0] for name, b in blocks[-1].inner.items() if b is ended)
        elif equals and not key.startswith("new "):
            assert line.index("=") == 48
            blocks[-1].values[key] = value
        else:
            name = f"{key.removeprefix('new ')} = {value}" if value else key
            blocks.append(blocks[-1].inner.setdefault(name, Block()))
    assert len(blocks) == 1
    return [int(n) for n in first.partition(":")[0].split()], blocks[0].inner["part"]


class Body:
    """Mass matrix and forces of a file, after Wallrapp."""

    def __init__(self, path: Path) -> None:
        self.counts, part = read(path)
        (self.modal,) = part.inner.values()
        self.modes = int(self.modal.inner["refmod"].values["nelastq"])
        self.nodes = list(self.modal.inner["frame"].inner.values())

    def get(self, name: str, q: Array) -> Array:
        return self.modal.inner[name].at(q)

    def moments(self, q: Array) -> Array:
        xx, yy, zz, xy, xz, yz = self.get("J", q)[:, 0]
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    def mass_matrix(self, q: Array) -> Array:
        mass = float(self.modal.inner["refmod"].values["mass"].replace("D", "e"))
        centre = np.cross(self.get("mdCM", q)[:, 0], np.eye(3)).T
        ct, cr, me = (self.get(name, q) for name in ("Ct", "Cr", "Me"))
        return np.block([[mass * np.eye(3), centre.T, ct.T], [centre, self.moments(q), cr.T], [ct, cr, me]])

    def velocity_forces(self, omega: Array, q: Array, rate: Array) -> Array:
        """(6 + n,) of the square of velocities."""
        gr, ge = (np.einsum("iak,k->ia", self.get(name, q).reshape(-1, 3, self.modes), rate) for name in ("Gr", "Ge"))
        x, y, z = omega
        force = np.cross(omega, np.cross(omega, self.get("mdCM", q)[:, 0]) + 2 * self.get("Ct", q).T @ rate)
        moment = gr @ omega + np.cross(omega, self.moments(q) @ omega)
        elastic = ge @ omega + self.get("Oe", q) @ np.array([x * x, y * y, z * z, x * y, y * z, x * z])
        return np.concatenate([force, moment, elastic])


def link_of(model: ModalModel) -> Link:
    """As a scene has it."""
    omega = 2 * np.pi * model.frequencies_hz[6:]
    damping = 2 * model.damping_ratios[6:] * omega
    return Link("l", model, model.invariants, model.interface_nodes[0], omega**2, damping)


def test_equations_are_those_of_floating_frames(tmp_path: Path) -> None:
    """A frame of lumped masses: the same mass matrix and forces up to the first order in q, stiffness and damping.

    What C¹ makes of the moment by q̇, (C¹ q̇)ᵀ q̇ + ω × (C¹ q)ᵀ q̇, is of second order in (q, q̇): SID stops before it.
    """
    model = reduce_link(frame_link(tmp_path, damping={"ratios": [0.01, 0.02, 0.03]}, frame={"mass": "lumped"}))
    nodes = write_sid(tmp_path / "l.SID_FEM", model)
    body, link = Body(tmp_path / "l.SID_FEM"), link_of(model)
    assert body.counts == [len(nodes), body.modes]
    assert body.modes == link.elastic_modes
    to_eta = resting_body(model, "").basis[6:]  # the frames of both rest in the first interface
    data = StandardData(link.invariants, elastic_basis(link, "tangent"), ALL - {"inertia_second_order"})
    rng = np.random.default_rng(5)
    change = np.block([[np.eye(6), np.zeros((6, body.modes))], [np.zeros((body.modes, 6)), to_eta]])
    for _ in range(3):
        q, rate, acceleration = rng.standard_normal((3, body.modes))
        v, omega, v_rate, omega_rate = rng.standard_normal((4, 3))
        matrix, expected = body.mass_matrix(q), change.T @ data.mass_matrix(to_eta @ q) @ change
        np.testing.assert_allclose(matrix, expected, rtol=0, atol=DIGITS * np.abs(expected).max())
        twist, twist_rate = np.concatenate([v, omega]), np.concatenate([v_rate, omega_rate])
        wrench, elastic = data.forces(twist, twist_rate, to_eta @ q, to_eta @ rate, to_eta @ acceleration)
        by_q, by_rate = ((body.get("Cr", x) - body.get("Cr", 0 * x)).T @ rate for x in (q, rate))
        wrench[3:] -= by_rate + np.cross(omega, by_q)
        motion = np.concatenate([v_rate + np.cross(omega, v), omega_rate, acceleration])
        found = matrix @ motion + body.velocity_forces(omega, q, rate)
        expected = np.concatenate([wrench, to_eta.T @ elastic])
        np.testing.assert_allclose(found, expected, rtol=0, atol=DIGITS * np.abs(expected).max())
    zero = np.zeros(body.modes)
    for name, expected in (("Ke", link.stiffness), ("De", link.damping)):
        expected = to_eta.T @ (expected[:, None] * to_eta)
        np.testing.assert_allclose(body.get(name, zero), expected, rtol=0, atol=DIGITS * np.abs(expected).max())
    told = [
        float(value.split(":")[1].removesuffix("Hz"))
        for key, value in body.modal.inner["refmod"].values.items()
        if key.startswith("ielastq")
    ]
    np.testing.assert_allclose(told, np.sqrt(np.diag(body.get("Ke", zero))) / (2 * np.pi), atol=6e-4)


def test_equations_are_sums_over_masses(tmp_path: Path) -> None:
    """A solid whose faces are averaged has translations alone: forces M r̈ of all nodes, with
    r̈ = a + ω̇ × r + ω × (ω × r) + 2 ω × Φ q̇ + Φ q̈, their moments and their work on the modes.

    Force and work are exact in q; the moment is where q̇ = q̈ = 0, without what is even in q.
    """
    link = solid_link(tmp_path, reduction={"fixed_interface_modes": 3}, interfaces=[
        {"name": "hub", "face": "x0", "coupling": "averaged"}, {"name": "hand", "face": "x1", "coupling": "averaged"},
    ])  # fmt: skip
    full, model = build_model(link), reduce_link(link)
    kept = np.flatnonzero((full.dof_map[:, :3] >= 0).all(axis=1))
    mass = full.mass[full.dof_map[kept, 0]][:, full.dof_map[kept, 0]].toarray()  # alike in x, y, z
    write_sid(tmp_path / "l.sid_fem", model)
    body = Body(tmp_path / "l.sid_fem")
    shapes, places = model.translation_shapes[kept] @ resting_body(model, "").basis, model.nodes[kept]
    rng = np.random.default_rng(6)
    a, omega, omega_rate = rng.standard_normal((3, 3))
    q, rate, acceleration = 1e-2 * rng.standard_normal((3, body.modes))
    zero = 0 * q

    def found(q: Array, rate: Array, acceleration: Array) -> Array:
        motion = np.concatenate([a, omega_rate, acceleration])
        return np.asarray(body.mass_matrix(q) @ motion + body.velocity_forces(omega, q, rate))

    def summed(q: Array, rate: Array, acceleration: Array) -> Array:
        r = places + shapes @ q
        moved = a + np.cross(omega_rate, r) + np.cross(omega, np.cross(omega, r) + 2 * shapes @ rate)
        forces = mass @ (moved + shapes @ acceleration)
        moment, work = np.cross(r, forces).sum(axis=0), np.einsum("nak,na->k", shapes, forces)
        return np.concatenate([forces.sum(axis=0), moment, work])

    ours, theirs = (of(q, rate, acceleration) for of in (found, summed))
    scale = np.abs(theirs).max()
    exact = np.r_[0:3, 6 : len(ours)]
    np.testing.assert_allclose(ours[exact], theirs[exact], rtol=0, atol=DIGITS * scale)
    ours, theirs = (of(zero, rate, acceleration) for of in (found, summed))
    np.testing.assert_allclose(ours[3:6], theirs[3:6], rtol=0, atol=DIGITS * scale)
    ours, theirs = ((of(q, zero, zero) - of(-q, zero, zero)) / 2 for of in (found, summed))
    np.testing.assert_allclose(ours[3:6], theirs[3:6], rtol=0, atol=DIGITS * scale)


def test_nodes(tmp_path: Path) -> None:
    """Interfaces come first, then what has a name; the first rests, the others move as in the modal file."""
    model = reduce_link(frame_link(tmp_path, reduction={"fixed_interface_modes": 2}))
    names = write_sid(tmp_path / "l.sid_fem", model)
    assert list(names.items())[:3] == [("hub", 1), ("hand", 2), ("elbow", 3)]
    body, basis = Body(tmp_path / "l.sid_fem"), resting_body(model, "").basis
    q = np.random.default_rng(7).standard_normal(body.modes)
    for name, number in names.items():
        block = body.nodes[number - 1].inner
        node = model.node_names.get(name, model.interface_nodes[number - 1].node if number < 3 else -1)
        moved, turned = (np.asarray(shape) @ basis for shape in model.node_shape(node))
        np.testing.assert_allclose(block["phi"].at(q), moved, rtol=1e-11, atol=1e-11)
        np.testing.assert_allclose(block["psi"].at(q), turned, rtol=1e-11, atol=1e-11)
        np.testing.assert_allclose(block["origin"].at(q)[:, 0], model.nodes[node] + moved @ q, rtol=1e-10, atol=1e-10)
        expected = np.eye(3) + np.cross(turned @ q, np.eye(3)).T
        np.testing.assert_allclose(block["AP"].at(q), expected, rtol=1e-10, atol=1e-10)
    assert np.abs(body.nodes[0].inner["phi"].at(q)).max() < 1e-9


def test_heat_is_a_reference_force(tmp_path: Path) -> None:
    """A straight beam that its first end holds grows by α ΔT L."""
    link = straight_link(
        tmp_path, 2.0, 4, temperature_change=50.0, materials={"m": {"thermal_expansion": 2e-5}},
        interfaces=[{"name": "hub", "node": "root"}, {"name": "hand", "node": "tip"}],
    )  # fmt: skip
    write_sid(tmp_path / "l.sid_fem", reduce_link(link))
    body = Body(tmp_path / "l.sid_fem")
    zero = np.zeros(body.modes)
    q = -np.linalg.solve(body.get("Ke", zero), body.get("ksigma", zero)[:, 0])
    moved = body.nodes[1].inner["phi"].at(zero) @ q
    np.testing.assert_allclose(moved, [2e-5 * 50 * 2, 0, 0], atol=1e-9)


def test_physical_coordinates_give_the_same_modes(tmp_path: Path) -> None:
    """But for their signs: what is even in each mode is equal."""
    told: list[dict[str, Any]] = []
    for form in ("orthonormal", "physical"):
        model = reduce_link(frame_link(tmp_path, reduction={"form": form}))
        write_sid(tmp_path / "l.sid_fem", model)
        body = Body(tmp_path / "l.sid_fem")
        zero = np.zeros(body.modes)
        told.append({name: np.diag(body.get(name, zero)) for name in ("Me", "Ke")})
    for name, expected in told[0].items():
        np.testing.assert_allclose(told[1][name], expected, rtol=1e-7, err_msg=name)


def test_files_need_a_mode(tmp_path: Path) -> None:
    """And leave nothing where there is none."""
    with pytest.raises(FEImportError) as refused:
        write_sid(tmp_path / "l.sid_fem", reduce_link(frame_link(tmp_path, reduction={"elastic_modes": 0})))
    assert refused.value.cause == Cause.MODE_COUNT
    assert not list(tmp_path.glob("*.sid_fem"))
