"""Links that erls writes for exudyn, against our own runs: do differences fall with the square of the deflection?

    python benchmarks/exudyn_links.py [--step 2e-5] [--halvings 3]

An arm on a hinge, with a block at its end, is pushed by a constant torque without gravity (that of exudyn leaves out
the deformation of such bodies). ``erls export`` writes the body; exudyn loads it, sets the hinge and the block on the
points around its interfaces, and integrates it by its generalized-α; ours is a run of the scene with the same step.
Both are right to first order in the deflection, so that what they differ by is of second; ``--effects linear`` leaves
out here what exudyn leaves out.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import exudyn as exu
import exudyn.itemInterface as items
import h5py
import numpy as np
from exudyn.FEM import ObjectFFRFreducedOrderInterface
from exudyn.utilities import SensorSuperElement

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT)]

import erls  # noqa: E402
from erls.cli.main import main as command  # noqa: E402

DURATION, SAMPLES, TORQUE, RADIUS = 0.1, 50, 4.0, 0.9
MASS, INERTIA = 0.1, (2e-4, 1e-4, 1.5e-4)
SCENE = f"""
gravity = [0.0, 0.0, 0.0]
[simulation]
duration = {DURATION}
spectral_radius = {RADIUS}
[[joints]]
name = "hinge"
dh = {{ convention = "standard", a = 0.5 }}
[[links]]
name = "arm"
model = "arm.toml"
mesh_pose = {{ frame = "joint" }}
[[points]]
name = "end"
link = "arm"
node = "tip"
[[payloads]]
point = "end"
mass = {MASS}
inertia = {list(INERTIA)}
"""


def ours(folder: Path, torque: float, step: float, effects: str) -> tuple[np.ndarray, float]:
    """Places of the end (k, 3), and its largest deflection [m]."""
    drive = f'joints.0.drive={{ type = "torque", profiles = [{{ shape = "constant", value = {torque!r} }}] }}'
    scene = erls.load_chain(folder / "scene.toml", [drive, f"simulation.step={step!r}", f"effects={effects}"])
    run = erls.simulate(scene, verdict=False)
    times = np.linspace(0.0, DURATION, SAMPLES + 1)
    places, angle = run.position("end", times), run.joint_angle("hinge", times)
    rigid = 0.5 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    return places, float(np.linalg.norm(places - rigid, axis=1).max())


def theirs(file: Path, torque: float, step: float) -> np.ndarray:
    """Places of the end (k, 3) in exudyn."""
    with h5py.File(file) as stored:
        around = {name: stored[f"interfaces/{name}"][:].tolist() for name in ("root", "tip")}
    cms = ObjectFFRFreducedOrderInterface(None)
    cms.LoadFromFile(str(file), "HDF5")
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    body = cms.AddObjectFFRFreducedOrder(mbs, rotationMatrixRef=np.eye(3))["oFFRFreducedOrder"]
    held = [
        mbs.AddMarker(
            items.MarkerSuperElementRigid(bodyNumber=body, meshNodeNumbers=n, weightingFactors=[1 / len(n)] * len(n))
        )
        for n in (around["root"], around["tip"])
    ]
    ground = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=mbs.AddObject(items.ObjectGround())))
    mbs.AddObject(items.GenericJoint(markerNumbers=[ground, held[0]], constrainedAxes=[1, 1, 1, 1, 1, 0]))
    end = [0.5, 0.0, 0.0]
    node = mbs.AddNode(items.NodeRigidBodyEP(referenceCoordinates=[*end, 1.0, 0.0, 0.0, 0.0]))
    block = mbs.AddObject(items.ObjectRigidBody(mass=MASS, inertia=[*INERTIA, 0.0, 0.0, 0.0], nodeNumber=node))
    mbs.AddObject(
        items.GenericJoint(
            markerNumbers=[held[1], mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=block))],
            constrainedAxes=[1] * 6,
        )
    )
    mbs.AddLoad(items.LoadTorqueVector(markerNumber=held[0], loadVector=[0.0, 0.0, torque]))
    sensor = mbs.AddSensor(
        SensorSuperElement(
            bodyNumber=body, meshNodeNumber=around["tip"][0], storeInternal=True,
            outputVariableType=exu.OutputVariableType.Position,
        )
    )  # fmt: skip
    opposite = mbs.AddSensor(
        SensorSuperElement(
            bodyNumber=body, meshNodeNumber=around["tip"][3], storeInternal=True,
            outputVariableType=exu.OutputVariableType.Position,
        )
    )  # fmt: skip
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(DURATION / step)
    settings.timeIntegration.endTime = DURATION
    settings.timeIntegration.generalizedAlpha.spectralRadius = RADIUS
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.timeIntegration.newton.relativeTolerance = 1e-8
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = DURATION / SAMPLES
    settings.linearSolver.solverType = exu.LinearSolverType.EXUdense
    settings.show.statistics = settings.show.computationTime = False
    mbs.SolveDynamic(settings)
    sides = [mbs.GetSensorStoredData(number)[:, 1:4] for number in (sensor, opposite)]
    return (sides[0] + sides[1]) / 2  # of two points on either side of the end


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--step", type=float, default=2e-5)
    parser.add_argument("--halvings", type=int, default=3)
    parser.add_argument("--effects", default="all")
    asked = parser.parse_args()
    exu.config.printToConsole = False
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "arm.toml").write_bytes((ROOT / "data/robot/links/arm.toml").read_bytes())
        (folder / "scene.toml").write_text(SCENE, encoding="utf-8")
        file = folder / "arm.hdf5"
        if command(["export", str(folder / "arm.toml"), "-o", str(file)]):
            raise SystemExit("no body was written")
        print(f"{'torque [N m]':>14}{'deflection [m]':>16}{'difference [m]':>16}{'order':>8}")
        last = float("nan")
        for torque in (TORQUE / 2**k for k in range(asked.halvings + 1)):
            own, bent = ours(folder, torque, asked.step, asked.effects)
            apart = float(np.linalg.norm(own - theirs(file, torque, asked.step), axis=1).max())
            print(f"{torque:>14.4f}{bent:>16.2e}{apart:>16.2e}{np.log2(last / apart):>8.2f}")
            last = apart


if __name__ == "__main__":
    main()
