"""Families of links: the largest errors at places that were not sampled, beside the stated bound, and what they cost.

    python benchmarks/parametric.py [--places 100] [--only tube]

An L-shaped tube of beams (diameter, wall, modulus, length of the second leg) and the folded bracket of
`data/shells/links/bracket.toml` (thickness, modulus, density, Poisson's ratio), each number within 30 % of the middle.
Errors are those of the first ten frequencies and of the static flexibility of the tip, root held, against the whole
model at random places. Ends with 1 when a bound is broken or beyond 0.1 %.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from fe_import.parametric.held import exact_figures
from fe_import.parametric.model import ACCURACY, ParametricModel
from fe_import.parametric.reduce import reduce_parametric
from fe_import.parametric.samples import Samples

ROOT = Path(__file__).parents[1]
TUBE = ROOT / "data" / "parametric" / "links" / "tube.toml"
BRACKET = ROOT / "data" / "shells" / "links" / "bracket.toml"
ELBOW = 'tip = [0.5, 0.0, 0.0]\n\n[[frame.members]]\nfrom = "root"\nto = "tip"'
LEGS = (
    'elbow = [0.5, 0.0, 0.0]\ntip = [0.5, 0.5, 0.0]\n\n[[frame.members]]\nfrom = "elbow"\nto = "tip"\nelements = 8\n'
    'material = "aluminium"\nsection = "tube"\n\n[[frame.members]]\nfrom = "root"\nto = "elbow"'
)
METAL = "materials.aluminium"


def parameter(name: str, key: str, middle: float) -> str:
    return f'[parameters.{name}]\nkeys = ["{key}"]\nlower = {0.7 * middle}\nupper = {1.3 * middle}\n'


def tube() -> str:
    text = TUBE.read_text(encoding="utf-8").replace(ELBOW, LEGS)
    return "\n".join(
        [
            text,
            parameter("modulus", f"{METAL}.youngs_modulus", 7e10),
            parameter("length", "frame.nodes.tip.1", 0.5),
        ]
    )


def bracket() -> str:
    text = BRACKET.read_text(encoding="utf-8").replace("../meshes", str(BRACKET.parents[1] / "meshes"))
    numbers = (
        ("thickness", "shell.thickness", 0.0025),
        ("modulus", f"{METAL}.youngs_modulus", 7e10),
        ("density", f"{METAL}.density", 2700.0),
        ("poisson", f"{METAL}.poissons_ratio", 0.33),
    )
    return "\n".join([text, *(parameter(*each) for each in numbers)])


def judged(family: ParametricModel, places: int) -> tuple[np.ndarray, float, float]:
    """Largest errors at random places; seconds of the figures of a member, and of its modal model."""
    samples, rng = Samples(family.link), np.random.default_rng(20260)
    worst, clocks = np.zeros(2), []
    for place in rng.uniform(*samples.bounds, (places, len(family.names))):
        values = dict(zip(family.names, place.tolist(), strict=True))
        begun = time.perf_counter()
        found = family.figures(values)
        middle = time.perf_counter()
        family.at(values)
        clocks.append((middle - begun, time.perf_counter() - middle))
        worst = np.maximum(worst, exact_figures(samples.model(place), family.inboard).errors(found))
    return worst, *np.median(clocks, axis=0).tolist()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--places", type=int, default=100)
    parser.add_argument("--only", default="")
    given = parser.parse_args()
    print("| | fields, samples | frequencies: found, bound | flexibility: found, bound | figures, member |")
    print("|---|---|---|---|---|")
    broken = False
    for name, text in (("tube", tube()), ("bracket", bracket())):
        if given.only not in name:
            continue
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"{name}.toml"
            path.write_text(text, encoding="utf-8")
            begun = time.process_time()
            family = reduce_parametric(path)
            seconds = time.process_time() - begun
            worst, quick, whole = judged(family, given.places)
        bound = family.bound.frequencies, family.bound.flexibility
        broken |= bool((worst > bound).any()) or max(bound) > ACCURACY
        pairs = [f"{100 * w:.2g} %, {100 * b:.2g} %" for w, b in zip(worst, bound, strict=True)]
        fields = family.translation_shapes.shape[2]
        print(
            f"| {name} | {fields}, {family.grid.count} ({seconds:.0f} s) | {pairs[0]} | {pairs[1]} | "
            f"{1e3 * quick:.2g} ms, {1e3 * whole:.2g} ms |"
        )
    return int(broken)


if __name__ == "__main__":
    sys.exit(main())
