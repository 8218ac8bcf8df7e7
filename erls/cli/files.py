"""The commands that look at files: ``erls info`` and ``erls view``."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

from erls.cli.terminal import Force, Json, Output, Progress, print_json, report_times

if TYPE_CHECKING:
    from erls.run.record import Run

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


def view(
    run: Path,
    /,
    *,
    output: Output = None,
    at: str = "",
    mode: int | None = None,
    magnify: float = 1.0,
    color: str = "deflection",
    fps: int = 30,
    speed: float = 1.0,
    overlay: Path | None = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Make a picture, film or export of a run; without -o, open a window.

    The ending of the output decides: .png or .jpg a picture, .mp4 or .gif a film, .pvd the deformed links, or beams and
    bodies, for ParaView, .csv a table of joints, points, forces, sensors and energies, .html a report: plots, the
    mechanism in space, what the run states of its error; or a measured record over the run (--overlay).

    Parameters
    ----------
    run
        Run file, or modal file.
    output
        File to write.
    at
        Times in seconds, at rest load parameters, separated by commas, instead of even ones (picture, .pvd, .csv).
    mode
        Show this vibration or buckling mode of bodies and beams, or this elastic mode of a modal file, from 1 on, over
        the phase of its period (--at).
    magnify
        Factor on the displacement of the links, or of bodies and beams at rest; 1 shows it true.
    color
        What colours say (pictures, films, windows; point data of .pvd): deflection; stress, von Mises, of shells the
        largest over the thickness; section-force or section-moment of beams. Links need `[recovery]` for all but the
        first.
    fps
        Frames per second of a film.
    speed
        Film time over real time; 0.5 is slow motion.
    overlay
        Measured record (CSV): time in its first column, then columns with heads of the table that -o RUN.csv gives.
        They are drawn over those of the run, with largest and rms difference, correlation and lag; -o PAGE.html, or
        the figures alone.
    force
        Replace an existing file that is no such picture, film, export or table of this program.
    json
        Print one JSON object.
    """
    from erls.files.results import claim
    from erls.run.bodies.mode import mode_of
    from erls.run.file import load_run
    from erls.run.link_mode import is_modal_file, link_mode
    from erls.view import show, view_kind, write_view

    loaded: Run
    if is_modal_file(run):
        loaded = link_mode(run, 1 if mode is None else mode)
    else:
        loaded = load_run(run)
        if mode is not None:
            loaded = mode_of(loaded, mode)
    if overlay is not None:
        return _overlaid(loaded, run, overlay, output, force, json)
    if output is None:
        show(loaded, color=color)
        return
    claim(output, view_kind(output), [run], force)
    begun = time.perf_counter()
    times = report_times(at, loaded.end, loaded.axis.unit) or None
    with Progress("drawing") as advance:
        write_view(
            loaded,
            output,
            times=times,
            magnification=magnify,
            fps=fps,
            speed=speed,
            color=color,
            progress=lambda done, total: advance(done, total),
        )
    if json:
        return print_json({"run": str(run), "output": str(output), "wall_s": time.perf_counter() - begun})
    print(f"written to {output}")


def _overlaid(loaded: Run, run: Path, record: Path, output: Path | None, force: bool, json: bool) -> None:
    """The part of `view` for a measured record."""
    from erls.cli.reports import bad, tell_written, write
    from erls.files.results import claim
    from erls.report.overlay_page import overlay_page, overlay_text
    from erls.studies.overlay import overlay, overlay_summary

    if output is not None:
        if output.suffix != ".html":
            raise bad("a record is drawn on a page", "--output", output.name, "end in .html")
        claim(output, output.suffix, [run, record], force)
    found = overlay(loaded, record)
    if output is not None:
        write(output, overlay_page(found))
    if json:
        return print_json({**overlay_summary(found), "output": None if output is None else str(output)})
    print(overlay_text(found))
    tell_written(output)
