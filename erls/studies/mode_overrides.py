"""The number of elastic modes as something that a study varies: how many there are, and which field takes the count."""

from __future__ import annotations

from erls.scene.chain import Scene
from fe_import.description.link import load_link
from fe_import.description.reduction import Reduction


def available_modes(scene: Scene) -> dict[str, int]:
    """Elastic modes of each elastic link; reduces what is not in the cache, before workers would do so at once."""
    from erls.scene.build import link_models

    models = link_models(scene, lambda text: None)
    return {
        link.name: model.elastic_modes
        for link, model in zip(scene.record.links, models, strict=True)
        if model.elastic_modes
    }


def count_field(scene: Scene, name: str) -> str:
    """Where the count goes: to the reduction, where that keeps other modes than the lowest free-free ones."""
    link = next(one for one in scene.record.links if one.name == name)
    if link.model:
        options = load_link(scene.folder / link.model, link.reduction).description.reduction
        if options.truncation != Reduction().truncation or options.static_correction:
            return f"links.{name}.reduction.elastic_modes"
    return f"links.{name}.elastic_modes"


def default_counts(most: int) -> list[int]:
    """0, 1, 2, 3, 4, 6, 8, 12 and so on: each about a third more than the last, up to ``most``."""
    result = [0, 1, 2, 3, 4]
    while result[-1] < most:
        result.append(max(result[-1] + 2, 2 * round(0.7 * result[-1])))
    return [n for n in result if n < most] + [most]
