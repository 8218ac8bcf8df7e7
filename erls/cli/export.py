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
    force: Force = False,
    json: Json = False,
) -> None:
    """Write mass and stiffness matrices of a link for other programs.

    Of a modal file: a superelement, six dofs for each interface and modal coordinates (Craig-Bampton). Of a link
    description: the full model. SI units; a link description that reads the files is written beside them.

    Parameters
    ----------
    source
        Modal file (.h5) or link description (.toml).
    output
        Main file; its suffix names the format: .op4, .pch (DMIG), .mtx (Matrix Market), .mat.
    format
        nastran-op4, nastran-dmig, matrix-market, mat or abaqus, instead of what the suffix says.
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
