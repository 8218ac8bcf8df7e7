"""Scene files (TOML) and their overrides read into checked scenes: chains, and scenes of bodies and beams."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import msgspec

from erls.errors import Cause, SceneError
from erls.scene.bodies.check import check_body_scene
from erls.scene.bodies.schema import BodyScene, BodySceneRecord
from erls.scene.chain import Scene, SceneRecord
from erls.scene.check import check_scene
from erls.scene.integrators import FIXED_STEP
from erls.scene.overrides import apply_override
from fe_import.files.toml import convert, read_toml

AnyScene = Scene | BodyScene


def load_scene(path: Path | str, overrides: Iterable[str] = ()) -> AnyScene:
    """Read and check a scene; its tables decide which kind it is.

    Parameters
    ----------
    path : Path or str
    overrides : iterable of str
        ``KEY=VALUE`` as on the command line: ``simulation.step=1e-4``, ``links.arm.elastic_modes=8``,
        ``joints.0.drive.type="free"``, ``beams.strip.elements=16``. Members of lists go by name or number.

    Returns
    -------
    Scene or BodyScene

    Raises
    ------
    SceneError, FEImportError
        Naming file, field, value and remedy.

    Examples
    --------
    >>> from erls import load_scene
    >>> scene = load_scene("data/l_shape/steel_tall.toml", ["simulation.duration=0.5"])
    >>> scene.record.simulation.duration
    0.5
    >>> load_scene("data/statics/roll_up.toml", ["beams.strip.elements=8"]).record.beams[0].elements
    8
    """
    path = Path(path)
    return scene_with(read_toml(path, SceneError), path, overrides)


def scene_with(data: dict[str, Any], path: Path, overrides: Iterable[str] = ()) -> AnyScene:
    """The scene of parsed tables, which overrides change.

    Raises
    ------
    SceneError, FEImportError
        As `load_scene`.
    """
    for text in overrides:
        apply_override(data, text)
    return checked(data, path, str(path))


def load_chain(path: Path | str, overrides: Iterable[str] = ()) -> Scene:
    """The same for what works on chains only.

    Raises
    ------
    SceneError, FEImportError
        Also for a scene of bodies.
    """
    return chain_alone(load_scene(path, overrides))


def chain_alone(scene: AnyScene) -> Scene:
    """A scene for what works on chains only.

    Raises
    ------
    SceneError
        It is one of bodies.
    """
    if isinstance(scene, BodyScene):
        message = "a scene of bodies, beams and connections, which is no chain of joints and links"
        remedy = "use erls simulate, info or view, and erls.simulate_many for variants"
        raise SceneError(Cause.BAD_FIELD, message, where=str(scene.path), remedy=remedy)
    return scene


def checked(data: dict[str, Any], path: Path, where: str) -> AnyScene:
    """The scene of parsed tables.

    Parameters
    ----------
    data : dict
    path : Path
        Of the scene file.
    where : str
        Where the tables come from, for messages.

    Raises
    ------
    SceneError, FEImportError
        Naming file, field, value and remedy.
    """
    if is_body_scene(data):
        bodies = convert(data, BodySceneRecord, where, SceneError)
        check_body_scene(bodies, where)
        return BodyScene(path, bodies)
    chain = _with_integrator(convert(data, SceneRecord, where, SceneError))
    check_scene(chain, where)
    return Scene(path, _in_order(chain))


def _in_order(record: SceneRecord) -> SceneRecord:
    """The record with links in the order of the joints that carry them."""
    links = {link.name: link for link in record.links}
    order = [joint.carries or link.name for joint, link in zip(record.joints, record.links, strict=True)]
    joints = [msgspec.structs.replace(joint, carries="") for joint in record.joints]
    return msgspec.structs.replace(record, links=[links[name] for name in order], joints=joints)


def is_body_scene(data: dict[str, Any]) -> bool:
    """Whether tables are those of a scene of bodies."""
    return not {"bodies", "beams", "shells"}.isdisjoint(data) and {"joints", "links"}.isdisjoint(data)


def _with_integrator(record: SceneRecord) -> SceneRecord:
    """The record with the name of the integrator."""
    s = record.simulation
    if s.integrator:
        return record
    settings = msgspec.structs.replace(s, integrator="auto" if s.step is None else FIXED_STEP)
    return msgspec.structs.replace(record, simulation=settings)
