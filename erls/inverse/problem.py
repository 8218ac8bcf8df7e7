"""From a scene to what an inversion works on: the tree with its conditions, and the same of rigid links."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.registry import TREES, system_of
from erls.equations.serial.formulation import SerialFormulation
from erls.errors import Cause, SceneError
from erls.inverse.closing import Closing
from erls.inverse.conditions import Conditions, conditions_of
from erls.inverse.frames import with_ends
from erls.inverse.least_effort import of_least_effort
from erls.inverse.opened import opened
from erls.inverse.servoed import Servoed
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.curves import piecewise
from erls.mechanism.drives import Drive
from erls.mechanism.without_effects import with_rigid
from erls.scene.build import Message, build_mechanism
from erls.scene.chain import Scene
from fe_import.model import IntArray

STEP = 1e-3
"""Of scenes that give none [s]."""

_FEWEST = 3  # steps that a cubic table of drives needs
_MOST = 50_000_000
"""Numbers of one matrix at all knots, 400 MB; there are some ten."""

_SYSTEMS = {
    "pieces": ("formulation", "leave links in one piece (substructures = 1)"),
    "quasi-static": ("bandwidth", "remove it: fast internal motions follow by inverse.bandwidth"),
    "absolute": ("coordinates", "use coordinates = 'independent'"),
}
"""Kinds of systems that are not inverted yet, with the field of the settings that says so."""


@dataclass(frozen=True)
class Problem:
    """An inversion.

    Attributes
    ----------
    scene : Scene
    mechanism : Mechanism
        Of the scene.
    conditions : Conditions
    drives : tuple of str
        Joints whose efforts are unknown.
    flexible : Servoed
    rigid : Servoed
        Of rigid links, joints that nothing drives held where they start.
    t : (k,) array
        Knots [s].
    warnings : tuple of str
    """

    scene: Scene
    mechanism: Mechanism
    conditions: Conditions
    drives: tuple[str, ...]
    flexible: Servoed
    rigid: Servoed
    t: Array
    warnings: tuple[str, ...]

    @property
    def step(self) -> float:
        """Between knots [s]."""
        return float(self.t[1] - self.t[0])


def problem_of(scene: Scene, tell: Message = lambda text: None) -> Problem:
    """Read a scene for its inversion.

    Raises
    ------
    SceneError, FEImportError
        Bad input, or a scene that cannot be inverted; TOO_FEW_DRIVES.
    """
    scene = opened(scene)
    built = build_mechanism(scene, tell)
    mechanism = built.mechanism
    _refuse(scene, mechanism)
    drives = unknown_drives(scene, mechanism)
    conditions = conditions_of(scene, mechanism)
    _refuse_number(scene, mechanism, conditions, [mechanism.joints[k].name for k in drives.tolist()])
    free = with_drives(mechanism, {k: Drive() for k in drives.tolist()})
    bare = with_rigid(free, {link.name for link in mechanism.links})
    warnings = built.warnings
    if len(drives) > len(conditions.every):
        tell("finding the motion of least effort")
        held = conditions
        conditions, settled = of_least_effort(held, partial(_rigid, scene, bare, drives=drives))
        spare = ", ".join(each.name for each in conditions.every[len(held.every) :])
        far = "" if settled else ", as far as the search for it came"
        warnings = (*warnings, f"{spare}: moved for the least effort of rigid links{far}")
    flexible = _servoed(scene, free, conditions, drives)
    stiff = _rigid(scene, bare, conditions, drives)
    t = _knots(scene, flexible.tree.size)
    names = tuple(mechanism.joints[k].name for k in drives.tolist())
    return Problem(scene, mechanism, conditions, names, flexible, stiff, t, warnings)


def _knots(scene: Scene, size: int) -> Array:
    """(k,) times of the knots, of as many coordinates.

    Raises
    ------
    SceneError
        BAD_FIELD: too few, or more than there is memory for.
    """
    settings, (field, step) = scene.record.simulation, _step_of(scene)
    count, where = round(settings.duration / (step or STEP)), f"{scene.path}: {field}"
    if count < _FEWEST:
        message, remedy = "too few steps for the duration", f"give {settings.duration / _FEWEST:.6g} s or less"
        raise SceneError(Cause.BAD_FIELD, message, where=where, value=step, remedy=remedy)
    refuse_many(scene, count, size, "links with fewer modes (elastic_modes)")
    return np.linspace(0.0, settings.duration, count + 1)


def _step_of(scene: Scene) -> tuple[str, float | None]:
    """The field that says the distance of knots, and what it says."""
    settings, own = scene.record.simulation, scene.record.inverse.step
    return ("simulation.step", settings.step) if own is None else ("inverse.step", own)


def refuse_many(scene: Scene, count: int, size: int, fewer: str) -> None:
    """Raise where there is no memory for as many steps of as many coordinates.

    Raises
    ------
    SceneError
        BAD_FIELD
    """
    if count * size**2 > _MOST:
        message, where = f"too many steps for {size} coordinates", f"{scene.path}: {_step_of(scene)[0]}"
        remedy = f"give a larger step, a shorter duration, or {fewer}"
        raise SceneError(Cause.BAD_FIELD, message, where=where, value=count, limit=_MOST // size**2, remedy=remedy)


def unknown_drives(scene: Scene, mechanism: Mechanism) -> IntArray:
    """(r,) joints whose efforts are unknown, by their numbers."""
    names = scene.record.inverse.drives
    found = [
        k
        for k, joint in enumerate(mechanism.joints)
        if not joint.fixed and (joint.name in names if names else joint.drive.kind != "free")
    ]
    return np.array(found, dtype=np.int64)


def with_drives(mechanism: Mechanism, drives: dict[int, Drive]) -> Mechanism:
    """With other drives of some joints, by their numbers, from where its links are straight."""
    joints = (replace(joint, drive=drives[k]) if k in drives else joint for k, joint in enumerate(mechanism.joints))
    return replace(mechanism, joints=tuple(joints), static_start=False)


def _servoed(scene: Scene, mechanism: Mechanism, conditions: Conditions, drives: IntArray) -> Servoed:
    settings = scene.record.simulation
    closing = Closing(ClosedChain(TREES[settings.formulation](mechanism, settings))) if mechanism.loops else None
    return Servoed(_tree(scene, mechanism, conditions), conditions, drives, closing)


def _rigid(scene: Scene, mechanism: Mechanism, conditions: Conditions, drives: IntArray) -> Servoed:
    """Of rigid links, with the joints held that neither are driven nor close loops."""
    moving = set(drives.tolist())
    if mechanism.loops:
        closed = _servoed(scene, mechanism, conditions, drives)
        moving |= set(closed.tree.free_joints[closed.dependent].tolist())
    held = {
        k: Drive("motion", motion=joint.drive.motion or piecewise([], [joint.position]))
        for k, joint in enumerate(mechanism.joints)
        if not joint.drive.prescribed and k not in moving
    }
    return _servoed(scene, with_drives(mechanism, held), conditions, drives)


def _tree(scene: Scene, mechanism: Mechanism, conditions: Conditions) -> SerialFormulation:
    settings = scene.record.simulation
    tree = TREES[settings.formulation](with_ends(mechanism, conditions.points), settings)
    assert isinstance(tree, SerialFormulation)
    return tree


def _refuse_number(scene: Scene, mechanism: Mechanism, conditions: Conditions, drives: list[str]) -> None:
    wanted, given = len(conditions.every), len(drives)
    if wanted == given or (wanted < given and given <= _motions(scene, mechanism)):
        return
    where, names = f"{scene.path}: servo", ", ".join(each.name for each in conditions.every)
    if wanted > given:
        raise SceneError(
            Cause.TOO_FEW_DRIVES,
            f"fewer drives ({', '.join(drives) or 'none'}) than conditions ({names})",
            where=where,
            value=given,
            limit=wanted,
            remedy="demand less, or name more drives (inverse.drives)",
        )
    raise SceneError(
        Cause.BAD_FIELD,
        f"more drives ({', '.join(drives)}) than motions that loops leave rigid links: no motion says how they share "
        "their efforts",
        where=where,
        value=given,
        limit=_motions(scene, mechanism),
        remedy="name fewer drives (inverse.drives)",
    )


def _motions(scene: Scene, mechanism: Mechanism) -> int:
    """Of rigid links, what is prescribed as it is."""
    settings = scene.record.simulation
    tree = TREES[settings.formulation](with_rigid(mechanism, {link.name for link in mechanism.links}), settings)
    return tree.size - (len(ClosedChain(tree).kept) if mechanism.loops else 0)


def _refuse(scene: Scene, mechanism: Mechanism) -> None:
    """Refuse what cannot be inverted yet.

    Raises
    ------
    SceneError
        BAD_FIELD: names what.
    """
    settings = scene.record.simulation

    def refused(field: str, what: str, remedy: str) -> SceneError:
        where = f"{scene.path}: simulation.{field}" if field else str(scene.path)
        return SceneError(Cause.BAD_FIELD, f"{what} cannot be inverted", where=where, remedy=remedy)

    kind = system_of(mechanism, settings)
    if kind in _SYSTEMS:
        field, remedy = _SYSTEMS[kind]
        raise refused(field, f"a scene with {getattr(settings, field)!r}", remedy)
    if settings.gauge == "minimum-norm":
        raise refused("gauge", "the minimum-norm gauge", "use gauge = 'joint-angle'")
    if settings.effects == "auto":
        raise refused("effects", "a scene that chooses its effects", "use 'all', or the names of effects")
    if mechanism.rotation_vectors:
        raise refused("", "a joint that turns by a rotation vector", "use universal and revolute joints")
    closing = [(loop.name, loop.freedom.forces) for loop in mechanism.loops if loop.freedom is not None]
    for name, forces in [*((joint.name, joint.forces) for joint in mechanism.joints), *closing]:
        if forces.sticks or forces.stops:
            raise refused("", f"joint {name!r} with stops or with friction that sticks", "remove them")
    if mechanism.contacts:
        raise refused("", "a scene with contacts", "remove [[contacts]]")
