"""What friction that sticks does not go with: more than the equations of trees in independent coordinates, which loops
may tie, and nodal ones.
"""

from __future__ import annotations

from collections.abc import Sequence

from erls.errors import SceneError
from erls.scene.chain import SceneRecord
from erls.scene.checks import bad
from erls.scene.joints import Acting, Joint, Loop


def _sticking(kind: str, joints: Sequence[Joint] | Sequence[Loop]) -> list[str]:
    """Paths of the joints and coordinates of this law."""
    given: list[tuple[str, Acting]] = []
    for k, joint in enumerate(joints):
        given.append((f"{kind}[{k}]", joint))
        given += [(f"{kind}[{k}].coordinates.{name}", c) for name, c in getattr(joint, "coordinates", {}).items()]
    return [place for place, acting in given if acting.friction is not None and acting.friction.law == "stick"]


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

    closing = _sticking("loops", scene.loops)
    if closing and scene.simulation.formulation != "nodal":
        remedy = "close the loop by another joint, and list this one under [[joints]]; or use law = 'smooth'"
        raise refused(closing[0], "a joint of [[loops]] but in simulation.formulation = 'nodal'", remedy)
    touching = [f"contacts[{k}]" for k, x in enumerate(scene.contacts) if x.friction and x.friction.law == "stick"]
    places, s = [*_sticking("joints", scene.joints), *touching], scene.simulation
    for found, what in (
        (s.coordinates == "absolute", "simulation.coordinates = 'absolute'"),
        (s.gauge == "minimum-norm", "simulation.gauge = 'minimum-norm'"),
        (s.bandwidth is not None, "simulation.bandwidth"),
        (any(link.substructures > 1 and link.flexible for link in scene.links), "substructures"),
    ):
        if found and places:
            raise refused(places[0], what, "use law = 'smooth'")
