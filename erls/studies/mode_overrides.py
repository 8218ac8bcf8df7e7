"""The number of elastic modes as something that a study varies: how many there are, and which field takes the count."""

from __future__ import annotations

import json
from collections.abc import Mapping

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.scene.chain import Scene
from fe_import.description.link import load_link
from fe_import.description.reduction import Ranking, Reduction
from fe_import.modal.equal_frequencies import whole_count


def elastic_frequencies(scene: Scene) -> dict[str, Array]:
    """(m,) frequencies of the elastic modes of each elastic link [Hz]; reduces what is not in the cache, before workers
    would do so at once.
    """
    from erls.scene.build import link_models

    models = link_models(scene, lambda text: None)
    return {
        link.name: model.frequencies_hz[6:]
        for link, model in zip(scene.record.links, models, strict=True)
        if model.elastic_modes
    }


def available_modes(scene: Scene) -> dict[str, int]:
    """How many elastic modes each elastic link has."""
    return {name: len(found) for name, found in elastic_frequencies(scene).items()}


def whole_counts(scene: Scene, wanted: Mapping[str, int], known: Mapping[str, Array]) -> dict[str, int]:
    """Counts of elastic modes by link that part no modes of equal frequency, where the lowest ones are counted."""
    return {
        name: whole_count(known[name], count) if count_field(scene, name) == f"links.{name}.elastic_modes" else count
        for name, count in wanted.items()
    }


def count_field(scene: Scene, name: str) -> str:
    """Where the count goes: to the reduction, where that keeps other modes than the lowest free-free ones."""
    link = next(one for one in scene.record.links if one.name == name)
    if link.model:
        options = load_link(scene.folder / link.model, link.reduction).description.reduction
        if options.truncation != Reduction().truncation or options.static_correction:
            return f"links.{name}.reduction.elastic_modes"
    return f"links.{name}.elastic_modes"


def rankings(scene: Scene) -> dict[str, Ranking]:
    """What fixed-interface modes are ranked for, of each link whose reduction ranks them.

    Raises
    ------
    SceneError
        BAD_FIELD: there is none.
    """
    links = [link for link in scene.record.links if link.model]
    found = {link.name: load_link(scene.folder / link.model, link.reduction).description.reduction for link in links}
    ranked = {name: of.ranking for name, of in found.items() if of.ranking is not None}
    if not ranked:
        message, where = "no link of this scene ranks its fixed-interface modes", str(scene.path)
        remedy = 'give the reduction of a link selection = "ranking", and what they are ranked for'
        raise SceneError(Cause.BAD_FIELD, message, where=where, remedy=remedy)
    return ranked


def ranked_setting(name: str, ranking: Ranking, count: int) -> str:
    """``KEY=VALUE`` that takes this many modes of a ranking."""
    told = ", ".join(f"{field} = {json.dumps(getattr(ranking, field))}" for field in ("driving", "observed"))
    return f"links.{name}.reduction.ranking={{{told}, count = {count}}}"


def default_counts(most: int) -> list[int]:
    """0, 1, 2, 3, 4, 6, 8, 12 and so on: each about a third more than the last, up to ``most``."""
    result = [0, 1, 2, 3, 4]
    while result[-1] < most:
        result.append(max(result[-1] + 2, 2 * round(0.7 * result[-1])))
    return [n for n in result if n < most] + [most]
