"""Errors of the first free frequencies and of the static flexibility, per reduction method and number of modes.

    python benchmarks/reduction_accuracy.py [LINK.toml] [--frequencies 6]

The default link is the hex20 L of data/l_shape (2900 dofs). Reference: Craig-Chang with 20 more free modes than are
compared, whose lowest frequencies are those of the full model to 1e-8. Static: flexibility of the other interfaces with
the first one held, largest error per direct flexibility. Columns: modes of the method, elastic modes kept, errors in %.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from fe_import.description.link import LinkFile, load_link
from fe_import.description.reduction import Reduction
from fe_import.modal.model import ModalModel
from fe_import.model import FEModel
from fe_import.models.model import build_model
from fe_import.reduce import reduce_model

Array = NDArray[np.float64]

LINK = Path(__file__).parents[1] / "data" / "l_shape" / "links" / "solid.toml"
CASES: list[tuple[str, dict[str, Any]]] = [
    ("guyan", {"method": "guyan"}),
    *((f"craig-bampton {n}", {"fixed_interface_modes": n}) for n in (0, 4, 8, 12, 20, 40)),
    *((f"craig-chang {n}", {"method": "craig-chang", "free_modes": n}) for n in (0, 2, 4, 6, 12)),
    *((f"mode-displacement {n}", {"method": "mode-displacement", "free_modes": n}) for n in (6, 12, 20, 40)),
    *(
        (f"craig-bampton 20, {n} kept, {t}{', corrected' if s else ''}",
         {"fixed_interface_modes": 20, "elastic_modes": n, "truncation": t, "static_correction": s})
        for n in (12, 18, 24) for t in ("free-free", "clamped") for s in (False, True)
    ),
]  # fmt: skip


def reduced(model: FEModel, link: LinkFile, options: dict[str, Any]) -> ModalModel:
    """The model reduced with these options and no others."""
    description = msgspec.structs.replace(link.description, reduction=Reduction(**options))
    return reduce_model(model, replace(link, description=description))


def held_flexibility(modal: ModalModel) -> Array:
    """Displacements of all interfaces but the first per unit loads there, the first one held."""
    shapes = np.vstack([part for i in modal.interface_nodes for part in modal.node_shape(i.node)])
    elastic = shapes[6:] - shapes[6:, :6] @ np.linalg.solve(shapes[:6, :6], shapes[:6])
    compliance = elastic[:, 6:] / (2 * np.pi * modal.frequencies_hz[6:])
    return np.asarray(compliance @ compliance.T)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("link", nargs="?", type=Path, default=LINK)
    parser.add_argument("--frequencies", type=int, default=6)
    arguments = parser.parse_args()
    link, count = load_link(arguments.link), arguments.frequencies
    model = build_model(link)
    reference = reduced(model, link, {"method": "craig-chang", "free_modes": count + 20})
    exact, flexibility = reference.frequencies_hz[6 : 6 + count], held_flexibility(reference)
    size = np.sqrt(np.diag(flexibility))
    print(f"{link.description.name}: " + "  ".join(f"{f:.4f}" for f in exact) + " Hz")
    print(f"{'':48s} kept  " + " ".join(f"{k + 1:>10d}" for k in range(count)) + "     static")
    for name, options in CASES:
        modal = reduced(model, link, options)
        errors = 100 * (modal.frequencies_hz[6 : 6 + count] / exact[: modal.elastic_modes] - 1)
        static = 100 * np.abs((held_flexibility(modal) - flexibility) / np.outer(size, size)).max(initial=0.0)
        row = " ".join(f"{e:10.2g}" for e in [*errors, *[np.nan] * (count - len(errors))])
        print(f"{name:48s} {modal.elastic_modes:4d}  {row} {static:10.2g}")


if __name__ == "__main__":
    main()
