"""Pieces of the links that a scene splits into substructures: their modal models, and links of a mechanism."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from erls.mechanism.links import Link, truncated
from erls.scene.links import Link as LinkRecord
from fe_import.cache import reduce_cached
from fe_import.description.link import LinkFile
from fe_import.errors import Cause, FEImportError
from fe_import.modal.damping import damping_ratios
from fe_import.modal.model import ModalModel


def piece_models(
    record: LinkRecord,
    link: LinkFile,
    whole: ModalModel,
    folder: Path,
    where: str,
    tell: Callable[[str], None] | None = None,
) -> tuple[ModalModel, ...]:
    """Modal models of the pieces of a link, from its inboard end outward.

    Parameters
    ----------
    record : LinkRecord
        The link in the scene.
    link : LinkFile
        Its description.
    whole : ModalModel
        Its reduction in one piece.
    folder : Path
        Where reductions are kept.
    where : str
        Place of the link, for messages.
    tell : callable, optional
        Gets messages of long computations.

    Raises
    ------
    FEImportError
        The link cannot be split: see `fe_import.models.substructures.split_link`.
    """
    pieces = piece_descriptions(record, link, whole, where)
    models = [reduce_cached(piece, folder, tell)[0] for piece in pieces]
    if record.elastic_modes is None:
        return tuple(models)
    return tuple(truncated(m, min(record.elastic_modes, m.elastic_modes)) for m in models)


def piece_descriptions(record: LinkRecord, link: LinkFile, whole: ModalModel, where: str) -> tuple[LinkFile, ...]:
    """Descriptions of the pieces; parameters and failures as of `piece_models`."""
    from fe_import.models.substructures import split_link  # graphs of SciPy

    names = [i.name for i in whole.interface_nodes]
    inboard = record.inboard or names[0]
    others = [name for name in names if name != inboard]
    outboard = record.outboard or (others[0] if others else "")
    return split_link(link, record.substructures, inboard, outboard, f"{where}.substructures")


def piece_links(record: LinkRecord, whole: Link, models: Sequence[ModalModel], where: str) -> tuple[Link, ...]:
    """The pieces as links; payloads are put on them when the mechanism is split.

    Raises
    ------
    FEImportError
        MODAL_FILE: models that do not make up the link.
    """
    result = []
    if not _same_nodes(whole.model, models):
        raise _unfit(whole, "its nodes are not those of its substructures", where)
    for number, model in enumerate(models):
        ends = model.interface_nodes
        if len(ends) < (1 if number == len(models) - 1 else 2):
            raise _unfit(whole, f"substructure {number + 1} has too few interfaces", where)
        omega = 2 * np.pi * model.frequencies_hz
        ratios = model.damping_ratios
        if record.damping is not None:
            ratios = damping_ratios(record.damping, omega, where)
        result.append(
            replace(
                whole,
                name=f"{whole.name}/{number + 1}",
                model=model,
                invariants=model.invariants,
                inboard=ends[0],
                stiffness=np.diag(model.stiffness)[6:].copy(),
                damping=(2 * ratios * omega)[6:],
                payloads=(),
                description=None,
                pieces=(),
            )
        )
    return tuple(result)


def _same_nodes(whole: ModalModel, models: Sequence[ModalModel]) -> bool:
    """Whether every node has a name, and under it a place on one of the pieces."""
    found = {name: model.nodes[node] for model in models for name, node in model.node_names.items()}
    if len(set(whole.node_names.values())) < len(whole.nodes) or not found.keys() >= whole.node_names.keys():
        return False
    away = [found[name] - whole.nodes[node] for name, node in whole.node_names.items()]
    return bool(np.abs(away).max() <= 1e-9 * np.ptp(whole.nodes, axis=0).max())


def _unfit(link: Link, message: str, where: str) -> FEImportError:
    return FEImportError(
        Cause.MODAL_FILE, message, where=f"{where}.substructures", value=link.name, remedy="simulate the scene again"
    )


def piece_warnings(link: Link) -> list[str]:
    """Modal damping ratios belong to modes of the pieces, which lie above those of the link."""
    first = next((p for p in link.pieces if p.damping.any()), None)
    if first is None or not link.damping.any():
        return []
    lowest, whole = (float(x.stiffness[0]) ** 0.5 / (2 * np.pi) for x in (first, link))
    ratio = [float(x.damping[0]) / (4 * np.pi * f) for x, f in ((first, lowest), (link, whole))]
    stiff = ratio[1] * lowest / whole  # what damping in proportion to stiffness gives the piece
    if abs(ratio[0] - stiff) <= 1e-3 * stiff:
        return []
    return [
        f"link {link.name!r}: damping holds for the modes of its {len(link.pieces)} substructures (from "
        f"{lowest:.4g} Hz on), so that its own lowest mode ({whole:.4g} Hz) is damped less than stated; "
        "damping.rayleigh with beta alone is the same for both"
    ]
