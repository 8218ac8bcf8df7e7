"""The second-order field of a reduced link, or why there is none."""

from __future__ import annotations

from functools import partial

import numpy as np

from fe_import.modal.second_order import SecondOrder
from fe_import.model import Array, FEModel, IntArray
from fe_import.reduction.base import HeldSolution
from fe_import.second_order.frame import frame_second_order

MOST_MODES = 64  # elastic; the field has as many columns as pairs of them
MOST_MODES_OF_SOLIDS = 24  # 300 pairs, at every point of every element
_STORED_VALUES = 1_000_000  # of the fields of nodes: 8 MB


def second_order(
    model: FEModel, shapes: Array, reference: int, held: HeldSolution | None = None
) -> tuple[SecondOrder | None, str]:
    """Second-order field, and what the provenance says about it.

    Parameters
    ----------
    model : FEModel
        In SI.
    shapes : (d, m) array
        Mass-orthonormal modes over all nodal components, six rigid-body ones first.
    reference : int
        Interface that counts as inboard; fields relative to another follow from it.
    held : HeldSolution, optional
        Where there are factors already.
    """
    count = shapes.shape[1] - 6
    if count > MOST_MODES:
        return None, f"not available: more than {MOST_MODES} elastic modes; keep fewer (reduction.elastic_modes)"
    if model.second_order_lack:
        return _along_line(model, shapes, reference, model.second_order_lack)
    if model.kind in ("solid", "shell"):
        if count > MOST_MODES_OF_SOLIDS:
            return None, (
                f"not available: more than {MOST_MODES_OF_SOLIDS} elastic modes of a meshed link; keep fewer "
                "(reduction.elastic_modes)"
            )
        from fe_import.elements.shell_stress import ShellStress  # heavy
        from fe_import.elements.solid_stress import SolidStress
        from fe_import.second_order.element_forces import shell_work, solid_work
        from fe_import.second_order.elements import elements_second_order

        source = model.stress
        if isinstance(source, ShellStress):
            work, made = partial(shell_work, source, model.dof_map), "from its shells"
        else:
            assert isinstance(source, SolidStress)
            work, made = partial(solid_work, source, model.dof_map), "from its solid elements"
        return elements_second_order(model, work, shapes, reference, _named_nodes(model), held), made
    if model.beams is not None:
        if not model.beams.is_tree:
            return None, (
                "not available: members form a ring; cut it into links joined by loops, or give the link as 'solid'"
            )
        return frame_second_order(model, model.beams, shapes, reference, _stored_nodes(model, count)), "from its beams"
    return _along_line(model, shapes, reference, "matrices have no elements")


def _along_line(model: FEModel, shapes: Array, reference: int, lack: str) -> tuple[SecondOrder | None, str]:
    """Where elements do not tell, the line of the cross sections of a slender link may."""
    from fe_import.second_order.cross_sections import NoSections
    from fe_import.second_order.line import line_second_order

    try:
        return line_second_order(model, shapes, reference, _named_nodes(model))
    except NoSections as reason:
        return None, (
            f"not available: {lack}, and {reason}; give the link as 'frame' or 'solid', or split it into several links"
        )


def _stored_nodes(model: FEModel, elastic_modes: int) -> IntArray:
    """Nodes whose fields are kept: all of a small model, else interfaces and nodes with a name of their own."""
    per_node = 3 * elastic_modes * (elastic_modes + 1)
    if per_node * len(model.nodes) <= _STORED_VALUES:
        return np.arange(len(model.nodes), dtype=np.int64)
    return _named_nodes(model)


def _named_nodes(model: FEModel) -> IntArray:
    named = [node for name, node in model.node_names.items() if "/" not in name]
    return np.unique(np.array([*(i.node for i in model.interface_nodes), *named], dtype=np.int64))
