"""The command ``erls reduce``."""

from __future__ import annotations

import time
from pathlib import Path

from erls.cli.terminal import Force, Json, Output, peak_memory_mb, print_json, tell


def reduce(
    link: Path,
    /,
    *,
    output: Output = None,
    method: str | None = None,
    modes: int | None = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Reduce the finite-element model of a link to a modal file.

    Prints the modes, the mass properties and the health checks. What was reduced before is taken from the cache, which
    erls simulate uses, too.

    Parameters
    ----------
    link
        Link description (TOML).
    output
        Modal file to write; LINK.modal.h5 in the current folder unless given.
    method
        Reduction instead of the one in the description: craig-bampton, craig-chang, guyan,
        mode-displacement or none.
    modes
        Number of elastic modes instead of that in the description.
    force
        Replace an existing file that is no modal file.
    json
        Print one JSON object.
    """
    from erls.files.results import MODAL, claim
    from erls.scene.build import cache_folder
    from erls.scene.inputs import files_of_link
    from fe_import.cache import reduce_cached
    from fe_import.description.link import load_link
    from fe_import.modal.file import write_modal_file
    from fe_import.reduce import reduction_summary

    changes = {k: v for k, v in (("method", method), ("elastic_modes", modes)) if v is not None}
    description = load_link(link, changes)
    target = output or Path(f"{description.description.name}.modal.h5")
    claim(target, MODAL, files_of_link(description), force)
    begun = time.perf_counter()
    tell(f"reducing {link}")
    model, cached = reduce_cached(description, cache_folder(), tell)
    if cached:
        tell(f"the same was reduced before: taken from {cache_folder()}")
    write_modal_file(target, model)
    summary = {
        **reduction_summary(model),
        "wall_s": time.perf_counter() - begun,
        "peak_memory_mb": peak_memory_mb(),
        "output": str(target),
    }
    if json:
        return print_json(summary)
    from erls.report.tables import modal_report

    print(modal_report(model))
    print(f"\nwritten to {target}")
