"""From a description to its model: members, names, axes, materials, point masses and units."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from link_files import (
    FRAME,
    SOLID,
    Array,
    clamped_flexibility,
    frame_link,
    merged,
    random_rotation,
    solid_link,
    straight_link,
    write_box,
    write_toml,
)

from fe_import.description.link import load_link
from fe_import.description.reduction import Reduction
from fe_import.errors import FEImportError
from fe_import.modal.inertia import MassProperties, mass_properties
from fe_import.model import FEModel
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link

ONLY_CONSTRAINT = {"method": "craig-bampton", "fixed_interface_modes": 0}
E, NU, RHO = 7e10, 0.33, 2700.0
G = E / (2 * (1 + NU))


def properties(model: FEModel) -> MassProperties:
    fields = model.rigid_body_modes()
    return mass_properties(fields.T @ (model.mass @ fields))


def member(start: str, end: str, **changes: Any) -> dict[str, Any]:
    return {"from": start, "to": end, "material": "m", "section": "s", **changes}


def test_defaults_of_the_description(tmp_path: Path) -> None:
    """What a description that says nothing more means."""
    link = frame_link(tmp_path)
    d = link.description
    assert d.name == "link"
    assert d.frame is not None
    assert (d.frame.theory, d.frame.mass, d.frame.rotary_inertia, d.frame.torsion) == (
        "timoshenko", "consistent", True, "saint-venant",
    )  # fmt: skip
    assert d.reduction == Reduction("craig-bampton", None, None, "free-free", "", "orthonormal")
    assert frame_link(tmp_path, name="named").description.name == "named"
    assert link.folder == tmp_path


def test_overrides_replace_fields_of_the_reduction(tmp_path: Path) -> None:
    path = frame_link(tmp_path, reduction={"elastic_modes": 3}).path
    changed = load_link(path, {"method": "none", "elastic_modes": 4}).description.reduction
    assert (changed.method, changed.elastic_modes) == ("none", 4)
    assert load_link(path).description.reduction.elastic_modes == 3


def test_inner_nodes_have_names_and_places(tmp_path: Path) -> None:
    """FROM-TO/1 ... in order along the member, equally spaced, and interfaces may sit there."""
    interfaces = [{"name": "a", "node": "elbow-tip/2"}, {"name": "b", "node": "root"}]
    model = build_model(frame_link(tmp_path, interfaces=interfaces))
    inner = [f"{m}/{k}" for m in ("root-elbow", "elbow-tip") for k in (1, 2)]
    assert list(model.node_names) == ["root", "elbow", "tip", *inner]
    nodes = FRAME["frame"]["nodes"]
    for start, end in (("root", "elbow"), ("elbow", "tip")):
        a, b = (np.array(nodes[n]) for n in (start, end))
        for k in (1, 2):
            place = model.nodes[model.node_names[f"{start}-{end}/{k}"]]
            np.testing.assert_allclose(place, a + k / 3 * (b - a), atol=1e-16)
    assert model.interface_nodes[0].node == model.node_names["elbow-tip/2"]
    assert len(model.lines) == 6


def test_members_share_nodes(tmp_path: Path) -> None:
    """A triangle with a strut: one node each, dofs counted once, centre of mass that of its three sides."""
    nodes = {"a": [0.0, 0.0, 0.0], "b": [0.3, 0.0, 0.0], "c": [0.0, 0.4, 0.0]}
    sides = [member("a", "b", elements=2), member("b", "c", elements=3), member("c", "a")]
    path = write_toml(
        tmp_path / "t.toml",
        {**FRAME, "frame": {"nodes": nodes, "members": sides}, "interfaces": [{"name": "a", "node": "a"}]},
    )
    model = build_model(load_link(path))
    assert len(model.nodes) == 6
    assert model.mass.shape == (36, 36)
    found, per_length = properties(model), RHO * 2e-4
    assert found.mass == pytest.approx(1.2 * per_length, rel=1e-13)
    centre = (0.3 * np.array([0.15, 0, 0]) + 0.5 * np.array([0.15, 0.2, 0]) + 0.4 * np.array([0, 0.2, 0])) / 1.2
    np.testing.assert_allclose(found.centre_of_mass, centre, atol=1e-15)


def test_stepped_beam_of_two_materials(tmp_path: Path) -> None:
    """Tip flexibility of two lengths in series, each with its own material and section, closed form to 1e-10."""
    second = {"youngs_modulus": 2e11, "poissons_ratio": 0.25, "density": 7800.0}
    changes = {
        "materials": {"n": second},
        "sections": {"t": {"shape": "circular", "diameter": 0.015, "shear_factor": 0.9}},
        "frame": {
            "nodes": {"root": [0.0, 0, 0], "mid": [0.3, 0, 0], "tip": [0.5, 0, 0]},
            "members": [member("root", "mid", elements=2), member("mid", "tip", material="n", section="t")],
        },
        "reduction": ONLY_CONSTRAINT,
    }
    path = write_toml(tmp_path / "l.toml", merged({**FRAME, "frame": {}}, changes))
    modal = reduce_link(path)
    i1, a1, a2 = 0.01 * 0.02**3 / 12, 2e-4, np.pi * 0.015**2 / 4
    i2, g2, l1, l2 = np.pi * 0.015**4 / 64, 2e11 / 2.5, 0.3, 0.2
    shear = l1 / (5 / 6 * G * a1) + l2 / (0.9 * g2 * a2)
    bend = (l1**3 / 3 + l1**2 * l2 + l1 * l2**2) / (E * i1) + l2**3 / (3 * 2e11 * i2)
    flexibility = clamped_flexibility(modal)
    assert flexibility[0, 0] == pytest.approx(l1 / (E * a1) + l2 / (2e11 * a2), rel=1e-10)
    assert flexibility[2, 2] == pytest.approx(bend + shear, rel=1e-10)
    assert modal.mass_properties.mass == pytest.approx(RHO * a1 * l1 + 7800 * a2 * l2, rel=1e-12)


def tip_deflection(tmp_path: Path, direction: Array, local_z: Array | None) -> Array:
    """(3, 3) tip flexibility of a straight Euler-Bernoulli member, width 0.01 and height 0.02, length 0.5."""
    one = member("root", "tip") if local_z is None else member("root", "tip", local_z=local_z.tolist())
    frame = {
        "theory": "euler-bernoulli",
        "nodes": {"root": [0.1, 0.2, 0.3], "tip": (np.array([0.1, 0.2, 0.3]) + 0.5 * direction).tolist()},
        "members": [one],
    }
    path = write_toml(tmp_path / "l.toml", {**FRAME, "frame": frame, "reduction": ONLY_CONSTRAINT})
    return clamped_flexibility(reduce_link(path))[:3, :3]


STIFF, SOFT = (0.5**3 / (3 * E * i) for i in (0.01 * 0.02**3 / 12, 0.02 * 0.01**3 / 12))  # along height, along width
AXES = np.eye(3)


@pytest.mark.parametrize(
    ("direction", "local_z", "height"),
    [
        (AXES[0], None, AXES[2]),  # z unless given
        (AXES[1], None, AXES[2]),
        (AXES[2], None, AXES[1]),  # y for members along z
        (-AXES[2], None, AXES[1]),
        (AXES[2], AXES[0], AXES[0]),
        (AXES[0], AXES[1], AXES[1]),
        (AXES[0], np.array([5.0, 3.0, 0.0]), AXES[1]),  # only the part across the member counts
        (np.array([0.6, 0.0, 0.8]), None, np.array([-0.8, 0.0, 0.6])),  # as near z as possible
    ],
)
def test_local_axes(tmp_path: Path, direction: Array, local_z: Array | None, height: Array) -> None:
    """Deflection L³/3EI along the section's height and along its width, to 1e-10; no coupling."""
    flexibility = tip_deflection(tmp_path, direction, local_z)
    width = np.cross(height, direction)
    expected = (
        STIFF * np.outer(height, height)
        + SOFT * np.outer(width, width)
        + 0.5 / (E * 2e-4) * np.outer(direction, direction)
    )
    np.testing.assert_allclose(flexibility, expected, atol=1e-10 * SOFT)


def test_torsion_choice(tmp_path: Path) -> None:
    """Twist L/GJ of the tip with Saint-Venant's or the polar constant."""
    for torsion, constant in (("polar", 2e-4 * (0.01**2 + 0.02**2) / 12), ("saint-venant", 0.2286816 * 0.02 * 0.01**3)):
        link = straight_link(tmp_path, 0.5, 2, frame={"torsion": torsion}, reduction=ONLY_CONSTRAINT)
        assert clamped_flexibility(reduce_link(link))[3, 3] == pytest.approx(0.5 / (G * constant), rel=1e-6)


# ----- point masses


def test_point_masses_and_inertias(tmp_path: Path) -> None:
    """Mass properties of the link with bodies on it: parallel axes, closed form to 1e-12."""
    full = random_rotation(2) @ np.diag([1e-3, 2e-3, 2.5e-3]) @ random_rotation(2).T
    bare, loaded = (
        build_model(frame_link(tmp_path, masses=masses))
        for masses in (
            [],
            [
                {"node": "hub", "mass": 0.3, "inertia": [1e-3, 2e-3, 3e-3]},  # an interface by its name
                {"node": "elbow-tip/1", "mass": 0.2},
                {"node": "tip", "inertia": ((full + full.T) / 2).tolist()},
                {"node": "tip", "mass": 0.1},  # adds to the one before
            ],
        )
    )
    nodes, names = bare.nodes, bare.node_names
    bodies = [(0.3, nodes[names["root"]], np.diag([1e-3, 2e-3, 3e-3])), (0.2, nodes[names["elbow-tip/1"]], 0),
              (0.1, nodes[names["tip"]], full)]  # fmt: skip
    start = properties(bare)
    bodies.append((start.mass, start.centre_of_mass, start.inertia))
    mass = sum(m for m, _, _ in bodies)
    centre = sum(m * c for m, c, _ in bodies) / mass
    inertia = sum(j + m * ((d := c - centre) @ d * np.eye(3) - np.outer(d, d)) for m, c, j in bodies)
    found = properties(loaded)
    assert found.mass == pytest.approx(mass, rel=1e-12)
    np.testing.assert_allclose(found.centre_of_mass, centre, atol=1e-12)
    np.testing.assert_allclose(found.inertia, inertia, atol=1e-12 * np.abs(inertia).max())
    assert (bare.stiffness != loaded.stiffness).nnz == 0


def test_point_mass_on_a_solid(tmp_path: Path) -> None:
    """On an interface with inertia, on a named mesh node without."""
    nodes = {"edge": [0.3, 0.02, 0.03]}
    masses = [{"node": "hand", "mass": 0.5, "inertia": [1e-3, 1e-3, 2e-3]}, {"node": "edge", "mass": 0.25}]
    bare, loaded = (build_model(solid_link(tmp_path, solid={"nodes": nodes}, masses=m)) for m in ([], masses))
    np.testing.assert_allclose(bare.nodes[bare.node_names["edge"]], nodes["edge"], atol=1e-15)
    before, after = properties(bare), properties(loaded)
    assert before.mass == pytest.approx(2700 * 0.3 * 0.02 * 0.03, rel=1e-12)
    assert after.mass == pytest.approx(before.mass + 0.75, rel=1e-12)
    moment = before.mass * before.centre_of_mass + 0.5 * np.array([0.3, 0.01, 0.015]) + 0.25 * np.array(nodes["edge"])
    np.testing.assert_allclose(after.centre_of_mass * after.mass, moment, atol=1e-13)


# ----- units

MM, TONNE = 1e-3, 1e3  # mm, t, s: forces in N, stresses in MPa
INCH, POUND = 0.0254, 0.45359237


def scaled_material(length: float, mass: float, time: float) -> dict[str, Any]:
    pressure = mass / (length * time**2)
    return {"m": {"youngs_modulus": E / pressure, "poissons_ratio": NU, "density": RHO / (mass / length**3)}}


def same_matrices(a: FEModel, b: FEModel) -> None:
    """Mass, stiffness and their parts to 1e-12 of the diagonal; nodes and coupling likewise."""
    pairs = [(a.mass, b.mass), (a.stiffness, b.stiffness)]
    pairs += [(p, b.stiffness_parts[name]) for name, p in a.stiffness_parts.items()]
    for one, other in pairs:
        d = one.diagonal()
        scale = sp.diags_array(1 / np.sqrt(np.where(d > 0, d, 1)))
        assert abs(scale @ (one - other) @ scale).max() < 1e-12
    np.testing.assert_allclose(a.nodes, b.nodes, atol=1e-12 * np.abs(a.nodes).max())
    for one, other in zip(a.interface_nodes, b.interface_nodes, strict=True):
        np.testing.assert_allclose(one.position, other.position, atol=1e-14)
    assert (a.coupling is None) == (b.coupling is None)
    if a.coupling is not None:
        assert abs(a.coupling - b.coupling).max() < 1e-14


UNITS = [
    ({"length": "mm", "mass": "t", "time": "s"}, MM, TONNE, 1.0),
    ({"length": "cm", "mass": "g", "time": "ms"}, 1e-2, 1e-3, 1e-3),
    ({"length": "in", "mass": "lb", "time": "s"}, INCH, POUND, 1.0),
    ({"length": "in", "mass": "lbf*s2/in"}, INCH, POUND * 9.80665 / INCH, 1.0),  # the inch-pound-force system
    ({"length": "ft", "mass": "slug"}, 12 * INCH, POUND * 9.80665 / (12 * INCH), 1.0),
]


@pytest.mark.parametrize(("units", "length", "mass", "time"), UNITS)
def test_units_of_a_frame(tmp_path: Path, units: dict[str, str], length: float, mass: float, time: float) -> None:
    """The same frame with point masses in SI and in other units gives the same matrices."""
    masses = [{"node": "hand", "mass": 0.4, "inertia": [1e-3, 2e-3, 3e-3]}]
    si = build_model(frame_link(tmp_path, masses=masses))
    nodes = {k: [x / length for x in v] for k, v in FRAME["frame"]["nodes"].items()}
    other = frame_link(
        tmp_path,
        units=units,
        materials=scaled_material(length, mass, time),
        sections={"s": {"width": 0.01 / length, "height": 0.02 / length}},
        frame={"nodes": nodes},
        masses=[{"node": "hand", "mass": 0.4 / mass, "inertia": [x / mass / length**2 for x in (1e-3, 2e-3, 3e-3)]}],
    )
    same_matrices(si, build_model(other))


@pytest.mark.parametrize(("units", "length", "mass", "time"), UNITS[:3])
def test_units_of_a_solid(tmp_path: Path, units: dict[str, str], length: float, mass: float, time: float) -> None:
    """The same solid, its coupling of rotations to displacements included; frequencies to 1e-9."""
    masses = [{"node": "hand", "mass": 0.4, "inertia": [1e-3, 2e-3, 3e-3]}]
    si = solid_link(tmp_path, masses=masses, solid={"nodes": {"edge": [0.3, 0.02, 0.03]}})
    write_box(tmp_path / "scaled.inp", 1 / length)
    data = merged(
        SOLID,
        {
            "units": units,
            "materials": scaled_material(length, mass, time),
            "solid": {"mesh": "scaled.inp", "nodes": {"edge": [x / length for x in (0.3, 0.02, 0.03)]}},
            "masses": [
                {"node": "hand", "mass": 0.4 / mass, "inertia": [x / mass / length**2 for x in (1e-3, 2e-3, 3e-3)]}
            ],
        },
    )
    other = load_link(write_toml(tmp_path / "scaled.toml", data))
    one, two = build_model(si), build_model(other)
    same_matrices(one, two)
    assert one.node_names == two.node_names
    a, b = reduce_link(si), reduce_link(other)
    np.testing.assert_allclose(a.frequencies_hz[6:], b.frequencies_hz[6:], rtol=1e-9)


def test_regions_of_a_solid(tmp_path: Path) -> None:
    """Element sets, named in any case, with materials of their own: mass of each part, closed form."""
    write_box(tmp_path / "box.inp")
    text = (tmp_path / "box.inp").read_text(encoding="utf-8")
    sets = "*ELSET, ELSET=near\n1,\n*ELSET, ELSET=far\n2, 3\n"
    (tmp_path / "box.inp").write_text(text + sets, encoding="utf-8")
    data = {
        **SOLID,
        "materials": {**SOLID["materials"], "n": {"youngs_modulus": 2e11, "poissons_ratio": 0.3, "density": 7800.0}},
        "solid": {"mesh": "box.inp", "regions": [{"set": "NEAR", "material": "n"}, {"set": "far", "material": "m"}]},
    }
    model = build_model(load_link(write_toml(tmp_path / "link.toml", data)))
    found, volume = properties(model), 0.02 * 0.03
    assert found.mass == pytest.approx(volume * (0.1 * 7800 + 0.2 * 2700), rel=1e-12)
    moment = volume * (0.1 * 7800 * 0.05 + 0.2 * 2700 * 0.2)
    assert found.centre_of_mass[0] == pytest.approx(moment / found.mass, rel=1e-12)


def test_interface_position_of_a_solid(tmp_path: Path) -> None:
    """The interface node stands where the description says; the stiffness seen there moves with it."""
    interfaces = [{"name": "hub", "face": "x0"}, {"name": "hand", "face": "x1", "position": [0.35, 0.0, 0.05]}]
    centred, moved = (solid_link(tmp_path, interfaces=i) for i in (SOLID["interfaces"], interfaces))
    one, two = reduce_link(centred), reduce_link(moved)
    np.testing.assert_allclose(two.interface_nodes[1].position, [0.35, 0.0, 0.05])
    np.testing.assert_allclose(one.interface_nodes[1].position, [0.3, 0.01, 0.015], atol=1e-15)
    arm = np.array([0.35, 0.0, 0.05]) - one.interface_nodes[1].position
    carry = np.eye(6)  # u₂ = u₁ + φ × arm
    carry[:3, 3:] = np.stack([np.cross(axis, arm) for axis in np.eye(3)], axis=1)
    expected = carry @ clamped_flexibility(one) @ carry.T
    np.testing.assert_allclose(clamped_flexibility(two), expected, atol=1e-8 * la.norm(expected))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_is_refused(tmp_path: Path) -> None:
    """Reading it would never end."""
    os.mkfifo(tmp_path / "link.toml")
    with pytest.raises(FEImportError, match="not a file"):
        load_link(tmp_path / "link.toml")
