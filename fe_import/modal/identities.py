"""Identities of a modal model: symmetry, definiteness, orthonormality, rigid-body motion.

With ρ_b the modal coordinates of a unit translation along b, and A_a the cross product with e_a: Uρ_b is that
translation, so A_a U ρ_b = U ρ_(a×b), which ties the invariants to each other for any mass matrix:

    X_a ρ_b = m ρ_(a×b),    Z_ab ρ_c = X_aᵀ ρ_(b×c).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_import.errors import Cause, FEImportError
from fe_import.modal.model import ModalModel
from fe_import.model import Array

EXACT = 1e-8  # symmetry, definiteness, orthonormality: relative
RIGID = 1e-6  # rigid-body motion, squared frequencies: relative


@dataclass(frozen=True)
class Check:
    """Refuses what is not so, naming file and dataset."""

    where: str
    root: str

    def __call__(self, ok: Any, item: str, message: str, value: Any = None, limit: Any = None) -> None:
        if not ok:
            place = f"{self.where}: {self.root}/{item}"
            remedy = "reduce the link again ('erls reduce')"
            value, limit = (float(x) if isinstance(x, np.floating) else x for x in (value, limit))
            raise FEImportError(
                Cause.MODAL_FILE, message, where=place, value=value, limit=limit, remedy=remedy
            )

    def each(self, ok: Any, values: Any, item: str, message: str, limit: Any = None) -> None:
        """All of ``ok``; else the message names the first place and its value."""
        ok, values = np.asarray(ok), np.asarray(values)
        if not ok.all():
            index = tuple(int(i) for i in np.unravel_index(int(np.argmin(ok)), ok.shape))
            self(False, item, f"{message}, at {list(index)}", values[index].item(), limit)


def check_symmetric(matrix: Array, item: str, check: Check) -> None:
    """Symmetric and positive semidefinite, relative to the largest entry."""
    scale = np.abs(matrix).max()
    if scale == 0:
        return
    scaled = matrix / scale
    off = np.abs(scaled - scaled.T)
    check.each(off <= EXACT, off, item, "the matrix is not symmetric", EXACT)
    try:
        np.linalg.cholesky(scaled + EXACT * np.eye(len(scaled)))
    except np.linalg.LinAlgError:  # rare, so the dearer eigenvalues are only found now
        lowest = float(np.linalg.eigvalsh(scaled)[0])
        check(lowest >= -EXACT, item, "the matrix is not positive semidefinite", lowest, -EXACT)


def check_matrices(model: ModalModel, check: Check) -> None:
    """Reduced mass and stiffness, symmetry of Z, and the ties between m, X and Z."""
    inertia = model.invariants
    check_symmetric(inertia.m, "reduced/mass", check)
    check_symmetric(model.stiffness, "reduced/stiffness", check)
    check_symmetric(model.full_mass_properties.inertia, "full_model/inertia", check)
    scale = np.abs(inertia.Z).max()
    for a in range(3):
        for b in range(a, 3):
            off = np.abs(inertia.Z[a, b] - inertia.Z[b, a].T).max()
            check(off <= EXACT * scale, "inertia/Z", f"Z[{a}, {b}] is not Z[{b}, {a}]'", off, EXACT * scale)

    moved = inertia.rigid[:, :3]
    force = inertia.m @ moved
    turns = [np.cross(np.eye(3)[a], np.eye(3)).T for a in range(3)]  # column b: e_a × e_b
    x_limit = RIGID * (np.abs(force).max() + np.abs(inertia.X).max() * np.abs(moved).max())
    z_limit = RIGID * (scale + np.abs(inertia.X).max()) * np.abs(moved).max()
    for a in range(3):
        off = np.abs(inertia.X[a] @ moved - force @ turns[a]).max()
        check(off <= x_limit, "inertia/X", f"X[{a}] does not fit the mass matrix", off, x_limit)
        for b in range(3):
            off = np.abs(inertia.Z[a, b] @ moved - inertia.X[a].T @ (moved @ turns[b])).max()
            check(off <= z_limit, "inertia/Z", f"Z[{a}, {b}] does not fit X", off, z_limit)


def check_orthonormal(model: ModalModel, check: Check) -> None:
    """Six rigid-body modes, then elastic ones of rising frequency that diagonalize mass and stiffness.

    A rigid link may lack mass or inertia, so its six modes need not be orthonormal.
    """
    stiffness, frequencies = model.stiffness, model.frequencies_hz
    rising = np.diff(frequencies, prepend=0.0) >= 0
    check.each(rising, frequencies, "frequencies_hz", "frequencies must rise")
    rigid = np.array([kind == "rigid-body" for kind in model.kinds])
    expected = np.arange(len(rigid)) < 6
    check.each(rigid == expected, model.kinds, "kinds", "the first 6 modes are the rigid-body ones")
    largest = np.abs(stiffness).max()
    if model.elastic_modes:
        off = np.abs(model.invariants.m - np.eye(model.modes))
        check.each(off <= EXACT, off, "reduced/mass", "the modes are not mass-orthonormal", EXACT)
    limit = (
        EXACT * largest if model.elastic_modes else 1.0
    )  # without elastic modes nothing to compare: (rad/s)²
    resisting = np.abs(stiffness[:6])
    check.each(resisting <= limit, resisting, "reduced/stiffness", "resists a rigid-body mode", limit)
    squared = (2 * np.pi * frequencies) ** 2
    off = np.abs(stiffness - np.diag(squared))
    bound = RIGID * np.sqrt(np.outer(squared, squared)) + limit
    check.each(off <= bound, stiffness, "reduced/stiffness", "not diag((2 π f)²) of frequencies_hz")


def check_rigid_motion(model: ModalModel, check: Check) -> None:
    """The rigid modal coordinates move the nodes as geometry says: displacement d + ω × x, rotation ω."""
    rigid, size = model.invariants.rigid, float(np.abs(model.nodes).max()) or 1.0
    moved = np.tensordot(model.translation_shapes, rigid, 1)  # node, axis, motion
    turned = np.tensordot(model.rotation_shapes, rigid, 1)
    arms = np.stack([np.cross(e, model.nodes) for e in np.eye(3)], axis=-1)
    zero = np.zeros((3, 3))
    for item, got, geometry, scale in (
        ("mode_shapes/translation", moved[:, :, :3], np.eye(3), 1.0),
        ("mode_shapes/translation", moved[:, :, 3:], arms, size),
        ("mode_shapes/rotation", turned[:, :, :3], zero, 1 / size),
        ("mode_shapes/rotation", turned[:, :, 3:], np.eye(3), 1.0),
    ):
        off = np.abs(got - geometry) / scale
        message = "the rigid-body modes do not move the nodes rigidly (node, axis, motion)"
        check.each(off <= RIGID, off, item, message, RIGID)
