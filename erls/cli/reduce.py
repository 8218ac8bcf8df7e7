"""The command ``erls reduce``."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from erls.cli.terminal import Force, Json, Output, peak_memory_mb, print_json, tell

if TYPE_CHECKING:
    from fe_import.modal.model import ModalModel


def reduce(
    link: Path,
    /,
    *,
    output: Output = None,
    method: str | None = None,
    modes: int | None = None,
    parametric: Annotated[bool, Parameter(negative="")] = False,
    set_: Annotated[list[str] | None, Parameter(name="--set", negative="")] = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Reduce the finite-element model of a link to a modal file.

    Prints the modes, the mass properties and the health checks. What was reduced before is taken from the cache, which
    erls simulate uses, too.

    Parameters
    ----------
    link
        Link description (TOML), or the file of a family of links.
    output
        File to write; LINK.modal.h5 in the current folder unless given, of a family LINK.family.h5.
    method
        Reduction instead of the one in the description: craig-bampton, craig-chang, guyan,
        mode-displacement or none.
    modes
        Number of elastic modes instead of that in the description.
    parametric
        Reduce for all values of the parameters of the description, to the file of a family.
    set_
        NAME=VALUE of a parameter of a family, of whose member the modal file is written; in the middle unless given.
    force
        Replace an existing file that is none of the kind.
    json
        Print one JSON object.
    """
    from erls.files.results import FAMILY, MODAL, claim, schema_of
    from erls.scene.build import cache_folder
    from erls.scene.inputs import files_of_link
    from fe_import.cache import reduce_cached
    from fe_import.description.link import load_link
    from fe_import.modal.file import write_modal_file

    changes = {k: v for k, v in (("method", method), ("elastic_modes", modes)) if v is not None}
    begun = time.perf_counter()
    if schema_of(link) == FAMILY:
        _refuse("--method, --modes, --parametric", bool(changes) or parametric, "a family is as it was made")
        from fe_import.parametric.file import read_parametric_file

        family = read_parametric_file(link)
        target = output or Path(f"{family.middle.name}.modal.h5")
        claim(target, MODAL, [link], force)
        model = family.at(_values(set_ or []))
        write_modal_file(target, model)
        return _report(model, target, begun, json)
    _refuse("--set", bool(set_), "values are those of a family; change the description, or reduce it --parametric")
    description = load_link(link, changes)
    if parametric:
        from fe_import.parametric.file import write_parametric_file
        from fe_import.parametric.reduce import reduce_parametric

        target = output or Path(f"{description.description.name}.family.h5")
        claim(target, FAMILY, files_of_link(description), force)
        tell(f"reducing {link} for all values of its parameters")
        made = reduce_parametric(description, tell)
        write_parametric_file(target, made)
        summary = {
            **made.summary(),
            "wall_s": time.perf_counter() - begun,
            "peak_memory_mb": peak_memory_mb(),
            "output": str(target),
        }
        if json:
            return print_json(summary)
        from erls.report.tables import family_report

        print(family_report(summary))
        return print(f"\nwritten to {target}")
    target = output or Path(f"{description.description.name}.modal.h5")
    claim(target, MODAL, files_of_link(description), force)
    tell(f"reducing {link}")
    model, cached = reduce_cached(description, cache_folder(), tell)
    if cached:
        tell(f"the same was reduced before: taken from {cache_folder()}")
    write_modal_file(target, model)
    return _report(model, target, begun, json)


def _report(model: ModalModel, target: Path, begun: float, as_json: bool) -> None:
    from fe_import.reduce import reduction_summary

    if as_json:
        own: dict[str, Any] = {
            "wall_s": time.perf_counter() - begun,
            "peak_memory_mb": peak_memory_mb(),
            "output": str(target),
        }
        return print_json({**reduction_summary(model), **own})
    from erls.report.tables import modal_report

    print(modal_report(model))
    print(f"\nwritten to {target}")


def _refuse(option: str, given: bool, message: str) -> None:
    from erls.errors import Cause, SceneError

    if given:
        raise SceneError(Cause.BAD_FIELD, message, where=option, remedy="leave the option out")


def _values(texts: Sequence[str]) -> dict[str, float]:
    """Of ``--set``."""
    from erls.errors import Cause, SceneError

    found = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            found[name.strip()] = float(value)
        except ValueError:
            message, remedy = "not of the form NAME=NUMBER", "e.g. --set wall=0.002"
            raise SceneError(Cause.BAD_FIELD, message, where=f"--set {text}", remedy=remedy) from None
    return found
