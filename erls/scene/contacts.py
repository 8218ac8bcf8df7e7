"""The table ``contacts`` of a chain, and the stops of its joints."""

from __future__ import annotations

from erls.scene.records import Record
from fe_import.description.base import Vector

WORLD = "world"
"""What carries a plane that stands still."""


class Stops(Record, frozen=True, kw_only=True):
    """Ends of the range of a joint, which push back by the law of contacts.

    Attributes
    ----------
    lower, upper, lower_deg, upper_deg : float, optional
        Coordinates at which they are met [rad or m], or in degrees; give one or both.
    stiffness : float
        k of the force k δⁿ, at a depth δ beyond a stop [N m/radⁿ or N/mⁿ].
    restitution : float
        Rate after an impact over that before, of rigid links that nothing else slows down.
    exponent : float
        n: 1, a linear spring, or more.
    transition_rate : float
        Rate from which on the loss is full [rad/s or m/s].
    """

    stiffness: float
    restitution: float
    lower: float | None = None
    lower_deg: float | None = None
    upper: float | None = None
    upper_deg: float | None = None
    exponent: float = 1.0
    transition_rate: float = 1e-3


class Plane(Record, frozen=True, kw_only=True):
    """Plane of a contact.

    Attributes
    ----------
    normal : (3,) floats
        Towards the side on which the point stays, of any length.
    on : str
        ``world``, or the link that it is fixed to: at its inboard interface, or at ``point``.
    point : str
        A name from ``[[points]]`` on that link, an interface or another node that turns.
    position : (3,) floats
        A point of the plane: in the world, or in the mesh frame of that link as built [m]; the normal likewise.
    """

    normal: Vector
    on: str = "world"
    point: str = ""
    position: Vector = (0.0, 0.0, 0.0)


class PlaneOfBody(Record, frozen=True, kw_only=True):
    """Plane of a contact.

    Attributes
    ----------
    normal : (3,) floats
        Towards the side on which the node stays, of any length, in the world, as built.
    on : str
        ``world``, or a node, a body, or an inner node of a beam that it goes with.
    position : (3,) floats
        A point of the plane in the world, as built [m].
    """

    normal: Vector
    on: str = "world"
    position: Vector = (0.0, 0.0, 0.0)


class ContactFriction(Record, frozen=True):
    """Coulomb friction along the plane: smooth around zero, ``coefficient`` · F · tanh(speed / ``transition_rate``), or
    with exact sticking.

    Attributes
    ----------
    coefficient : float
        Of the normal force F.
    law : str
        ``smooth``; or ``stick``: ``coefficient`` · F against the motion while the point slides, and whatever holds it
        where it rests, up to ``static_coefficient`` · F. When it comes to rest and when it breaks away is located in
        time.
    transition_rate : float, optional
        Speed at which smooth friction reaches 76 % of ``coefficient`` · F [m/s]; 0.01 unless given.
    static_coefficient : float, optional
        Of a point that sticks; ``coefficient`` unless given, and not less.
    """

    coefficient: float
    law: str = "smooth"
    transition_rate: float | None = None
    static_coefficient: float | None = None


class AgainstPlane(Record, frozen=True, kw_only=True):
    """What a plane does that keeps a point on its side: the force k δⁿ at a depth δ, more on the way in, less on the
    way out.

    Attributes
    ----------
    name : str
        What reports and ``--set`` call it.
    stiffness : float
        k [N/mⁿ].
    restitution : float
        Speed after an impact over that before, of a free rigid body, from 0 to 1.
    exponent : float
        n: 1.5 after Hertz, 1 for a linear spring.
    transition_rate : float
        Rate of the depth from which on the loss is full [m/s].
    friction : ContactFriction, optional
        None unless given.
    """

    name: str
    stiffness: float
    restitution: float
    exponent: float = 1.5
    transition_rate: float = 1e-3
    friction: ContactFriction | None = None


class Contact(AgainstPlane, frozen=True, kw_only=True):
    """A named point that a plane keeps on its side: by the force k δⁿ at a depth δ, more on the way in, less on the way
    out.

    Attributes
    ----------
    point : str
        A name from ``[[points]]``.
    plane : Plane
        What it is pressed against.
    """

    point: str
    plane: Plane


class ContactOfBody(AgainstPlane, frozen=True, kw_only=True):
    """A node that a plane keeps on its side: by the force k δⁿ at a depth δ, more on the way in, less on the way out.

    Attributes
    ----------
    node : str
        A node, a body, or an inner node of a beam.
    plane : PlaneOfBody
        What it is pressed against.
    """

    node: str
    plane: PlaneOfBody
