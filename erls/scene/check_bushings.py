"""What bushings need, and what they do not go with."""

from __future__ import annotations

from erls.scene.chain import SceneRecord
from erls.scene.checks import check_ends, refuse_settings


def check_bushings(scene: SceneRecord, file: str) -> None:
    """Refuse bushings that cannot be meant.

    Raises
    ------
    SceneError
        BAD_FIELD, BAD_REFERENCE: naming file, field, value and remedy.
    """
    links = [link.name for link in scene.links]
    for k, bushing in enumerate(scene.bushings):
        check_ends(bushing, links, f"{file}: bushings[{k}]", "a bushing holds")
    if scene.bushings:
        refuse_settings(scene.simulation, file, "[[bushings]]", ("coordinates", "formulation"))
