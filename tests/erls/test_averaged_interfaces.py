"""The solid L with averaged (RBE3) against rigid (RBE2) faces: what the choice changes in a simulation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scenes

import erls


def simulated(folder: Path, coupling: str) -> erls.Run:
    """0.1 s of data/l_shape/solid.toml."""
    link = scenes.read_toml(scenes.ROOT / "data/l_shape/links/solid.toml")
    link["solid"]["mesh"] = str(scenes.ROOT / "data/l_shape/meshes/l_hex20.msh")
    for interface in link["interfaces"]:
        interface["coupling"] = coupling
    scene = scenes.read_toml(scenes.ROOT / "data/l_shape/solid.toml")
    scene["links"][0]["model"] = str(scenes.write_toml(folder / f"{coupling}_link.toml", link))
    return erls.simulate(
        erls.load_scene(scenes.write_toml(folder / f"{coupling}.toml", scene), ["simulation.duration=0.1"]),
        verdict=False,
    )


def test_rigid_and_averaged_faces(tmp_path: Path) -> None:
    """The tips of the falling L part by 9e-6 m (seen) while they fall 55 mm: the softness of the clamped face.

    The lowest free frequencies agree to 0.2 %, the truncation of a basis of 12 fixed-interface modes; energy is kept.
    """
    rigid, averaged = (simulated(tmp_path, coupling) for coupling in ("rigid", "averaged"))
    times = np.linspace(0, 0.1, 21)
    apart = np.linalg.norm(rigid.position("tip", times) - averaged.position("tip", times), axis=1).max()
    fallen = np.linalg.norm(rigid.position("tip", 0.1) - rigid.position("tip", 0.0))
    assert 1e-6 < apart < 1e-3 * fallen
    models = [run.formulation.mechanism.links[0].model for run in (rigid, averaged)]
    assert [i.coupling for model in models for i in model.interface_nodes] == ["rigid"] * 2 + ["averaged"] * 2
    assert all(c.ok for model in models for c in model.health)
    np.testing.assert_allclose(models[1].frequencies_hz[6:10], models[0].frequencies_hz[6:10], rtol=2e-3)
    for run in (rigid, averaged):
        assert np.ptp(run.energy(times).total) < 1e-5 * models[0].mass_properties.mass * 9.81 * fallen
