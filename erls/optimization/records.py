"""The tables of a problem file: what may change, what is wanted, what must hold, how it is found."""

from __future__ import annotations

from erls.scene.records import Record

METHODS = ("integrated", "esl-system", "esl-component")
OPTIMIZERS = ("scp", "slsqp", "trust-constr")
QUANTITIES, OVER_TIME = ("mass", "deflection", "effort", "stress", "energy"), ("peak", "rms")
TIMES = ("all", "active", "aggregate")
DERIVATIVES = ("components", "aggregates")
EVERY_STEP = "every-step"
FRAMES = ("world", "link")
ENDS = ("cantilever", "clamped", "pinned")
"""Names that fields take."""


class Variable(Record, frozen=True):
    """A number of the design.

    Attributes
    ----------
    name : str
        What reports call it.
    keys : list of str, or dict of str to float
        Fields of the scene that follow it, as ``--set`` takes them; a table gives the factor of each, so that
        ``{ "links.arm.model.sections.tube.outer_diameter" = 1.0, "links.arm.model.sections.tube.thickness" = 0.1 }``
        keeps the proportions of a tube.
    lower, upper : float
        Its bounds.
    start : float, optional
        Where to start; what the scene has in the first key unless given.
    power : int, optional
        What depends nearly linearly on it is the variable to this power, in which approximations are made; unless given
        -4 for diameters, -3 for heights and widths, otherwise 1.
    """

    name: str
    keys: list[str] | dict[str, float]
    lower: float
    upper: float
    start: float | None = None
    power: int | None = None


class Choice(Record, frozen=True):
    """A choice that is no number, such as that of a material: every combination of options is optimized by itself, and
    the best design is kept.

    Attributes
    ----------
    name : str
        What reports call it.
    options : dict of str to list of str
        By their names, changes of the scene, KEY=VALUE as of ``--set``.
    """

    name: str
    options: dict[str, list[str]]


class Goal(Record, frozen=True):
    """A part of what is minimized.

    Attributes
    ----------
    quantity : str
        ``mass`` of links [kg], without payloads; ``deflection`` [m], ``effort`` [N m or N] or ``stress`` [Pa] of the
        constraint of this name, which then needs no limit; ``energy`` [J]: what drives give and take, the integral of a
        constraint on ``power`` over its samples.
    of : str
        With all but mass: the name of that constraint.
    over_time : str
        Of deflection, effort and stress: ``peak``, the largest value, or ``rms``.
    links : list of str
        Of ``mass``: those that count; all unless given.
    weight : float
        Factor: parts are added. Mass with 9.81 is weight in newtons.
    """

    quantity: str = "mass"
    of: str = ""
    over_time: str = "peak"
    links: list[str] = []
    weight: float = 1.0


class Term(Record, frozen=True):
    """A part of a deflection.

    Attributes
    ----------
    point : str
        A name from ``[[points]]`` of the scene.
    frame : str
        ``world``: from where rigid links would have it, in the axes of the world; ``link``: from where it would be on
        its link undeformed, in the mesh axes of that link, which go with its inboard interface.
    components : str
        Which of x, y and z count.
    """

    point: str
    frame: str = "world"
    components: str = "xyz"


class Constraint(Record, frozen=True, kw_only=True, tag_field="type"):
    """What must hold during the whole motion.

    Attributes
    ----------
    name : str
        What reports call it.
    limit : float, optional
        The largest value, of a frequency and of a load factor the smallest; a constraint without one holds nothing, and
        lends its value to an objective.
    samples : int or str
        Times, evenly spaced over the run with both ends, each rounded to a step of a run with fixed steps; or
        ``every-step`` of such a run.
    times : str
        ``all`` samples are constraints of their own; of the ``active`` ones those near their limit alone; or one
        smooth ``aggregate`` of all for each element or point (G. Kreisselmeier, R. Steinhauser, 1979), which lies on
        the safe side.
    """

    name: str
    limit: float | None = None
    samples: int | str = 51
    times: str = "active"


class DeflectionLimit(Constraint, frozen=True, kw_only=True, tag="deflection"):
    """Distance of named points from where they should be [m]: the root of the squares of all terms.

    Attributes
    ----------
    point : str
        Short for one term, all components in the world.
    terms : list of Term
        Instead of ``point``.
    """

    point: str = ""
    terms: list[Term] = []


class StressLimit(Constraint, frozen=True, kw_only=True, tag="stress"):
    """Largest normal stress in sections of beams [Pa], at both ends of every element: axial force and bending together.

    Attributes
    ----------
    links : list of str
        Links that are looked at; all flexible ones unless given.
    """

    links: list[str] = []


class EffortLimit(Constraint, frozen=True, kw_only=True, tag="effort"):
    """Torque or force of a joint's drive, either way [N m or N].

    Attributes
    ----------
    joint : str
        Its name.
    """

    joint: str


class PowerLimit(Constraint, frozen=True, kw_only=True, tag="power"):
    """Power of drives, given or taken, all joints added up [W]: effort times rate.

    Attributes
    ----------
    joints : list of str
        Names of those that count; all with a drive unless given.
    """

    joints: list[str] = []


class FrequencyLimit(Constraint, frozen=True, kw_only=True, tag="frequency"):
    """Lowest natural frequency of each link [Hz], held at its ends, payloads on it included: beams, solids and shells.

    Repeated frequencies are told apart by the derivatives of their whole space. It is the same at all times, so that
    ``samples`` and ``times`` mean nothing.

    Attributes
    ----------
    links : list of str
        Links that are looked at; all flexible ones unless given.
    ends : str
        ``cantilever``: held at the inboard interface; ``clamped``: the others neither turn nor move sideways, too;
        ``pinned``: they may turn, about all axes but the link's. The last two for links made of beams.
    """

    links: list[str] = []
    ends: str = "cantilever"


class BucklingLimit(Constraint, frozen=True, kw_only=True, tag="buckling"):
    """By what factor the axial forces in a link would have to grow for it to buckle, each link alone, at every sample.

    The forces are those of the run, of its equivalent static loads with the methods that take these.

    Attributes
    ----------
    links : list of str
        Links made of beams that are looked at; all flexible ones unless given.
    ends : str
        ``cantilever``, ``clamped`` or ``pinned``, as of ``frequency``; ends may come nearer to each other.
    """

    links: list[str] = []
    ends: str = "cantilever"


class VibrationLimit(Constraint, frozen=True, kw_only=True, tag="vibration"):
    """Lowest natural frequency of the whole mechanism [Hz], at its samples: links of beams about their rigid motion,
    not bent and without loads, joints held by their motions, springs and controllers.
    """


AnyConstraint = (
    DeflectionLimit | StressLimit | EffortLimit | PowerLimit | FrequencyLimit | BucklingLimit | VibrationLimit
)


class Published(Record, frozen=True):
    """What is published of a method, to be shown beside.

    Attributes
    ----------
    objective : float
        In the unit of the objective.
    variables : dict of str to float
        By the names of the variables, in their units.
    analyses, inner_iterations : int, optional
        Of the motion, and under loads that are held.
    """

    objective: float
    variables: dict[str, float] = {}
    analyses: int | None = None
    inner_iterations: int | None = None


class Settings(Record, frozen=True):
    """How the optimum is found.

    Attributes
    ----------
    methods : list of str
        ``integrated``: derivatives of the motion; ``esl-system``, ``esl-component``: equivalent static loads of the
        whole mechanism, or of each link alone.
    optimizer : str
        ``scp`` (sequential convex programming), or SciPy's ``slsqp`` or ``trust-constr``.
    derivatives : str
        Of ``integrated``: of all ``components`` that are limited, at every sample; or, for many variables, of the
        ``aggregates`` alone, backward over the run, where the times of all constraints are aggregated.
    design_tolerance : float
        Largest relative change of a variable from one design to the next.
    violation_tolerance : float
        By how much constraints may be passed, relative to their limits.
    optimality_tolerance : float
        Of ``scp``: what multipliers may leave of the objective's slope, over that (Karush, Kuhn, Tucker).
    most_analyses : int
        Runs of the motion that a method may take.
    move_limit : float
        Largest relative change of a variable in one step of ``scp``, adapted as it goes on.
    starts : int
        How many starts: further ones are drawn evenly between the bounds.
    seed : int
        Of the further starts.
    """

    methods: tuple[str, ...] = ("esl-system", "integrated")
    optimizer: str = "scp"
    derivatives: str = "components"
    design_tolerance: float = 5e-4
    violation_tolerance: float = 5e-4
    optimality_tolerance: float = 1e-3
    most_analyses: int = 40
    move_limit: float = 0.5
    starts: int = 1
    seed: int = 0


class ProblemRecord(Record, frozen=True):
    """A problem: a scene, what may change, what is wanted, what must hold.

    Attributes
    ----------
    scene : str
        Scene of joints and links; the path starts at the problem.
    variables : list of Variable
        ``[[variables]]``.
    name : str
        Of the problem; that of the file unless given.
    set : list of str
        Changes of the scene, KEY=VALUE as of ``--set``.
    choices : list of Choice
        ``[[choices]]``.
    objective : list of Goal
        ``[[objective]]``, added up; the mass unless given.
    constraints : list of constraints
        ``[[constraints]]``.
    settings : Settings
        ``[settings]``.
    published : dict of Published
        ``[published.METHOD]``.
    """

    scene: str
    variables: list[Variable]
    name: str = ""
    set: list[str] = []
    choices: list[Choice] = []
    objective: list[Goal] = []
    constraints: list[AnyConstraint] = []
    settings: Settings = Settings()
    published: dict[str, Published] = {}
