"""What a study keeps of a run: histories of everything that a user can compare, at common times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from erls.equations.formulation import State
from erls.integrate.base import hermite
from erls.maths.so3 import Array
from erls.mechanism.sensors.base import Node
from erls.run.chain.instants import Instants
from erls.run.chain.places import node_positions
from erls.run.chain.run import ChainRun
from fe_import.modal.recovery_maps import von_mises

_RECOVERED = 200  # times at most of what is recovered, beside the start


@dataclass(frozen=True)
class Outputs:
    """Histories at ``times`` (k,); names are those of the scene.

    Attributes
    ----------
    points, accelerations : dict of (k, 3) arrays
        World positions [m] and accelerations [m/s²] of named points.
    angles, coordinates : dict of (k,) arrays
        Physical joint angles and joint coordinates θ [rad or m].
    forces, moments : dict of (k, 3) arrays
        Joint reactions on the outer link, world axes [N, N m].
    efforts : dict of (k,) arrays
        Generalized force on each joint [N m or N].
    energy : (k,) array
        Total [J].
    conservative : bool
        Whether it should stay constant.
    deflection : float
        Largest displacement of a node against its link's rigid shape, held at the inboard interface [m].
    size : float
        Of the largest link [m].
    mode_energy : dict of (m,) arrays
        Share of each elastic mode in the link's elastic energy, mean over time.
    mode_kinds : dict of tuple of str
    mode_frequencies : dict of (m,) arrays
        [Hz]
    summary : dict
        The JSON of ``erls simulate``.
    recovered : dict of (k,) arrays
        Where asked for: largest stress (von Mises) of solid links [Pa], largest section force [N] and moment [N m] of
        frames, at up to 201 times, by ``stress LINK``, ``section-force LINK`` and ``section-moment LINK``.
    """

    times: Array
    points: dict[str, Array]
    accelerations: dict[str, Array]
    angles: dict[str, Array]
    coordinates: dict[str, Array]
    forces: dict[str, Array]
    moments: dict[str, Array]
    efforts: dict[str, Array]
    energy: Array
    conservative: bool
    deflection: float
    size: float
    mode_energy: dict[str, Array]
    mode_kinds: dict[str, tuple[str, ...]]
    mode_frequencies: dict[str, Array]
    summary: dict[str, Any]
    recovered: dict[str, Array] = field(default_factory=dict)


def run_outputs(run: ChainRun, times: Sequence[float] | Array, recovering: bool = False) -> Outputs:
    """Sample a run.

    Parameters
    ----------
    run : ChainRun
    times : (k,) array
        Within the run [s].
    recovering : bool
        Whether stress and section forces are asked for.
    """
    formulation, s = run.formulation, run.solution
    t = np.clip(np.asarray(times, dtype=float), s.t[0], s.t[-1])
    y, v = hermite(s.t, s.y, s.v, s.a, t)
    seen = Instants(formulation, t, y, v)
    states, reactions = seen.motion.states, seen.reactions
    points = {p.name: seen.node(Node(p.link, p.node)) for p in formulation.mechanism.points}
    energies = [formulation.energy(*at).total for at in zip(t.tolist(), y, v, strict=True)]
    joints = run.joint_names
    numbers = {name: run.link_number(name) for name in run.link_names}
    models = {name: formulation.mechanism.links[k].model for name, k in numbers.items()}
    return Outputs(
        times=t,
        points={name: found.place for name, found in points.items()},
        accelerations={name: found.acceleration for name, found in points.items()},
        angles={name: states.angles[:, k] for k, name in enumerate(joints)},
        coordinates={name: states.coordinates[:, k] for k, name in enumerate(joints)},
        forces={name: reactions.force[:, k] for k, name in enumerate(joints)},
        moments={name: reactions.moment[:, k] for k, name in enumerate(joints)},
        efforts={name: reactions.effort[:, k] for k, name in enumerate(joints)},
        energy=np.array(energies),
        conservative=run.conservative,
        deflection=max((_deflection(run, state) for state in states.states()[:: max(1, len(t) // 100)]), default=0.0),
        size=max(float(np.linalg.norm(np.ptp(m.nodes, axis=0))) for m in models.values()),
        mode_energy={
            name: _mode_energy(states.modal[k][:, 6:], m.frequencies_hz[6:])
            for (name, m), k in zip(models.items(), numbers.values(), strict=True)
        },
        mode_kinds={name: m.kinds[6:] for name, m in models.items()},
        mode_frequencies={name: m.frequencies_hz[6:] for name, m in models.items()},
        summary=run.summary(),
        recovered=_recovered(run, t[:: max(1, len(t) // _RECOVERED)]) if recovering else {},
    )


def _recovered(run: ChainRun, times: Array) -> dict[str, Array]:
    """Of links that hold something to recover from."""
    from erls.run.recovery import section_forces, stress  # here: most runs are not asked for it

    found = {}
    for name in run.link_names:
        model = run.formulation.mechanism.links[run.link_number(name)].model
        if model.recovery is None or not model.elastic_modes:
            continue
        if model.recovery.quantity == "stress":
            found[f"stress {name}"] = von_mises(stress(run, name, times)).max(axis=1)
        else:
            forces = section_forces(run, name, times)
            for kind, part in (("force", forces[..., :3]), ("moment", forces[..., 3:])):
                found[f"section-{kind} {name}"] = np.linalg.norm(part, axis=-1).max(axis=1)
    return found


def _deflection(run: ChainRun, state: State) -> float:
    """Largest distance of a node from its link's rigid shape, which follows the inboard interface."""
    largest = 0.0
    for k, link in enumerate(run.formulation.mechanism.links):
        nodes = link.model.nodes
        moved = node_positions(run.formulation.mechanism, state, k)
        frame = state.poses[k]
        inboard = link.inboard.node
        turn = frame[:3, :3]
        rotation = link.model.node_shape(inboard)[1]
        if rotation is not None:
            angle = rotation @ state.modal[k]
            arms = nodes - nodes[inboard]
            rigid = moved[inboard] + (arms + np.cross(angle, arms)) @ turn.T
        else:
            rigid = moved[inboard] + (nodes - nodes[inboard]) @ turn.T
        largest = max(largest, float(np.linalg.norm(moved - rigid, axis=1).max()))
    return largest


def _mode_energy(amplitudes: Array, frequencies: Array) -> Array:
    energy = np.asarray((amplitudes**2).mean(axis=0) * frequencies**2)
    total = energy.sum()
    return energy / total if total > 0 else energy
