"""The command ``erls``: reduce, simulate, compare, study, info, view.

Results go to stdout, progress and messages to stderr. Exit codes: 0 done, 2 bad input, 3 numerical failure, 4 did not
converge where convergence was asked for, 130 interrupted. Heavy packages are imported inside the commands, so that
help answers at once.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence

from cyclopts import App, CycloptsError, Parameter

from erls.cli.compare import compare
from erls.cli.effects import effects
from erls.cli.files import info, view
from erls.cli.reduce import reduce
from erls.cli.simulate import simulate
from erls.cli.studies import study
from erls.cli.terminal import print_json, tell
from fe_import.errors import ReportedError

app = App(
    name="erls",
    help="Simulate mechanisms and robots with flexible links.\n\n"
    "Reduce the finite-element model of a link to a modal file, put links on Denavit-Hartenberg joints in a scene, "
    "simulate it, look at the result:\n\n"
    "    erls simulate data/l_shape/steel_tall.toml -o l.run.h5\n\n"
    "    erls view l.run.h5 -o l.png",
    help_format="plaintext",
    version_flags=["--version"],
    default_parameter=Parameter(show_default=False),
    suppress_keyboard_interrupt=False,
)


for command in (reduce, simulate, info, view, compare, effects):
    app.command(command)
app.command(study)


def _report(error: ReportedError, as_json: bool) -> int:
    """Print an error; returns the exit code."""
    if as_json:
        print_json({"error": error.as_dict()})
    else:
        tell("error: " + str(error).replace("\n", "\\n"))
    return error.exit_code


def _usage_error(problem: CycloptsError) -> ReportedError:
    from erls.errors import Cause, SceneError

    text = " ".join(str(problem).split()).rstrip(".")
    return SceneError(Cause.BAD_FIELD, text, where="command line", remedy="see erls --help")


def _interrupt(number: int, frame: object) -> None:
    raise KeyboardInterrupt


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; returns the exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        Instead of those of the process.
    """
    tokens = list(sys.argv[1:] if arguments is None else arguments)
    as_json = not {"--json", "--json=true", "--json=yes", "--json=1"}.isdisjoint(tokens)
    if arguments is None:
        signal.signal(signal.SIGTERM, _interrupt)  # like Ctrl-C: finished work is kept
    try:
        code = app(tokens, exit_on_error=False, print_error=False, result_action="return_value")
        sys.stdout.flush()
        return code if isinstance(code, int) else 0
    except CycloptsError as problem:
        return _report(_usage_error(problem), as_json)
    except ReportedError as problem:
        return _report(problem, as_json)
    except KeyboardInterrupt:
        return _report(_stopped("INTERRUPTED", "interrupted", "start again"), as_json)
    except MemoryError:
        remedy = "reduce the model further, shorten the run, or free memory"
        return _report(_stopped("OUT_OF_MEMORY", "out of memory", remedy), as_json)
    except BrokenPipeError:  # whoever reads stdout has enough, as in: erls info FILE | head
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


def _stopped(cause: str, message: str, remedy: str) -> ReportedError:
    from erls.errors import Cause, SimulationError

    return SimulationError(Cause[cause], message, remedy=remedy)
