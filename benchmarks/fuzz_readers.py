"""Damaged files by the thousand, for every reader of both packages.

    python benchmarks/fuzz_readers.py [--cases 500] [--seed 0] [--limit 5] [--only mesh] [--keep FOLDER]

What a reader may do with a damaged file is in tests/fuzzing.py. Each case has a time limit; faulty files are kept in
FOLDER. Prints a table: cases, what was accepted (unchanged; with another value of equal syntax; with lines less, of
formats without counts; with a set that is said to be lost), refusals by cause, the slowest case.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), *(str(ROOT / "tests" / part) for part in ("", "fe_import", "erls"))]

import fuzz_readers as fe_readers  # noqa: E402
import fuzz_scene_readers as scene_readers  # noqa: E402
from fuzzing import fuzz_group  # noqa: E402


def main() -> int:
    """Run, print the table; 1 when a reader is at fault."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=500, help="of each reader")
    parser.add_argument("--seed", type=int, default=0, help="the first one")
    parser.add_argument("--limit", type=float, default=5.0, help="of a case, in seconds")
    parser.add_argument("--only", default="", help="readers whose group or name holds this")
    parser.add_argument("--keep", type=Path, help="folder for the files of faulty cases")
    given = parser.parse_args()
    warnings.simplefilter("error")
    faults: list[str] = []
    total: Counter[str] = Counter()
    for group, build in (fe_readers.GROUPS | scene_readers.GROUPS).items():
        chosen = [r for r in build() if given.only in group or given.only in r.name]
        for name, report in fuzz_group(chosen, given.cases, given.seed, given.limit, given.keep).items():
            accepted = ", ".join(f"{k} {n}" for k, n in report.accepted.most_common()) or "none"
            refused = ", ".join(f"{k} {n}" for k, n in report.refused.most_common()) or "none"
            print(f"{name}: {report.cases} cases, slowest {1e3 * report.slowest:.0f} ms")
            print(f"    accepted: {accepted}\n    refused: {refused}", flush=True)
            faults += report.faults
            total += report.accepted + Counter(cases=report.cases, refused=report.refused.total())
    print("all: " + ", ".join(f"{k} {n}" for k, n in total.most_common()) + f", faults {len(faults)}")
    print(*faults, sep="\n")
    return 1 if faults else 0


if __name__ == "__main__":
    raise SystemExit(main())
