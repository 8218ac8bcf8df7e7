"""The table ``couplings`` of a chain."""

from __future__ import annotations

from erls.scene.contacts import Stops
from erls.scene.records import Record


class Coupling(Record, frozen=True, kw_only=True):
    """A joint whose coordinate follows those of others, as gears, belts, racks and differentials tie them:
    coordinate = Σ ratio · coordinate of the others + offset.

    Attributes
    ----------
    name : str
        What reports and ``--set`` call it.
    joint : str
        The joint that follows; ``joint/coordinate`` of one with several, or a closing joint with one.
    follows : number by name
        Joints that it follows, with their ratios: how far it goes per unit of each, with the sign of its sense [rad or
        m per rad or m]. A differential has several.
    offset, offset_deg : float, optional
        Its coordinate where theirs are 0 [rad or m], or in degrees; 0 unless given. At the start joints that are free
        are brought to where couplings put them.
    stiffness : float, optional
        Of an elastic coupling, at the joint that follows [N m/rad or N/m]; an ideal one holds exactly, and is what is
        taken unless this or ``stops`` is given.
    damping : float
        Of an elastic coupling, at the joint that follows [N m s/rad or N s/m].
    stops : Stops, optional
        Play (backlash) of an elastic coupling: how far the joint that follows may be off either way before teeth meet.
    """

    name: str
    joint: str
    follows: dict[str, float]
    offset: float | None = None
    offset_deg: float | None = None
    stiffness: float | None = None
    damping: float = 0.0
    stops: Stops | None = None

    @property
    def elastic(self) -> bool:
        """Whether it gives way."""
        return self.stiffness is not None or self.stops is not None
