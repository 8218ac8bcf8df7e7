"""The command ``erls``: reduce, simulate, compare, study, info, view.

Results go to stdout, progress and messages to stderr. Exit codes: 0 done, 2 bad input, 3 numerical failure, 4 did not
converge where convergence was asked for, 130 interrupted. Heavy packages are imported inside the commands, so that
help answers at once.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from cyclopts import App, CycloptsError, Parameter

from erls.cli.effects import effects
from erls.cli.studies import compare, study
from erls.cli.terminal import (
    Json,
    Output,
    Progress,
    peak_memory_mb,
    print_json,
    refuse_unwritable,
    remove,
    report_times,
    tell,
)
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


@app.command
def reduce(
    link: Path,
    /,
    *,
    output: Output = None,
    method: str | None = None,
    modes: int | None = None,
    json: Json = False,
) -> None:
    """Reduce the finite-element model of a link to a modal file.

    Prints the modes, the mass properties and the health checks.

    Parameters
    ----------
    link
        Link description (TOML).
    output
        Modal file to write; LINK.modal.h5 in the current folder unless given.
    method
        Reduction instead of the one in the description: craig-bampton, craig-chang, guyan,
        mode-displacement or none.
    modes
        Number of elastic modes instead of that in the description.
    json
        Print one JSON object.
    """
    from fe_import.description.link import load_link
    from fe_import.modal.file import write_modal_file
    from fe_import.reduce import reduce_link, reduction_summary

    changes = {k: v for k, v in (("method", method), ("elastic_modes", modes)) if v is not None}
    description = load_link(link, changes)
    target = output or Path(f"{description.description.name}.modal.h5")
    refuse_unwritable(target, link)
    begun = time.perf_counter()
    tell(f"reducing {link}")
    model = reduce_link(description, tell)
    write_modal_file(target, model)
    summary = {
        **reduction_summary(model),
        "wall_s": time.perf_counter() - begun,
        "peak_memory_mb": peak_memory_mb(),
        "output": str(target),
    }
    if json:
        return print_json(summary)
    from erls.report.tables import modal_report

    print(modal_report(model))
    print(f"\nwritten to {target}")


@app.command
def simulate(
    scene: Path,
    /,
    *,
    output: Output = None,
    formulation: str | None = None,
    set_: Annotated[list[str] | None, Parameter(name="--set", negative="")] = None,
    at: str = "",
    strict: Annotated[bool, Parameter(negative="")] = False,
    json: Json = False,
) -> None:
    """Simulate a scene; links are reduced on the fly and cached by content.

    Parameters
    ----------
    scene
        Scene (TOML).
    output
        Run file to write (HDF5); none unless given.
    formulation
        Formulation instead of the one in the scene: erls, ffr or nodal.
    set_
        Change a field of the scene, KEY=VALUE; may be repeated. For example simulation.step=1e-4,
        links.arm.elastic_modes=8, joints.0.initial.position_deg=30.
    at
        Times in seconds, separated by commas, at which to report joints and points.
    strict
        With effects = "auto": repeat the run where what was left out passes the tolerance; exit code 4 where no effect
        brings its own estimate within it.
    json
        Print one JSON object.
    """
    from erls.errors import Cause, SceneError, SimulationError
    from erls.scene.read import is_body_scene, load_chain
    from fe_import.files.toml import read_toml

    if is_body_scene(read_toml(scene, SceneError)):
        from erls.cli.bodies import simulate_bodies

        return simulate_bodies(scene, output, formulation, set_ or (), at, json)
    from erls.report.tables import run_report
    from erls.run.file import write_run
    from erls.simulation.simulate import simulate as run_simulation

    changes = list(set_ or [])
    if formulation is not None:
        changes.append(f'simulation.formulation="{formulation}"')
    loaded = load_chain(scene, changes)
    times = report_times(at, loaded.record.simulation.duration)
    if output is not None:
        refuse_unwritable(output, scene)
    partial = output.with_name(f"{output.name}.partial") if output is not None else None
    try:
        with Progress("simulating") as advance:
            run = run_simulation(loaded, progress=advance, tell=tell, checkpoint=partial, strict=strict)
    except SimulationError as problem:
        if output is None and problem.run is not None:
            hint = "give -o RUN.h5 to keep what was computed"
            problem.remedy = hint if problem.cause == Cause.INTERRUPTED else f"{problem.remedy}; {hint}"
        elif output is not None and problem.run is not None and len(problem.run.solution.t) > 1:
            write_run(output, problem.run)
            tell(f"what was computed, up to t = {problem.run.end:.6g} s, is in {output}")
            remove(partial)
        raise
    if output is not None:
        write_run(output, run)
        remove(partial)
    if json:
        return print_json({**run.summary(times), "output": None if output is None else str(output)})
    print(run_report(run, times))
    if output is not None:
        print(f"\nwritten to {output}")


@app.command
def info(file: Path, /, *, json: Json = False) -> None:
    """Show what is in a link, modal, scene or run file.

    Of a modal file: the modes with frequency, kind and effective mass, the mass properties against those of the full
    model, and the health checks.

    Parameters
    ----------
    file
        The file.
    json
        Print one JSON object.
    """
    from erls.report.info import file_info

    summary, text = file_info(file)
    if json:
        return print_json(summary)
    print(text)


@app.command
def view(
    run: Path,
    /,
    *,
    output: Output = None,
    at: str = "",
    magnify: float = 1.0,
    fps: int = 30,
    speed: float = 1.0,
    json: Json = False,
) -> None:
    """Make a picture, film or export of a run; without -o, open a window.

    The ending of the output decides: .png or .jpg a picture, .mp4 or .gif a film, .pvd the deformed links for
    ParaView, .csv a table of joints, points, forces and energies.

    Parameters
    ----------
    run
        Run file.
    output
        File to write.
    at
        Times in seconds, separated by commas, instead of even ones (picture, .pvd, .csv).
    magnify
        Factor on the displacement of the links; 1 shows it true.
    fps
        Frames per second of a film.
    speed
        Film time over real time; 0.5 is slow motion.
    json
        Print one JSON object.
    """
    from erls.run.bodies.result_file import refuse_result
    from erls.run.file import load_run
    from erls.view import show, write_view

    refuse_result(run, "pictures are of chains of joints and links")
    loaded = load_run(run)
    if output is None:
        show(loaded)
        return
    refuse_unwritable(output, run)
    begun = time.perf_counter()
    times = report_times(at, loaded.end) or None
    with Progress("drawing") as advance:
        write_view(
            loaded,
            output,
            times=times,
            magnification=magnify,
            fps=fps,
            speed=speed,
            progress=lambda done, total: advance(done, total),
        )
    if json:
        return print_json({"run": str(run), "output": str(output), "wall_s": time.perf_counter() - begun})
    print(f"written to {output}")


app.command(compare)
app.command(effects)
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
