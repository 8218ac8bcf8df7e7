"""Hard cases: one table of cases × formulations × outcome × stated against actual error.

    python benchmarks/hard_cases.py [--only TEXT] [--json rows.jsonl] [--again] [--fast] [--list]

A row passes where the run comes to its end and its stated error is at least the actual one, or where it ends with the
cause that the case names; rows that do not apply say why. Cases and what judges them: tests/erls/hard_cases/. Rows go
to the file as they come, one JSON object a line, and those that stand there are kept, so that Ctrl-C loses nothing;
``--again`` judges them anew. ``--only`` takes rows whose subject, case or formulation contain a text, ``--fast`` those
that the tests run. The exit code is 1 where a row fails.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), *(str(ROOT / "tests" / part) for part in ("", "erls"))]  # before this file's own folder

from hard_cases import ROWS  # noqa: E402  # those of the tests
from hard_cases.case import Case, judged  # noqa: E402

Key = tuple[str, str, str]


def key_of(case: Case, formulation: str) -> Key:
    """What a row is known by."""
    return case.subject, case.name, formulation


def rows_of(path: Path) -> dict[Key, dict[str, Any]]:
    """Rows that a file holds; of several of one key the last."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    rows = [json.loads(line) for line in lines if line.strip()]
    return {(row["subject"], row["case"], row["formulation"]): row for row in rows}


def judge_all(wanted: list[tuple[Case, str]], known: dict[Key, dict[str, Any]], path: Path) -> None:
    """Judge what is not known, and write each row as soon as it is."""
    begun = time.monotonic()
    with path.open("a", encoding="utf-8") as file:
        for number, (case, formulation) in enumerate(wanted, 1):
            here = f"{case.subject}: {case.name}, {formulation}"
            print(
                f"{number:4d} of {len(wanted)}, {time.monotonic() - begun:5.0f} s  {here}", file=sys.stderr, flush=True
            )
            row = judged(case, formulation)
            known[key_of(case, formulation)] = row
            file.write(json.dumps(row) + "\n")
            file.flush()


def lines_of(rows: list[dict[str, Any]]) -> list[str]:
    """The table, in Markdown."""
    lines, subject = [], ""
    for row in rows:
        if row["subject"] != subject:
            subject = row["subject"]
            head = ("case", "formulation", "outcome", "stated", "actual", "judged by")
            lines += ["", f"**{subject}**", "", _line(head), _line(("---",) * len(head))]
        measures = [f"{name} {value:.1e}" for name, value, _ in row["measures"]]
        outcome = f"FAILS: {row['outcome']}; {row['problem']}" if row["problem"] else row["outcome"]
        numbers = ["" if row[name] is None else f"{row[name]:.1e}" for name in ("stated", "off")]
        judge = "; ".join(text for text in (row["by"], *measures) if text)
        lines.append(_line((row["case"], row["formulation"], outcome, *numbers, judge)))
    return lines[1:]


def _line(fields: Any) -> str:
    return f"| {' | '.join(' '.join(field.split()) for field in fields)} |"


def main() -> int:
    """Judge, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="rows whose subject, case or formulation contain this")
    parser.add_argument("--json", type=Path, default=Path("hard_cases.jsonl"), help="rows, one JSON object a line")
    parser.add_argument("--again", action="store_true", help="judge rows anew that stand in the file")
    parser.add_argument("--fast", action="store_true", help="rows that run in the tests")
    parser.add_argument("--list", action="store_true", help="of the rows, and no more")
    given = parser.parse_args()
    wanted = [
        (case, formulation)
        for case, formulation in ROWS
        if given.only in ": ".join(key_of(case, formulation)) and (not given.fast or formulation in case.fast)
    ]
    if given.list:
        print(*(": ".join(key_of(*row)) for row in wanted), sep="\n")
        return 0
    known = rows_of(given.json)
    todo = [row for row in wanted if given.again or key_of(*row) not in known]
    try:
        judge_all(todo, known, given.json)
    except KeyboardInterrupt:
        print("stopped; the rows so far are kept", file=sys.stderr)
        return 130
    rows = [known[key_of(*row)] for row in wanted]
    print(*lines_of(rows), sep="\n")
    failed = [row for row in rows if row["problem"]]
    beside = sum(row["outcome"] == "not applicable" for row in rows)
    print(f"\n{len(rows)} rows, of which {beside} do not apply and {len(failed)} fail.")
    return 1 if failed else 0


if __name__ == "__main__":
    np.seterr(all="ignore")
    raise SystemExit(main())
