"""What friction that sticks does not go with: more than the equations of trees in independent coordinates, which loops
may tie, and nodal ones.
"""

from __future__ import annotations

from collections.abc import Sequence

from erls.errors import SceneError
from erls.scene.chain import SceneRecord
from erls.scene.checks import bad
from erls.scene.joints import Acting, Friction, Joint, Loop


def _sticking(kind: str, joints: Sequence[Joint] | Sequence[Loop]) -> list[tuple[str, Friction]]:
    """Joints and coordinates of this law, by their paths."""
    given: list[tuple[str, Acting]] = []
    for k, joint in enumerate(joints):
        given.append((f"{kind}[{k}]", joint))
        given += [(f"{kind}[{k}].coordinates.{name}", c) for name, c in getattr(joint, "coordinates", {}).items()]
    found = [(place, acting.friction) for place, acting in given if acting.friction is not None]
    return [(place, friction) for place, friction in found if friction.law == "stick"]


def _refuse_frictionless(scene: SceneRecord, file: str) -> None:
    """Joints that are held where closing joints are need a force while they slide, of which what holds them is told."""
    for place, friction in [*_sticking("joints", scene.joints), *_sticking("loops", scene.loops)]:
        if friction.force == 0.0 and friction.static_force:
            message = "where joints of [[loops]] stick, one that sticks rubs while it slides, too"
            remedy = "give a force > 0, or use simulation.formulation = 'nodal'"
            raise bad(f"{file}: {place}.friction.force", message, friction.force, remedy)


def check_sticking(scene: SceneRecord, file: str) -> None:
    """Refuse it there.

    Raises
    ------
    SceneError
        BAD_FIELD, naming the first such joint.
    """

    def refused(place: str, what: str, remedy: str) -> SceneError:
        message = f"exact sticking does not go with {what}"
        return bad(f"{file}: {place}.friction.law", message, "stick", remedy)

    touching = [f"contacts[{k}]" for k, x in enumerate(scene.contacts) if x.friction and x.friction.law == "stick"]
    closing = _sticking("loops", scene.loops)
    if closing and scene.simulation.formulation != "nodal":
        _refuse_frictionless(scene, file)
    places, s = [*(place for place, _ in [*_sticking("joints", scene.joints), *closing]), *touching], scene.simulation
    for found, what in (
        (s.coordinates == "absolute", "simulation.coordinates = 'absolute'"),
        (s.gauge == "minimum-norm", "simulation.gauge = 'minimum-norm'"),
        (s.bandwidth is not None, "simulation.bandwidth"),
        (any(link.substructures > 1 and link.flexible for link in scene.links), "substructures"),
    ):
        if found and places:
            raise refused(places[0], what, "use law = 'smooth'")
