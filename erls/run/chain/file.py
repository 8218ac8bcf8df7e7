"""What the file of a chain's run holds beside what all hold: modal models of its links, and the knots of its motion."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import h5py
import msgspec
import numpy as np

from erls.equations.formulation import Formulation
from erls.equations.quasi_static.formulation import QuasiStatic
from erls.equations.registry import FORMULATIONS, formulate
from erls.errors import Cause, SceneError
from erls.mechanism.effects import Certificate
from erls.run.chain.run import ChainRun
from erls.run.chain.shells_file import read_shells, write_shells
from erls.run.knots import End, read_solution, write_solution
from erls.scene.build import Elements, build_mechanism
from erls.scene.chain import Scene, SceneRecord
from fe_import.description.records import MOST_PIECES, LinkDescription
from fe_import.errors import ReportedError
from fe_import.files.hdf5.files import write_array, write_attribute, write_strings
from fe_import.files.hdf5.values import Reader
from fe_import.files.toml import choose, convert
from fe_import.modal.file import read_modal_group, write_modal_group
from fe_import.modal.model import ModalModel


def write_chain(group: h5py.Group, run: ChainRun) -> None:
    """Knots, models, and what is known of the effects."""
    for name, value in {} if run.certificate is None else run.certificate.summary().items():
        if value is not None and np.isfinite(value):
            write_attribute(group, name, value)
    solution, reduced = run.solution, _reduced(run.formulation)
    if reduced is not None:
        y, v, a = (reduced.stored(values) for values in (solution.y, solution.v, solution.a))
        solution = replace(solution, y=y, v=v, a=a)
    write_solution(group, solution, "rad, m, m sqrt(kg)", "independent coordinates; knot, coordinate")
    stored: list[ModalModel] = []
    numbers: list[int] = []
    models = group.create_group("models")
    mechanism = run.formulation.mechanism
    links = [mechanism.links[k] for k in mechanism.bodies]
    every = [link.model for link in links]
    every += [piece.model for link in links for piece in link.pieces]
    for model in every:
        known = [k for k, other in enumerate(stored) if other is model]
        if not known:
            known = [len(stored)]
            stored.append(model)
            write_modal_group(models.create_group(f"{len(stored):04d}"), model)
        numbers.append(known[0] + 1)
    own, others = np.split(np.array(numbers, dtype=np.int64), [len(links)])
    write_array(group, "model_of_link", own, "1", "group of models/ of each link")
    counts = np.array([len(link.pieces) for link in links], dtype=np.int64)
    if counts.any():
        write_array(group, "substructures/count", counts, "1", "pieces of each link; 0 for a link in one")
        write_array(group, "substructures/model", others, "1", "group of models/ of each piece, link by link")
    if run.scene.record.simulation.formulation == "nodal":
        texts = [link.description and msgspec.json.encode(link.description).decode() for link in links]
        write_strings(group, "descriptions", tuple(t or "" for t in texts), "links made of beams as JSON, or empty")
        for k, link in enumerate(links):
            if link.shells is not None:
                write_shells(group.create_group(f"shells/{k + 1:04d}"), link.shells)


def read_chain(file: Reader, scene: Scene, end: End) -> ChainRun:
    """The run of a chain.

    Raises
    ------
    SceneError, FEImportError
        Anything wrong inside.
    """
    path, record = file.where, scene.record
    choose(record.simulation.formulation, FORMULATIONS, f"{path}: /scene simulation.formulation", SceneError)
    count = len(record.links)
    numbers = file.integers("model_of_link", (count,), 1, count + 1)
    models = file.subgroup("models")
    counts, others = _pieces(file, record)
    read = {
        int(n): read_modal_group(models.subgroup(f"{n:04d}").group, str(path))
        for n in sorted({*numbers.tolist(), *map(int, others)})
    }
    ends = np.cumsum([0, *counts])
    pieces = [[read[int(n)] for n in others[a:b]] for a, b in pairwise(ends.tolist())]
    whole = [read[int(n)] for n in numbers]
    descriptions: list[Elements] = []
    if record.simulation.formulation == "nodal":
        descriptions = [_description(text, f"{path}: /descriptions") for text in file.names("descriptions", count)]
        if "shells" in file.names_inside():
            shells = file.subgroup("shells")
            for name in shells.names_inside():
                if not name.isdecimal() or not 1 <= int(name) <= count:
                    raise shells.fail(name, "no such link", name, count)
                k = int(name) - 1
                descriptions[k] = read_shells(shells.subgroup(name), len(whole[k].nodes))
    try:
        built = build_mechanism(scene, models=whole, descriptions=descriptions, pieces=pieces)
        formulation = formulate(built.mechanism, record.simulation)
    except ReportedError as problem:
        problem.where = f"{path}: /scene: {problem.where}"
        raise
    reduced = _reduced(formulation)
    solution = read_solution(file, formulation.size if reduced is None else reduced.inner.size, end.failure)
    if reduced is not None:
        y, v, a = (reduced.restored(values) for values in (solution.y, solution.v, solution.a))
        solution = replace(solution, y=y, v=v, a=a)
    return ChainRun(scene, formulation, solution, end.wall_s, end.warnings, _certificate(file, record))


def _reduced(formulation: Formulation) -> QuasiStatic | None:
    """A formulation whose coordinates depend on how modes are scaled: files hold those of all modes."""
    return formulation if isinstance(formulation, QuasiStatic) else None


def _certificate(file: Reader, record: SceneRecord) -> Certificate | None:
    """Of a run with ``effects = "auto"``; an error that is not there could not be followed."""
    known = file.attribute_names()
    if "effects_wall_s" not in known:
        return None
    error = file.attribute("left_out_error", float) if "left_out_error" in known else float("inf")
    effort = file.attribute("left_out_effort_error", float) if "left_out_effort_error" in known else None
    settings = record.simulation
    tolerances = settings.effects_tolerance, settings.effects_effort_tolerance
    return Certificate(error, effort, *tolerances, file.attribute("effects_wall_s", float))


def _pieces(file: Reader, record: SceneRecord) -> tuple[list[int], list[int]]:
    """Number of substructures of each link, 0 for one in one piece, and the groups of their models."""
    if "substructures" not in file.names_inside():
        return [0] * len(record.links), []
    group = file.subgroup("substructures")
    counts = group.integers("count", (len(record.links),), 0, MOST_PIECES + 1).tolist()
    for count, link in zip(counts, record.links, strict=True):
        if count not in (0, link.substructures) or count == 1:
            raise group.fail("count", f"does not fit link {link.name!r}", count, link.substructures)
    return counts, group.integers("model", (sum(counts),), 1).tolist()


def _description(text: str, where: str) -> LinkDescription | None:
    """A link description that was embedded."""
    if not text:
        return None
    try:
        data = msgspec.json.decode(text)
    except (msgspec.DecodeError, RecursionError) as problem:
        raise SceneError(Cause.RUN_FILE, f"not JSON: {problem}", where=where, remedy="make the run again") from None
    return convert(data, LinkDescription, where)
