"""A link's finite-element model into a modal file."""

from typing import Any

__all__ = ["link_from_skfem", "load_link", "modal_derivatives", "read_modal_file", "reduce_link", "write_modal_file"]

_HOME = {
    "link_from_skfem": "fe_import.scikit_fem",
    "load_link": "fe_import.description.link",
    "modal_derivatives": "fe_import.derivatives",
    "reduce_link": "fe_import.reduce",
    "read_modal_file": "fe_import.modal.file",
    "write_modal_file": "fe_import.modal.file",
}


def __getattr__(name: str) -> Any:
    """Load the public names when first used: importing the package stays cheap."""
    import importlib

    if name in _HOME:
        return getattr(importlib.import_module(_HOME[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
