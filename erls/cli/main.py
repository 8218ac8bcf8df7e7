"""The command ``erls``: reduce, export, simulate, linearize, optimize, invert, identify, study, info, view ...

Results go to stdout, progress and messages to stderr. Exit codes: 0 done, 2 bad input, 3 numerical failure, 4 did not
converge where convergence was asked for, 130 interrupted. Heavy packages are imported inside the commands, so that
help answers at once.
"""

from __future__ import annotations

import errno
import gc
import re
import signal
import sys
from collections.abc import Sequence

from cyclopts import App, CycloptsError, Parameter

from erls.cli.address_space import require_address_space
from erls.cli.compare import compare
from erls.cli.effects import effects
from erls.cli.export import export
from erls.cli.files import info, view
from erls.cli.identify import identify
from erls.cli.importing import import_
from erls.cli.invert import invert
from erls.cli.linearize import linearize
from erls.cli.optimize import optimize
from erls.cli.plan import plan
from erls.cli.reduce import reduce
from erls.cli.simulate import simulate
from erls.cli.starting import examples, new, schema
from erls.cli.streams import StdoutLost, prepare_streams
from erls.cli.studies import study
from erls.cli.terminal import listen, print_json, tell
from fe_import.compiled.address_space import address_space
from fe_import.errors import ReportedError

app = App(
    name="erls",
    help="Simulate mechanisms and robots with flexible links.\n\n"
    "Reduce the finite-element model of a link to a modal file, put links on Denavit-Hartenberg joints in a scene, "
    "simulate it, look at the result:\n\n"
    "    erls simulate data/l_shape/steel_tall.toml -o l.run.h5\n\n"
    "    erls view l.run.h5 -o l.png\n\n"
    "Every command takes --quiet (stderr gets errors and warnings alone) and --verbose (messages with their time).",
    help_format="plaintext",
    version_flags=["--version"],
    default_parameter=Parameter(show_default=False),
    suppress_keyboard_interrupt=False,
)

_UNLOADED = re.compile("shared object|cannot allocate memory", re.IGNORECASE)

_RUN = (reduce, export, simulate, info, view, compare, effects, linearize, optimize, invert, plan, identify)
_BEGIN = (new, schema)
for command in (*_RUN, *_BEGIN):
    app.command(command)
app.command(import_, name="import")
for group in (study, examples):
    app.command(group)
app.register_install_completion_command(help="Install completion for the shell in use.")


def _report(error: ReportedError, as_json: bool) -> None:
    """Print an error."""
    if as_json:
        print_json({"error": error.as_dict()})
    else:
        tell("error: " + str(error).replace("\n", "\\n"))


def _usage_error(problem: CycloptsError) -> ReportedError:
    from erls.errors import Cause, SceneError

    text = " ".join(str(problem).split()).partition(" Available commands")[0].rstrip(".")  # help lists them whole
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
    tokens = listen(list(sys.argv[1:] if arguments is None else arguments))
    as_json = not {"--json", "--json=true", "--json=yes", "--json=1"}.isdisjoint(tokens)
    if arguments is None:
        prepare_streams()
        signal.signal(signal.SIGTERM, _interrupt)  # like Ctrl-C: finished work is kept
    code, failure = 0, None
    try:
        require_address_space(tokens)
        found = app(tokens, exit_on_error=False, print_error=False, result_action="return_value")
        sys.stdout.flush()
        code = found if isinstance(found, int) else 0
    except CycloptsError as problem:
        failure = _usage_error(problem)
    except ReportedError as problem:
        failure = problem
    except KeyboardInterrupt:
        failure = _stopped("INTERRUPTED", "interrupted", "start again")
    except StdoutLost as problem:
        failure, as_json = _of_stdout(problem), False
    except (MemoryError, ImportError, OSError) as problem:
        failure = _of_memory(problem) or _of_extra(problem)
        if failure is None:
            raise
    if failure is not None:
        try:
            _report(failure, as_json)
            sys.stdout.flush()
        except StdoutLost:
            _report(failure, as_json=False)
        code = failure.exit_code
    if arguments is None:
        gc.freeze()  # the process ends: looking for cycles among what compilers and libraries hold takes 0.2 s
    return code


def _stopped(cause: str, message: str, remedy: str) -> ReportedError:
    from erls.errors import Cause, SimulationError

    return SimulationError(Cause[cause], message, remedy=remedy)


def _of_stdout(problem: StdoutLost) -> ReportedError | None:
    """None where nobody reads it."""
    if problem.reader_left:
        return None
    from erls.files.output import not_writable

    return not_writable("stdout", problem.strerror, "free disk space, or send it elsewhere")


def _of_extra(problem: Exception) -> ReportedError | None:
    """The error where an extra of the installation is missing."""
    from erls.files.optional import missing_package

    return missing_package(problem)


def _of_memory(problem: Exception) -> ReportedError | None:
    """The error where memory is missing, or address space even for a library; None where it is something else."""
    limit = address_space()
    unloaded = limit is not None and isinstance(problem, (ImportError, OSError)) and _UNLOADED.search(str(problem))
    if not (isinstance(problem, MemoryError) or getattr(problem, "errno", None) == errno.ENOMEM or unloaded):
        return None
    what = "" if limit is None else f": address space is limited to {limit // 2**20} MB"
    more = "free memory" if limit is None else "raise ulimit -v"
    return _stopped("OUT_OF_MEMORY", f"out of memory{what}", f"reduce the model further, shorten the run, or {more}")
