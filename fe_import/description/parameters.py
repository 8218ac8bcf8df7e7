"""The table of numbers that a family of links may have otherwise."""

from __future__ import annotations

import math
from typing import Any

from fe_import.description.base import Record
from fe_import.description.numbers import number_in
from fe_import.errors import Cause, FEImportError

_CHOICES = "reduction", "damping", "recovery", "parameters"  # what chooses modes, or follows from them


class Parameter(Record, frozen=True):
    """A number that a family of links may have otherwise, `[parameters.NAME]`; ``erls reduce --parametric`` makes one.

    Attributes
    ----------
    keys : list of str, or dict of str to float
        Fields of this description that follow it, as ``"sections.tube.thickness"``; members of lists go by number. A
        table gives the factor of each.
    lower, upper : float
        Its range.
    """

    keys: list[str] | dict[str, float]
    lower: float
    upper: float

    def fields(self, value: float) -> dict[str, float]:
        """Values of the fields that follow it."""
        factors = self.keys if isinstance(self.keys, dict) else dict.fromkeys(self.keys, 1.0)
        return {key: factor * value for key, factor in factors.items()}


def check_parameters(parameters: dict[str, Parameter], data: dict[str, Any], file: str) -> None:
    """Refuse parameters that name no number, or have no range.

    Parameters
    ----------
    parameters : dict of Parameter
    data : dict
        The description as tables.
    file : str
        For messages.

    Raises
    ------
    FEImportError
        Naming file, field, value and remedy.
    """
    owners: dict[str, str] = {}
    for name, parameter in parameters.items():
        place = f"{file}: parameters.{name}"
        bounds = parameter.lower, parameter.upper
        if not (all(map(math.isfinite, bounds)) and bounds[0] < bounds[1]):
            message, remedy = "a range goes from a smaller to a larger number", "give lower and upper"
            raise FEImportError(Cause.BAD_FIELD, message, where=place, value=list(bounds), remedy=remedy)
        if not parameter.keys:
            remedy = 'give some, as keys = ["sections.tube.thickness"]'
            raise FEImportError(Cause.BAD_FIELD, "no field follows it", where=f"{place}.keys", remedy=remedy)
        for key, factor in parameter.fields(1.0).items():
            where = f"{place}.keys.{key}"
            if not (math.isfinite(factor) and factor):
                message, remedy = "a factor is a number other than 0", "remove the field, or give its factor"
                raise FEImportError(Cause.BAD_FIELD, message, where=where, value=factor, remedy=remedy)
            if key.split(".")[0] in _CHOICES:
                message, remedy = "no model depends on this field", "name one of the model: materials, sections ..."
                raise FEImportError(Cause.BAD_FIELD, message, where=where, value=key, remedy=remedy)
            if key in owners:
                message, remedy = f"the field follows {owners[key]} already", "give it to one of them"
                raise FEImportError(Cause.BAD_FIELD, message, where=where, value=key, remedy=remedy)
            owners[key] = name
            number_in(data, key, where, FEImportError)
