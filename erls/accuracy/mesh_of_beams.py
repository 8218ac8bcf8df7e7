"""What the mesh of beams leaves out of a run whose links are beam elements: nodes as coordinates, no modes.

Between the nodes of a mesh, fields of a finer one answer inertia that the elements do not resolve
(`fe_import.modal.left_out`, of the mesh alone). In each link's own frame they bear, with s the velocities of its modal
coordinates, rigid motion and pull of gravity included,

    F = m_x ṡ + Σ ω_a X_xa s,

over the modal coordinates that come nearest to its nodes; and they bend with one curvature each, which lacks the energy
½ qᵀ Q q (`fe_import.models.constant_strain`). Links are stiffer by r = ∫(Fᵀ K_x⁻¹ F + qᵀ Q q) dt / ∫qᵀΩ²q dt than they
should be, and with a deflection δ the error is δ (r + min(2, ½ σ r T)) times the lever of links beyond, as in
`erls.run.deflection.estimate`.
"""

from __future__ import annotations

import numpy as np

from erls.accuracy.finer_links import mesh_fields
from erls.equations.serial.state_series import StateSeries
from erls.maths.so3 import Array
from erls.mechanism.links import Link, node_shape6
from erls.run.chain.run import ChainRun
from fe_import.modal.left_out import LeftOut
from fe_import.models.constant_strain import lacking_energy

_SAMPLES = 24
_STEP = 1e-5  # s, of differences
_HIGH = 8.0  # of the lowest frequency


def mesh_error(run: ChainRun) -> float:
    """Largest error of a point of links made of beams [m].

    Parameters
    ----------
    run : ChainRun
        Of nodal elements.

    Raises
    ------
    FEImportError
        See `erls.accuracy.finer_links.finer_links`.
    """
    mechanism, settings = run.formulation.mechanism, run.scene.record.simulation
    start = float(run.solution.t[0])
    step = min(_STEP, (run.end - start) / 4)
    t = np.linspace(start + step, run.end - step, _SAMPLES)
    states = [run.series(t + shift) for shift in (-step, 0.0, step)]
    sizes = [float(np.linalg.norm(np.ptp(link.model.nodes, axis=0))) for link in mechanism.links]
    error = 0.0
    for number, (link, left) in enumerate(zip(mechanism.links, mesh_fields(run.scene, mechanism), strict=True)):
        if left is None:
            continue
        reach = sum(sizes[k] for k in mechanism.carried(number))
        lever = max(1.0, reach / max(sizes[number], 1e-9))
        assert link.description is not None
        lacking = lacking_energy(link.description, link.model, f"link {link.name!r}", settings.elements_per_member)
        error += lever * _link_error(link, left, lacking, number, t, states, step, mechanism.gravity)
    return error


def _link_error(
    link: Link,
    left: LeftOut,
    lacking: Array,
    number: int,
    t: Array,
    states: list[StateSeries],
    step: float,
    gravity: Array,
) -> float:
    """Of the points of one link, at times t whose states, a step before, at them and after, are given [m]."""
    before, at, after = ((s.poses[number], s.modal[number]) for s in states)
    turn = at[0][:, :3, :3]
    pull = (before[0][:, :3, 3] - 2 * at[0][:, :3, 3] + after[0][:, :3, 3]) / step**2 - gravity
    relative = np.einsum("kji,kjl->kil", before[0][:, :3, :3], after[0][:, :3, :3])
    omega = np.stack([relative[:, b, c] - relative[:, c, b] for b, c in ((2, 1), (0, 2), (1, 0))], axis=1) / (4 * step)
    later = np.einsum("kji,kjl->kil", turn, after[0][:, :3, :3])
    sooner = np.einsum("kji,kjl->kil", turn, before[0][:, :3, :3])
    second = (later + sooner - 2 * np.eye(3)) / step**2  # [α] + [ω]², whose skew part is [α]
    alpha = np.stack([second[:, b, c] - second[:, c, b] for b, c in ((2, 1), (0, 2), (1, 0))], axis=1) / 2
    speed = (after[0][:, :3, 3] - before[0][:, :3, 3]) / (2 * step)
    rigid = link.model.invariants.rigid
    own = [np.einsum("kji,kj->ki", turn, each) for each in (pull, speed)]
    # high modes hold what second-order displacements and differences make of coordinates, not deflection
    low = np.concatenate([np.ones(6, dtype=bool), link.stiffness <= _HIGH**2 * link.stiffness.min()])
    faster = low * (before[1] - 2 * at[1] + after[1]) / step**2 + np.hstack([own[0], alpha]) @ rigid.T
    moving = low * (after[1] - before[1]) / (2 * step) + np.hstack([np.zeros_like(own[1]), omega]) @ rigid.T
    modes = link.model.modes
    coupling, turned = left.invariants.m[modes:, :modes], left.invariants.X[:, modes:, :modes]
    force = faster @ coupling.T + np.einsum("ka,axm,km->kx", omega, turned, moving)
    elastic = low[6:] * at[1][:, 6:]
    strain = elastic**2 @ link.stiffness
    more = force**2 @ (1 / left.stiffness) + np.einsum("ki,ij,kj->k", elastic, lacking, elastic)
    ratio = float(more.sum() / max(strain.sum(), np.finfo(float).tiny))
    tangent = np.vstack(node_shape6(link.model, link.inboard.node))
    held = np.hstack([-elastic @ np.linalg.solve(tangent[:, :6], tangent[:, 6:]).T, elastic])
    deflection = float(np.linalg.norm(link.model.translation_shapes @ held.T, axis=1).max(initial=0.0))
    rates = low[6:] * (after[1] - before[1])[:, 6:] / (2 * step)
    amplitude = float(np.sqrt((elastic**2).sum(axis=1).max(initial=0.0))) or 1.0
    sigma = float(np.sqrt((rates**2).sum(axis=1).max(initial=0.0))) / amplitude
    return deflection * (ratio + min(2.0, 0.5 * sigma * ratio * float(np.ptp(t))))
