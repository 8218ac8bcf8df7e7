"""Friction of a scene, in joints and along planes: the same laws by other names."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from erls.errors import SceneError
from erls.mechanism.joints import FRICTION_LAWS
from erls.mechanism.place import Place
from fe_import.files.toml import choose

_SLOW = 0.01  # rad/s or m/s


class FrictionRecord(Protocol):
    """What every table of friction holds, beside a force or coefficient while it slides, and one while it sticks."""

    @property
    def law(self) -> str:
        """A key of `FRICTION_LAWS`."""

    @property
    def transition_rate(self) -> float | None:
        """Of smooth friction."""


class Rubbing(NamedTuple):
    """Law, size while it slides, transition rate of the smooth law, and largest size that holds what rests."""

    law: str
    sliding: float
    rate: float
    static: float


def build_friction(record: FrictionRecord, within: Place, sliding: str, static: str) -> Rubbing:
    """Check a table of friction.

    Parameters
    ----------
    record : FrictionRecord
    within : Place
    sliding, static : str
        Names of its fields.

    Raises
    ------
    SceneError
        BAD_FIELD: faulty numbers, a field that the law does not know, less at rest than while it slides.
    """
    choose(record.law, FRICTION_LAWS, within.field("law"), SceneError)
    size = within.not_negative(sliding, getattr(record, sliding))
    other = {"smooth": static, "stick": "transition_rate"}[record.law]
    if getattr(record, other) is not None:
        message = f"friction.law = {record.law!r} does not know it"
        laws = [law for law in FRICTION_LAWS if law != record.law]
        raise within.error(other, message, getattr(record, other), remedy=f"remove it, or use law = {laws[0]!r}")
    if record.law == "smooth":
        rate = _SLOW if record.transition_rate is None else record.transition_rate
        return Rubbing(record.law, size, within.positive("transition_rate", rate), 0.0)
    given = getattr(record, static)
    most = size if given is None else within.number(static, given)
    if most < size:
        message = "what rests is held by at least what it feels while it slides"
        raise within.error(static, message, most, remedy=f"give at least {sliding} = {size:g}, or remove it")
    return Rubbing(record.law, size, _SLOW, most)
