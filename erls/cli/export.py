"""The command ``erls export``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from erls.cli.terminal import Force, Json, print_json, tell


def export(
    source: Path,
    /,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    format: str = "",
    fmi: int = 3,
    set_: Annotated[list[str] | None, Parameter(name="--set", negative="")] = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Write links and scenes for other programs.

    Of a modal file: a superelement, six dofs for each interface and modal coordinates (Craig-Bampton). Of a link
    description: mass and stiffness of the full model. SI units; a link description that reads the files is written
    beside them. Of either: a reduced body for exudyn, or standard input data (SID). Of a scene: a co-simulation unit.

    Parameters
    ----------
    source
        Modal file (.h5), link description or scene (.toml).
    output
        Main file; its suffix names the format: .op4, .pch (DMIG), .mtx (Matrix Market), .mat, .hdf5 (exudyn),
        .SID_FEM; .fmu of a scene.
    format
        nastran-op4, nastran-dmig, matrix-market, mat or abaqus, instead of what the suffix says.
    fmi
        Version of FMI of a unit: 3 or 2.
    set_
        Of a scene: change a field, KEY=VALUE; may be repeated.
    force
        Replace existing files that erls did not write.
    json
        Print one JSON object.
    """
    from erls.files.results import claim
    from erls.scene.inputs import files_of_link
    from fe_import.description.link import load_link
    from fe_import.modal.file import read_modal_file
    from fe_import.models.model import build_model
    from fe_import.writers.links import of_modal_model, of_model
    from fe_import.writers.write import chosen_format, write_link

    if output.suffix.lower() == ".fmu" and not format:
        return _unit(source, output, fmi, set_ or [], force, json)
    if set_ or fmi != 3:
        from erls.cli.reports import bad

        raise bad("is for units of scenes", "--set" if set_ else "--fmi", str(output), "end the output in .fmu")
    if output.suffix.lower() in (".hdf5", ".sid_fem") and not format:
        return _body(source, output, force, json)
    form = chosen_format(output, format)
    if source.suffix.lower() == ".toml":
        description = load_link(source)
        inputs = files_of_link(description)
        claim(output, output.suffix, inputs, force)
        tell(f"assembling {source}")
        link = of_model(build_model(description), str(source))
        method = "craig-bampton"
    else:
        inputs = [source]
        claim(output, output.suffix, inputs, force)
        link = of_modal_model(read_modal_file(source), str(source))
        method = "none"
    paths = write_link(link, output, form, lambda path: claim(path, path.suffix, inputs, force), method)
    dofs, names = int(link.mass.shape[0]), [str(path) for path in paths]
    interfaces = {name: int(link.labels[node]) for name, node in link.interfaces.items()}
    if json:
        counts = {"dofs": dofs, "nodes": len(link.labels), "modal_coordinates": link.modal}
        return print_json({"link": link.name, **counts, "interfaces": interfaces, "files": names})
    print(f"{link.name}: {dofs} dofs, {len(link.labels)} nodes, {link.modal} modal coordinates")
    print("interfaces: " + ", ".join(f"{name} is node {number}" for name, number in interfaces.items()))
    print("written: " + ", ".join(names))


def _unit(source: Path, output: Path, version: int, changes: list[str], force: bool, json: bool) -> None:
    """A scene as a co-simulation unit."""
    from erls.files.results import claim
    from erls.fmi.package import write_unit
    from erls.scene.inputs import files_of
    from erls.scene.read import load_chain

    scene = load_chain(source, changes)
    claim(output, ".fmu", files_of(scene), force)
    unit = write_unit(output, scene, version, tell)
    if json:
        names = {"inputs": unit.inputs, "outputs": unit.outputs}
        variables = {kind: {one.name: one.unit for one in every} for kind, every in names.items()}
        return print_json({"scene": unit.name, "fmi": version, "step": unit.step, **variables, "output": str(output)})
    print(f"{unit.name}: FMI {version}.0 co-simulation, steps of {unit.step:g} s within")
    for kind, every in (("inputs", unit.inputs), ("outputs", unit.outputs)):
        print(f"{kind}: " + (", ".join(f"{one.name} [{one.unit}]" for one in every) or "none"))
    print(f"written to {output}")


def _body(source: Path, output: Path, force: bool, json: bool) -> None:
    """A link as a body of exudyn, or as standard input data."""
    from erls.files.results import claim
    from erls.scene.build import cache_folder
    from erls.scene.inputs import files_of_link
    from fe_import.cache import reduce_cached
    from fe_import.description.link import load_link
    from fe_import.modal.file import read_modal_file
    from fe_import.writers.exudyn import write_exudyn
    from fe_import.writers.sid import write_sid

    kind = output.suffix.lower()
    if source.suffix.lower() == ".toml":
        description = load_link(source)
        claim(output, kind, files_of_link(description), force)
        model, _ = reduce_cached(description, cache_folder(), tell)
    else:
        claim(output, kind, [source], force)
        model = read_modal_file(source)
    if kind == ".hdf5":
        content = write_exudyn(output, model)
        count = int(content["infoList"][0])
        points = {name: [int(n) for n in numbers] for name, numbers in content["interfaces"].items()}
        found: dict[str, object] = {"interfaces": points}
        places = "points around interfaces: " + ", ".join(f"{name} {n[0]} to {n[-1]}" for name, n in points.items())
    else:
        nodes = write_sid(output, model)
        count = model.elastic_modes
        found = {"nodes": nodes, "left_out": [] if model.recovery is None else ["sigma"]}
        places = "nodes: " + ", ".join(f"{name} is {number}" for name, number in nodes.items())
    if json:
        return print_json({"link": model.name, "modes": count, **found, "files": [str(output)]})
    print(f"{model.name}: {count} modes, in which {model.interface_nodes[0].name} rests")
    print(places)
    if found.get("left_out"):
        print("left out: stress and section forces, sigma")
    print(f"written: {output}")
