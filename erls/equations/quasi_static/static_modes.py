"""Which vibrations of a mechanism lie above a bandwidth: a change of coordinates that sets them apart.

With θ the free joint coordinates, q the elastic ones and K the stiffness of the links, the modes of the mechanism with
its joints free solve

    K φ = ω² M φ,   φ = [Γ; φ_q],   Γ = -M_θθ⁻¹ M_θq φ_q   (rigid motions, ω = 0, are the joint coordinates).

They are the modes of links on each other, moving joints along, so that no inertia couples them. M changes with the
configuration; it is averaged over configurations through which the run may pass: prescribed and wanted joint
coordinates at times of the run, other revolute joints at random angles. A link that bends the arm beyond its elbow gets
a slow torsion, though the stretched arm knew none; so the frequency of a mode counts as the lowest it has in any of the
configurations, its shape held.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from erls.equations.formulation import State, TreeFormulation
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism

_CONFIGURATIONS = 16
_TOUCH = 1e-6  # m, displacement by which scales are measured


@dataclass(frozen=True)
class StaticModes:
    """Coordinates y = W z + H η: z (s,) follow by integration, η (h,) statically.

    Springs and controllers of joints couple static modes with the others; W contains the deflection with which static
    modes follow them, so that Hᵀ K W = 0 with joint springs and controllers included.

    Attributes
    ----------
    slow : (n, s) array
        W: joint coordinates, then modes up to the bandwidth.
    static : (n, h) array
        H: modes above it, turned into each other so that κ is diagonal.
    stiffness : (h,) array
        κ = Hᵀ K H, joint springs and controllers included.
    masses : (h,) array
        Largest Hᵀ M H in any of the configurations, of each mode.
    frequencies_hz, static_frequencies_hz : arrays
        Of the modes in W, and in H before they were turned, in rising order.
    metres : (h,) array
        Largest displacement of a node per unit of η.
    start, start_rates : (s,) arrays
        z and ż at time 0.
    static_start : (h,) array
        η at time 0 of the initial state with all modes, which may not be static.
    length_scales : (s,) array
        Largest displacement of a node per unit of z.
    """

    slow: Array
    static: Array
    stiffness: Array
    masses: Array
    frequencies_hz: Array
    static_frequencies_hz: Array
    metres: Array
    start: Array
    start_rates: Array
    static_start: Array
    length_scales: Array


def static_modes(equations: TreeFormulation, bandwidth: float, duration: float, static: bool = True) -> StaticModes:
    """The modes of a tree below and above a bandwidth.

    Parameters
    ----------
    equations : TreeFormulation
        With all modes.
    bandwidth : float
        [Hz]
    duration : float
        Of the run [s].
    static : bool
        Whether modes above the bandwidth follow statically; otherwise they are left out.

    Raises
    ------
    SimulationError
        SINGULAR_MASS.
    """
    n, f = equations.size, len(equations.free_joints)
    y, v = equations.initial_state()
    masses = _masses(equations, y, duration)
    mean = np.asarray(np.mean(masses, axis=0))
    stiffness = np.concatenate([link.stiffness for link in equations.mechanism.links])
    try:
        turned = -np.linalg.solve(mean[:f, :f], mean[:f, f:])
        squares, shapes = la.eigh(np.diag(stiffness), mean[f:, f:] + mean[f:, :f] @ turned)
    except np.linalg.LinAlgError:
        equations.acceleration(0.0, y, v)  # names the coordinate that nothing resists
        raise
    modes = np.vstack([turned @ shapes, shapes])
    heaviest = np.max([np.einsum("nk,nm,mk->k", modes, mass, modes) for mass in masses], axis=0)
    frequencies = np.sqrt(np.maximum(squares, 0.0) / heaviest) / (2 * np.pi)
    above = frequencies > bandwidth
    slow = np.hstack([np.eye(n)[:, :f], modes[:, ~above]])
    fast = modes[:, above] if static else np.zeros((n, 0))
    joints = equations.stiffness_and_damping(0.0, y, v)[0]
    joints[f:, f:] -= np.diag(stiffness)
    kappa, turn = la.eigh(np.diag(squares[above]) + fast.T @ joints @ fast) if fast.size else (np.zeros(0), np.eye(0))
    fast = fast @ turn
    amounts = modes[:, ~above].T @ mean @ np.column_stack([y, v])
    eta = fast.T @ mean @ y
    start = np.vstack([np.column_stack([y, v])[:f] - slow[:f, f:] @ amounts, amounts])
    start[:f, 0] -= fast[:f] @ eta
    lead = -(fast.T @ joints @ slow) / kappa[:, None]
    slow = slow + fast @ lead
    return StaticModes(
        slow=slow,
        static=fast,
        stiffness=kappa,
        masses=np.max([np.einsum("nk,nm,mk->k", fast, mass, fast) for mass in masses], axis=0),
        frequencies_hz=frequencies[~above],
        static_frequencies_hz=frequencies[above],
        metres=_metres(equations, y, v, fast),
        start=start[:, 0],
        start_rates=start[:, 1],
        static_start=eta - lead @ start[:, 0],
        length_scales=_metres(equations, y, v, slow),
    )


def _masses(equations: TreeFormulation, y: Array, duration: float) -> list[Array]:
    """Mass matrices of configurations through which a run may pass; that of its start first."""
    joints = [equations.mechanism.joints[k] for k in equations.free_joints]
    random = np.random.default_rng(0)
    result = []
    for number, t in enumerate(np.linspace(0.0, duration, _CONFIGURATIONS).tolist()):
        place = np.zeros_like(y)
        place[: len(joints)] = y[: len(joints)]
        for k, joint in enumerate(joints):
            wanted = joint.drive.reference(t)
            if number and wanted is not None:
                place[k] = wanted[0]
            elif number and joint.freedom.turns:
                place[k] += random.uniform(0.0, 2 * np.pi)
        result.append(equations.mass_matrix(t, place))
    return result


def _metres(equations: TreeFormulation, y: Array, v: Array, directions: Array) -> Array:
    """(k,) largest displacement of a node per unit along each direction (n, k), from the initial state [m]."""
    bounds = np.abs(directions).T @ equations.length_scales
    before = _places(equations.mechanism, equations.state(0.0, y, v))
    result = np.empty(len(bounds))
    for k, (direction, bound) in enumerate(zip(directions.T, bounds, strict=True)):
        step = _TOUCH / bound
        after = _places(equations.mechanism, equations.state(0.0, y + step * direction, v))
        result[k] = np.linalg.norm(after - before, axis=1).max() / step
    return result


def _places(mechanism: Mechanism, state: State) -> Array:
    """(nodes, 3) world positions of the nodes of all links."""
    places = []
    for link, frame, q in zip(mechanism.links, state.poses, state.modal, strict=True):
        places.append((link.model.nodes + link.model.translation_shapes @ q) @ frame[:3, :3].T + frame[:3, 3])
    return np.vstack(places)
