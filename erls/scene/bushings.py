"""The table ``bushings`` of a chain."""

from __future__ import annotations

from erls.scene.records import Record
from fe_import.description.base import Vector

Six = tuple[float, float, float, float, float, float]
Row = float | Six
Stiffness = tuple[Row, Row, Row, Row, Row, Row]
"""A diagonal, or rows."""


class Bushing(Record, frozen=True, kw_only=True):
    """An elastic connection of a node of a link with the ground, or with a node of another link: a spring and a damper
    for three displacements and three turns.

    Attributes
    ----------
    name : str
        What reports and ``--set`` call it.
    link, node : str
        The link that it holds, and an interface or named node of it that turns.
    to_link, to_node : str
        The other link and its interface or named node; the ground unless given.
    position : (3,) floats, optional
        Where it sits on the ground, in the world [m]; where the node is at the initial coordinates unless given.
    rotation_deg : (3,) floats
        Of its axes in the world at the initial coordinates, about fixed x, then y, then z [deg]; fixed to the other
        side (or the ground) from then on.
    stiffness : (6,) floats or (6, 6) floats
        Forces along and moments about its axes per displacement and turn [N/m, N/rad; N m/m, N m/rad]: the diagonal,
        or a symmetric matrix. Free of force where both frames coincide.
    damping : (6,) floats or (6, 6) floats
        Per rate, likewise [N s/m ... N m s/rad]; none unless given.
    """

    name: str
    link: str
    node: str
    stiffness: Stiffness
    to_link: str = ""
    to_node: str = ""
    position: Vector | None = None
    rotation_deg: Vector = (0.0, 0.0, 0.0)
    damping: Stiffness = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
