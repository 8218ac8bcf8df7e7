"""Thermal expansion of links: the temperature of a modal model, and where its elastic coordinates are at rest.

Modes feel ΔT f beside Γ q (`fe_import.modal.thermal`), which is Γ (q - q₀) with

    q₀ = ΔT Γ⁻¹ f,

the elastic coordinates of the link that expands freely. Beam elements expand by α ΔT of their own material.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.mechanism.links import Link
from fe_import.modal.model import ModalModel


def temperature_change(link: Link) -> float:
    """ΔT [K]; 0 for a link that is rigid or holds no expansion."""
    return link.model.thermal.change if link.model.thermal is not None and link.elastic_modes else 0.0


def elastic_rest(link: Link) -> Array:
    """(n,) elastic coordinates of the link that expands freely, q₀."""
    change = temperature_change(link)
    if not change or link.model.thermal is None:
        return np.zeros(link.elastic_modes)
    return np.asarray(change * link.model.thermal.force[6:] / link.stiffness)


def at_temperature(model: ModalModel, change: float, where: str) -> ModalModel:
    """The model with another temperature change [K].

    Raises
    ------
    SceneError
        BAD_FIELD: it holds no forces of expansion; ``where`` is the field.
    """
    if model.thermal is None:
        message = "this link's modal model holds no thermal expansion"
        remedy = "reduce it again with temperature_change = 0.0 in the link description, or remove the field"
        raise SceneError(Cause.BAD_FIELD, message, where=where, value=change, remedy=remedy)
    return replace(model, thermal=replace(model.thermal, change=change))


def unwarmed(model: ModalModel) -> ModalModel:
    """The model without thermal expansion; as it is where it has none."""
    return model if model.thermal is None else replace(model, thermal=None)
