"""Time of a step of 1 ms of `erls.stepper`: the three-link robot, 12 modes a link, led by controllers in Python.

    python benchmarks/stepper.py

Median, 99th percentile and worst of 2000 steps, without sensors and with an accelerometer, a gyroscope, three encoders
and three tachometers, by the clock and without what other programs take of it; and the memory that steps leave behind.
"""

from __future__ import annotations

import gc
import tempfile
import time
import tracemalloc
from pathlib import Path

import numpy as np

import erls

ROBOT = Path(__file__).parents[1] / "data" / "robot" / "three_link.toml"
JOINTS = ("shoulder", "elbow_joint", "wrist")
GOAL, GAIN, DAMPING = np.radians([60.0, 45.0, -30.0]), np.array([60.0, 30.0, 8.0]), np.array([6.0, 2.0, 0.3])
STEPS, WARM, MORE = 2000, 50, 1000
MOTORS = [
    change
    for name in JOINTS
    for change in (
        f'joints.{name}.drive={{ type = "free" }}',
        f"joints.{name}.motor={{ rotor_inertia = 1e-4, gear_ratio = 50.0 }}",
    )
]
SENSORS = """
[[sensors]]
name = "imu"
type = "accelerometer"
point = "end3"

[[sensors]]
name = "gyro"
type = "gyroscope"
point = "end3"
""" + "".join(
    f'\n[[sensors]]\nname = "{kind} {joint}"\ntype = "joint_{kind}"\njoint = "{joint}"\n'
    for kind in ("angle", "rate")
    for joint in JOINTS
)


def measure(scene: Path) -> None:
    """Print the figures of one scene."""
    stepper = erls.stepper(erls.load_scene(scene, MOTORS))

    def efforts() -> dict[str, float]:
        """Springs and dampers that lead the joints to the angles of the scene within 1 s."""
        y, v, _ = stepper.state
        x = min(stepper.time, 1.0)
        return dict(zip(JOINTS, GAIN * (GOAL * x * x * (3 - 2 * x) - y[:3]) - DAMPING * v[:3], strict=True))

    spent = np.empty((2, STEPS))
    for _ in range(WARM):
        stepper.step(efforts(), 1e-3)
    gc.disable()
    for k in range(STEPS):
        given = efforts()
        begun = time.perf_counter(), time.thread_time()
        stepper.step(given, 1e-3)
        spent[:, k] = time.perf_counter() - begun[0], time.thread_time() - begun[1]
    gc.enable()
    tracemalloc.start()
    stepper.step(efforts(), 1e-3)
    gc.collect()
    before = tracemalloc.get_traced_memory()[0]
    for _ in range(MORE):
        stepper.step(efforts(), 1e-3)
    gc.collect()
    left = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    print(f"{len(stepper.sensor_names)} sensors; {MORE} more steps leave {left} bytes")
    for what, times in zip(("by the clock", "of the processor"), 1e6 * spent, strict=True):
        half, most, worst = np.quantile(times, [0.5, 0.99, 1.0])
        print(f"  {what}: median {half:.0f} us, 99 % below {most:.0f} us, worst {worst:.0f} us")


if __name__ == "__main__":
    measure(ROBOT)
    with tempfile.TemporaryDirectory() as folder:
        text = ROBOT.read_text(encoding="utf-8").replace("links/", f"{ROBOT.parent.as_posix()}/links/")
        other = Path(folder) / "robot.toml"
        other.write_text(text + SENSORS, encoding="utf-8")
        measure(other)
