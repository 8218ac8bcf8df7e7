"""The table ``simulation`` of a chain."""

from __future__ import annotations

from erls.scene.records import Stepping


class Simulation(Stepping, frozen=True):
    """How the motion is computed.

    Attributes
    ----------
    duration : float
        [s]
    formulation : str
        ``erls``; ``ffr``: floating frames of reference; or ``nodal``: finite elements with a frame per node, for links
        made of beams or of shells.
    gauge : str
        Of ``erls``: ``joint-angle`` (θ is the joint angle) or ``minimum-norm`` (five rows per joint, as in the paper).
    body_frame : str
        Of ``ffr``: ``tangent`` at the inboard interface, or ``mean-axis``.
    coordinates : str
        ``independent`` (joint angles), or, of ``ffr``, ``absolute``: the frames themselves, tied by joints with
        multipliers, index 3.
    elements_per_member : int, optional
        Of ``nodal``: elements of each member of a link, instead of the number in its description.
    residual_bending_flexibility : bool
        Of ``nodal``: elements of length l take l²/(12 E I) on top of their flexibility in shear 1/(κ G A), which a
        curvature that is constant along them leaves out of bending: single ones then deflect as exact beams do.
    inertia_interpolation : str
        Of ``nodal``: the motion of an element's mass is interpolated as its strains are, ``helicoidal``, or places and
        turns each by itself, ``linear``, as in classical two-node elements. Both converge to the same.
    integrator : str
        ``generalized_alpha``, ``lobatto``, one of SciPy's (``rk45``, ``dop853``, ``radau``, ``bdf``, ``lsoda``), or
        ``auto``: the one that fits; of ``nodal`` and absolute coordinates, generalized-α with steps that follow
        ``tolerance``. Unless given ``generalized_alpha`` where there is a ``step``, otherwise ``auto``; reading a scene
        puts its name here.
    step : float, optional
        Step of generalized-α [s], largest step of SciPy's; ``lobatto`` and ``auto`` go by ``tolerance`` alone.
    rtol, atol : float
        Tolerances of SciPy's integrators, ``atol`` in metres.
    output_step : float, optional
        Of the steps only the states at multiples of this time [s] are kept, or of a part of it that makes them 201 or
        more, and the steps around events, so that the memory and the file of a long run stay small; between those,
        motion is interpolated. All steps are kept unless given.
    tolerance : float
        Wanted error of the named points over the whole run [m], all parts of `accuracy` together; integration aims at a
        tenth of it (``lobatto`` and ``auto``).
    spectral_radius : float
        ρ∞ of generalized-α: 1 no numerical damping, 0 the most.
    effects : str or list of str
        Physical effects (`erls.mechanism.effects`) that are on: ``all``, ``auto`` (those that matter), or their names.
    effects_tolerance, effects_effort_tolerance : float
        Of ``auto``: error of the named points [m], and error of drive forces relative to their peak.
    bandwidth : float, optional
        Modes of the mechanism above this frequency [Hz] follow statically instead of being integrated; all vibrate
        unless given.
    """

    formulation: str = "erls"
    gauge: str = "joint-angle"
    body_frame: str = "tangent"
    coordinates: str = "independent"
    elements_per_member: int | None = None
    residual_bending_flexibility: bool = False
    inertia_interpolation: str = "helicoidal"
    integrator: str = ""
    output_step: float | None = None
    rtol: float = 1e-8
    atol: float = 1e-12
    tolerance: float = 1e-4
    effects: str | list[str] = "all"
    effects_tolerance: float = 1e-4
    effects_effort_tolerance: float = 1e-2
    bandwidth: float | None = None
