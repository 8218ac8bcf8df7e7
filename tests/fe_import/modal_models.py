"""A small synthetic modal model that is consistent by construction."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from fe_import.modal.inertia import inertia_invariants, mass_properties
from fe_import.modal.model import FixedInterfaceModes, HealthCheck, ModalModel
from fe_import.model import FEModel, InterfaceNode


def synthetic_model(elastic_modes: int = 3, seed: int = 0) -> ModalModel:
    """Five nodes, three of them with rotations; lumped mass; random elastic shapes, mass-orthonormal."""
    rng = np.random.default_rng(seed)
    nodes = rng.uniform(-1, 1, (5, 3))
    dof_map = np.full((5, 6), -1, dtype=np.int64)
    dof_map[:, :3] = np.arange(15).reshape(5, 3)
    turning = np.array([0, 2, 4])
    dof_map[turning, 3:] = 15 + np.arange(9).reshape(3, 3)
    weights = np.concatenate([np.repeat(rng.uniform(0.5, 2, 5), 3), rng.uniform(0.01, 0.1, 9)])
    mass = sp.diags_array(weights).tocsc()
    empty = sp.csc_array((24, 24))
    fe = FEModel("link", nodes, dof_map, mass, empty, (), np.arange(24, dtype=np.int64))
    motions = fe.rigid_body_modes()
    fields = np.hstack([motions, rng.normal(size=(24, elastic_modes))])
    factor = np.linalg.cholesky(fields.T @ (mass @ fields))
    shapes = np.linalg.solve(factor, fields.T).T
    rigid = factor.T[:, :6].copy()
    frequencies = np.concatenate([np.zeros(6), 10.0 * np.arange(1, elastic_modes + 1) ** 2])
    interfaces = (
        InterfaceNode("hub", 0, nodes[0], np.array([0]), np.ones(1), "node"),
        InterfaceNode("é tip", 4, nodes[4], np.array([1, 3]), np.array([0.25, 0.75]), "averaged"),
    )
    return ModalModel(
        name="synthetic",
        form="orthonormal",
        nodes=nodes,
        node_names={"tip": 4, "elbow": 2},
        translation_shapes=shapes[dof_map[:, :3]].copy(),
        rotation_nodes=turning,
        rotation_shapes=shapes[dof_map[turning, 3:]].copy(),
        interface_nodes=interfaces,
        stiffness=np.diag((2 * np.pi * frequencies) ** 2),
        invariants=inertia_invariants(mass, shapes, dof_map, rigid),
        frequencies_hz=frequencies,
        kinds=("rigid-body",) * 6 + ("bending",) * elastic_modes,
        damping_ratios=np.concatenate([np.zeros(6), np.full(elastic_modes, 0.01)]),
        residuals=np.concatenate([np.zeros(6), np.linspace(1e-9, 0.5, elastic_modes)]),
        full_mass_properties=mass_properties(motions.T @ (mass @ motions)),
        fixed_interface=FixedInterfaceModes(np.array([12.0, 50.0]), rng.uniform(0, 0.5, (2, 6))),
        health=(HealthCheck("orthonormality", 1e-15, 1e-9), HealthCheck("grounding", 2e-7, 1e-7)),
        lines=np.array([[0, 1], [1, 2]]),
        triangles=np.array([[2, 3, 4]]),
        provenance={"source": "synthetic", "sha256": "0" * 64, "note": "", "options": '{"é": 1}'},
    )


def same(a: object, b: object) -> bool:
    """Equality of records, arrays and containers, to the last bit."""
    if isinstance(a, np.ndarray):
        return isinstance(b, np.ndarray) and a.dtype == b.dtype and np.array_equal(a, b)
    if isinstance(a, (tuple, list)):
        return type(a) is type(b) and len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    if hasattr(a, "__dataclass_fields__"):
        return type(a) is type(b) and all(same(getattr(a, f), getattr(b, f)) for f in a.__dataclass_fields__)
    return type(a) is type(b) and a == b
