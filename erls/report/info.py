"""What is in a file: the summary (JSON) and text of ``erls info``."""

from __future__ import annotations

import contextlib
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from erls.errors import Cause, SceneError
from erls.files.results import FAMILY
from erls.report.runs import run_report
from erls.report.tables import family_report, modal_report, table
from erls.run.file import EARLIER, load_run
from erls.run.file import SCHEMA as RUN_SCHEMA
from erls.scene.bodies.schema import BodyScene
from erls.scene.chain import Scene
from erls.scene.couplings import Coupling
from erls.scene.joints import Acting, Joint
from erls.scene.read import load_scene
from fe_import.description.link import LinkFile, load_link
from fe_import.files.hdf5.files import open_for_reading
from fe_import.files.toml import read_toml
from fe_import.modal.file import SCHEMA as MODAL_SCHEMA
from fe_import.modal.file import read_modal_file
from fe_import.modal.model import ModalModel

_HDF5 = b"\x89HDF\r\n\x1a\n"


def file_info(path: Path) -> tuple[dict[str, Any], str]:
    """Summary and text of a link, modal, scene or run file; the content decides which it is.

    Raises
    ------
    SceneError, FEImportError
        Not a file of this program, or a faulty one.
    """
    _refuse_pipe(path)
    try:
        with path.open("rb") as file:
            start = file.read(len(_HDF5))
    except (OSError, ValueError):
        start = b""  # reported by the reader below
    if start == _HDF5:
        with open_for_reading(path, SceneError, Cause.RUN_FILE) as reader:
            schema = reader.attribute("schema", str) if "schema" in reader.attribute_names() else ""
        if schema in (RUN_SCHEMA, EARLIER):
            run = load_run(path)
            failure = None if run.failure is None else run.failure.as_dict()
            text = "\n".join([run_report(run), *(f"warning: {w}" for w in run.warnings)])
            return {"file": "run", **run.summary(), "failure": failure}, text
        if schema == FAMILY:
            from fe_import.parametric.file import read_parametric_file

            summary = read_parametric_file(path).summary()
            return {"file": "family of links", **summary}, family_report(summary)
        if schema != MODAL_SCHEMA:
            raise SceneError(
                Cause.NOT_READABLE,
                "an HDF5 file, but neither a modal file nor a run file",
                where=str(path),
                value=schema or None,
                remedy="give a file that erls wrote",
            )
        return _modal_info(read_modal_file(path))
    if not {"joints", "simulation", "links", "bodies", "beams", "shells"}.isdisjoint(read_toml(path, SceneError)):
        scene = load_scene(path)
        return _body_scene_info(scene) if isinstance(scene, BodyScene) else _scene_info(scene)
    return _link_info(load_link(path))


def _refuse_pipe(path: Path) -> None:
    """What is no file on a disk cannot be read twice, and a pipe that nobody writes to never ends."""
    with contextlib.suppress(OSError, ValueError):  # reported by the readers
        mode = path.stat().st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
            message, remedy = "not a file but a pipe or device", "write it to a file, and give the path of that"
            raise SceneError(Cause.NOT_READABLE, message, where=str(path), remedy=remedy)


def _modal_info(model: ModalModel) -> tuple[dict[str, Any], str]:
    from fe_import.reduce import reduction_summary

    modes = [
        {"frequency_hz": float(f), "kind": kind, "damping_ratio": float(d), "residual": float(r)}
        for f, kind, d, r in zip(model.frequencies_hz, model.kinds, model.damping_ratios, model.residuals, strict=True)
    ]
    full = model.full_mass_properties
    summary = {
        "file": "modal",
        **reduction_summary(model),
        "modes": modes,
        "fixed_interface_modes": [
            {"frequency_hz": float(f), "effective_mass": share.tolist()}
            for f, share in zip(model.fixed_interface.frequencies_hz, model.fixed_interface.effective_mass, strict=True)
        ],
        "full_model": {
            "mass": full.mass,
            "centre_of_mass": full.centre_of_mass.tolist(),
            "inertia": full.inertia.tolist(),
        },
        "provenance": model.provenance,
    }
    return summary, modal_report(model)


def _drives(joint: Joint) -> str:
    """Of all coordinates of a joint."""
    acting: Mapping[str, Acting] = joint.coordinates or {"": joint}
    return ", ".join(f"{name} {msgspec.to_builtins(each.drive)['type']}".strip() for name, each in acting.items())


def _follows(coupling: Coupling) -> str:
    """What a coupling says, and how it gives way."""
    followed = " + ".join(f"{ratio:g} {name}" for name, ratio in coupling.follows.items())
    kind = ("play" if coupling.stops else "elastic") if coupling.elastic else "ideal"
    return f"{coupling.joint} = {followed.replace('+ -', '- ')}, {kind}"


def _scene_info(scene: Scene) -> tuple[dict[str, Any], str]:
    record = scene.record
    rows = [
        (joint.name, joint.type, _drives(joint), joint.on, link.name, _source(link))
        for joint, link in zip(record.joints, record.links, strict=True)
    ]
    simulation = msgspec.to_builtins(record.simulation)
    text = f"{scene.name}: scene with {len(rows)} joints\n\n" + table(
        ("joint", "type", "drive", "on", "link", "source"), rows
    )
    text += "\n\npoints: " + (", ".join(p.name for p in record.points) or "none")
    if record.loads:
        text += "\nloads: " + ", ".join(f"on {load.point or load.link}" for load in record.loads)
    if record.contacts:
        text += "\ncontacts: " + ", ".join(f"{c.name} ({c.point} on {c.plane.on})" for c in record.contacts)
    if record.loops:
        kinds = [msgspec.to_builtins(x.drive)["type"] for x in record.loops]
        driven = ["" if kind == "free" else f", {kind}" for kind in kinds]
        joined = (
            f"{x.name} ({x.type}, {x.link} to {x.to_link or 'ground'}{kind})"
            for x, kind in zip(record.loops, driven, strict=True)
        )
        text += "\nloops: " + ", ".join(joined)
    if record.couplings:
        text += "\ncouplings: " + ", ".join(f"{c.name} ({_follows(c)})" for c in record.couplings)
    text += "\nsimulation: " + ", ".join(f"{k} = {v}" for k, v in simulation.items() if v is not None)
    return {"file": "scene", "scene": scene.name, **msgspec.to_builtins(record)}, text


def _body_scene_info(scene: BodyScene) -> tuple[dict[str, Any], str]:
    record = scene.record
    rows = [(b.name, "rigid body", f"{b.mass:g} kg") for b in record.bodies]
    rows += [(b.name, "beam", f"{b.start} to {b.end}, {b.elements} elements") for b in record.beams]
    rows += [(s.name, "shell", s.mesh or f"{' x '.join(map(str, s.elements))} elements") for s in record.shells]
    rows += [(c.name, c.type, f"{c.node} to {c.to}") for c in record.connections]
    simulation = msgspec.to_builtins(record.simulation)
    text = f"{scene.name}: scene of bodies and beams\n\n" + table(("name", "kind", ""), rows)
    text += "\n\nsimulation: " + ", ".join(f"{k} = {v}" for k, v in simulation.items() if v is not None)
    return {"file": "scene", "scene": scene.name, **msgspec.to_builtins(record)}, text


def _source(link: Any) -> str:
    return str(link.model or link.modal_file or "rigid")


def _link_info(link: LinkFile) -> tuple[dict[str, Any], str]:
    from fe_import.modal.inertia import mass_properties
    from fe_import.models.model import build_model

    model = build_model(link)
    rigid = model.rigid_body_modes()
    properties = mass_properties(rigid.T @ (model.mass @ rigid))
    summary = {
        "file": "link",
        "link": link.description.name,
        "kind": model.kind,
        "nodes": len(model.nodes),
        "dofs": len(model.independent),
        "interfaces": [i.name for i in model.interface_nodes],
        "mass": properties.mass,
        "centre_of_mass": properties.centre_of_mass.tolist(),
        "inertia": properties.inertia.tolist(),
        "reduction": msgspec.to_builtins(link.description.reduction),
    }
    text = "\n".join(f"{key}: {value}" for key, value in summary.items() if key != "file")
    return summary, text
