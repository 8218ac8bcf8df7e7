"""Free chains of 3, 6 and 10 flexible links: ERLS beside FFR, both beside exact beams, and what linear links leave out.

    python benchmarks/long_chains.py [--links 3,6,10] [--duration 0.5] [--step 1e-4]

Links of data/robot (0.5 m, 10 x 10 mm aluminium), all joints free, released from rest under gravity, joint axes in turn
vertical and horizontal. Per chain: steps and largest distance of the end from that of FFR at each tolerance; from the
nodal elements (16 per link, steps of ``--step`` and twice it, extrapolated); and, of links linear in their frames,
distance of ERLS from FFR for Young's modulus as it is and four times it: the order in which these two depart.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

import erls
from erls.scene.read import load_scene

ARM = Path(__file__).resolve().parent.parent / "data/robot/links/arm.toml"


def write_chain(folder: Path, links: int, duration: float, stiffer: float = 1.0) -> Path:
    """A scene of so many links, ``stiffer`` times Young's modulus."""
    text = ARM.read_text(encoding="utf-8")
    (folder / "arm.toml").write_text(text.replace("7e10", repr(7e10 * stiffer)), encoding="utf-8")
    lines = ["[simulation]", f"duration = {duration}", "[base]", "rotation_deg = [90.0, 0.0, 0.0]"]
    for k in range(links):
        alpha = 90.0 if k % 3 == 0 else 0.0
        lines += ["[[joints]]", f'name = "j{k}"', f'dh = {{ convention = "standard", a = 0.5, alpha_deg = {alpha} }}']
        lines += ["[[links]]", f'name = "l{k}"', 'model = "arm.toml"', 'mesh_pose = { frame = "joint" }']
    lines += ["[[points]]", 'name = "end"', f'link = "l{links - 1}"', 'node = "tip"']
    path = folder / "chain.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def end_of(path: Path, times: np.ndarray, *changes: str) -> tuple[np.ndarray, int]:
    """Places of the last link's end, and steps."""
    run = erls.simulate(load_scene(path, [f"simulation.{change}" for change in changes]))
    return run.position("end", times), run.solution.work.steps


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """Largest distance [m]."""
    return float(np.linalg.norm(one - other, axis=1).max())


def main() -> None:
    """Print one line per comparison."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--links", default="3,6,10")
    parser.add_argument("--duration", type=float, default=0.5)
    parser.add_argument("--step", type=float, default=1e-4)
    given = parser.parse_args()
    times = np.linspace(0.0, given.duration, 201)
    for links in map(int, given.links.split(",")):
        with tempfile.TemporaryDirectory() as name:
            path = write_chain(Path(name), links, given.duration)
            for tolerance in (1e-4, 1e-6):
                pair = [end_of(path, times, f"formulation={f}", f"tolerance={tolerance}") for f in ("erls", "ffr")]
                print(
                    f"{links:2d} links, tolerance {tolerance:g} m: {pair[0][1]} and {pair[1][1]} steps, ERLS and FFR "
                    f"{apart(pair[0][0], pair[1][0]):.1e} m apart",
                    flush=True,
                )
            coarse, fine = (
                end_of(path, times, "formulation=nodal", f"step={factor * given.step}", "elements_per_member=16")[0]
                for factor in (2, 1)
            )
            beams = fine + (fine - coarse) / 3
            print(
                f"{links:2d} links, from exact beams: ERLS {apart(pair[0][0], beams):.1e} m, FFR "
                f"{apart(pair[1][0], beams):.1e} m (beams: step {apart(fine, beams):.0e} m)",
                flush=True,
            )
            far = []
            for stiffer in (1.0, 4.0):
                path = write_chain(Path(name), links, given.duration, stiffer)
                linear = [end_of(path, times, f"formulation={f}", "effects=linear") for f in ("erls", "ffr")]
                far.append(apart(linear[0][0], linear[1][0]))
            print(f"{links:2d} links, linear ones: {far[0]:.1e} m apart, {far[1]:.1e} m with four times the modulus")


if __name__ == "__main__":
    main()
