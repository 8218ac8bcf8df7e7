"""What bushings need, and what they do not go with."""

from __future__ import annotations

from erls.errors import SceneError
from erls.scene.chain import SceneRecord
from erls.scene.checks import bad
from fe_import.files.toml import choose


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
        choose(bushing.link, links, f"{place}.link", SceneError)
        if bushing.to_link:
            choose(bushing.to_link, links, f"{place}.to_link", SceneError)
        if bushing.to_link == bushing.link:
            message = "a bushing holds two links, or a link and the ground"
            raise bad(f"{place}.to_link", message, bushing.to_link, "name another link, or leave it out for the ground")
        if bool(bushing.to_link) != bool(bushing.to_node):
            remedy = "give both 'to_link' and 'to_node', or neither for the ground"
            raise bad(f"{place}.to_node", "a link and a node belong together", bushing.to_node, remedy)
        if bushing.to_link and bushing.position is not None:
            message = "between two links the nodes say where it is"
            raise bad(f"{place}.position", message, bushing.position, "remove it")
    for field, found, remedy in (
        ("coordinates", s.coordinates != "independent", "use coordinates = 'independent'"),
        ("formulation", s.formulation == "nodal", "use formulation = 'erls' or 'ffr'"),
    ):
        if found and scene.bushings:
            raise bad(f"{file}: simulation.{field}", "does not go with [[bushings]]", getattr(s, field), remedy)
