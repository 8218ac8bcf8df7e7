"""What bushings need, and what they do not go with."""

from __future__ import annotations

from erls.scene.chain import SceneRecord
from erls.scene.checks import bad, check_ends


def check_bushings(scene: SceneRecord, file: str) -> None:
    """Refuse bushings that cannot be meant.

    Raises
    ------
    SceneError
        BAD_FIELD, BAD_REFERENCE: naming file, field, value and remedy.
    """
    links, s = [link.name for link in scene.links], scene.simulation
    taken = {joint.name for joint in scene.joints} | {loop.name for loop in scene.loops}
    for k, bushing in enumerate(scene.bushings):
        place = f"{file}: bushings[{k}]"
        if bushing.name in taken:
            raise bad(f"{place}.name", "a joint or a loop has this name", bushing.name, "rename one")
        check_ends(bushing, links, place, "a bushing holds")
    for field, found, remedy in (
        ("coordinates", s.coordinates != "independent", "use coordinates = 'independent'"),
        ("formulation", s.formulation == "nodal", "use formulation = 'erls' or 'ffr'"),
    ):
        if found and scene.bushings:
            raise bad(f"{file}: simulation.{field}", "does not go with [[bushings]]", getattr(s, field), remedy)
