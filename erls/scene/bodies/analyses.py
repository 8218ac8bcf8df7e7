"""What is to be found of a scene of bodies: its motion, equilibria, their path, buckling loads, natural frequencies.

Each analysis is one record, which a scene selects by ``type = "..."`` in its table ``simulation``.
"""

from __future__ import annotations

from erls.scene.records import Record, Stepping

TANGENTS = ("full", "material", "frozen")  # see `erls.equations.nodal.statics`
GROUPS = ("SE(3)", "R3xSO(3)")


class Dynamics(Stepping, frozen=True, kw_only=True, tag_field="type", tag="dynamics"):
    """The motion from the initial velocities on, by Lie-group generalized-α.

    Attributes
    ----------
    duration : float
        [s]
    step : float, optional
        Fixed steps [s]; unless given, steps go by ``tolerance``.
    tolerance : float
        Wanted error of any node over the whole run [m], of which integration aims at a tenth.
    formulation : str
        ``nodal``: elements with a frame per node are the only ones for bodies and beams of their own.
    group : str
        Where every node moves: ``SE(3)``, equations in its own axes; or ``R3xSO(3)``, positions in the world's axes.
    spectral_radius : float
        ρ∞: 1 no numerical damping, 0 the most.
    iteration_matrix : str
        ``auto``, ``update`` or ``frozen``, see `erls.integrate.constrained.ConstrainedOptions`.
    newton_tolerance : float
        Iterations stop at an estimated error below this [m]; with 0 at a small residual alone.
    residual_tolerance : float
        What a small residual is, against the inertia and loads of the nodes and the forces of the connections.
    """

    tolerance: float = 1e-4
    formulation: str = "nodal"
    group: str = "SE(3)"
    iteration_matrix: str = "auto"
    newton_tolerance: float = 1e-11
    residual_tolerance: float = 1e-10


class _AtRest(Record, frozen=True, kw_only=True, tag_field="type"):
    """What all analyses at rest share.

    Attributes
    ----------
    formulation : str
        ``nodal``.
    load_steps : int
        Equal steps of the load parameter; of a path the first one, further ones along it are as long at most.
    tangent : str
        ``full``, ``material`` or ``frozen``, see `erls.equations.nodal.statics`.
    tolerance : float
        Wanted error of any reported node [m].
    """

    tolerance: float = 1e-4
    formulation: str = "nodal"
    load_steps: int = 1
    tangent: str = "full"


class StaticSteps(_AtRest, frozen=True, tag="statics"):
    """Equilibria at load parameters from 1 / ``load_steps`` to 1.

    Attributes
    ----------
    compare_tangents : bool
        Report what each of the tangents takes.
    line_search : bool
        Shorten corrections by halves until the next one with the same matrix is shorter, too: for load steps that are
        halved otherwise; others take more iterations.
    """

    compare_tangents: bool = False
    line_search: bool = False


class Continuation(_AtRest, frozen=True, tag="path"):
    """Equilibria along their path by arc length: past limit points of the load, and onto branches at bifurcations.

    Attributes
    ----------
    load : float
        Load parameter at which the path ends, however it goes up and down before.
    most_steps : int
        The path ends after so many steps, too.
    branch : int
        Bifurcation, from 1, at which the path leaves for the branch; negative: for its other half. 0: it goes straight
        on.
    """

    load_steps: int = 20
    load: float = 1.0
    most_steps: int = 200
    branch: int = 0


class Buckling(_AtRest, frozen=True, tag="buckling"):
    """The lowest load parameters at which the equilibrium becomes unstable.

    They follow from the rate at which its stiffness changes with the load.

    Attributes
    ----------
    count : int
        How many.
    load : float
        Load parameter of the equilibrium at which that rate is taken.
    """

    count: int = 4
    load: float = 0.0


class Frequencies(_AtRest, frozen=True, tag="frequencies"):
    """The lowest natural frequencies about an equilibrium.

    Attributes
    ----------
    count : int
        How many.
    load : float
        Load parameter of the equilibrium.
    """

    count: int = 6
    load: float = 1.0


AtRest = StaticSteps | Continuation | Buckling | Frequencies
Analysis = Dynamics | StaticSteps | Continuation | Buckling | Frequencies
