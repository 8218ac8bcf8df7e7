"""The command that takes robots from other programs: ``erls import``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from erls.cli.terminal import Force, Json, Output, print_json, tell


def import_(
    robot: Path,
    /,
    *,
    output: Output = None,
    flexible: Annotated[list[str] | None, Parameter(name="--flexible", negative="")] = None,
    floating: Annotated[bool, Parameter(name="--floating", negative="")] = False,
    hold: Annotated[bool, Parameter(name="--hold", negative="")] = False,
    stops: Annotated[bool, Parameter(name="--stops", negative="")] = False,
    force: Force = False,
    json: Json = False,
) -> None:
    """Make a scene of a robot in URDF: joints, masses, limits, damping, looks; links become flexible where asked.

    Parameters
    ----------
    robot
        URDF file (macros expanded).
    output
        Scene to write; ROBOT.toml unless given.
    flexible
        Link that becomes flexible, LINK=DESCRIPTION.toml, or LINK=tube for an aluminium tube of its mass and length
        (tube:D with outer diameter D in metres), which is a guess and says so; may be repeated.
    floating
        The base moves freely instead of standing on the ground.
    hold
        Drives hold all joints where they start; they are free otherwise.
    stops
        Limits of joints push back, with a guessed stiffness; they are remarks otherwise.
    force
        Replace an existing file that is no scene of this command.
    json
        Print one JSON object.
    """
    from erls.cli.reports import bad, write
    from erls.files.output import replacing
    from erls.files.results import MARK, claim
    from erls.importers.robot_scene import TUBE, imported
    from erls.importers.urdf import read_urdf
    from erls.scene.read import load_scene
    from fe_import.mesh.surfaces import stl_bytes

    target = Path(robot.stem + ".toml") if output is None else output
    if target.suffix != ".toml":
        raise bad("a scene is a TOML file", "--output", target.name, "end in .toml")
    models = {}
    for text in flexible or []:
        name, equals, model = text.partition("=")
        if not equals or not name or not model:
            raise bad("not of the form LINK=DESCRIPTION.toml or LINK=tube", "--flexible", text, "e.g. forearm=tube")
        if model.partition(":")[0] != TUBE and not (target.parent / model).is_file():
            remedy = "write it first, or check the path, which starts at the scene"
            raise bad(f"no such file: {model}", "--flexible", text, remedy)
        models[name] = model
    pictures = f"{target.stem}_meshes"
    found = imported(read_urdf(robot), robot, target.parent, models, floating, hold, stops, pictures)
    files = {target.parent / "links" / name: f"# {MARK}\n{text}".encode() for name, text in found.links.items()}
    files |= {target.parent / pictures / name: stl_bytes(seen, MARK) for name, seen in found.surfaces.items()}
    claim(target, ".toml", [robot], force)
    for folder in {path.parent for path in files if not path.parent.exists()}:
        folder.mkdir()
    for path in files:
        claim(path, path.suffix, [robot], force)
    for path, content in files.items():
        with replacing(path) as temporary:
            temporary.write_bytes(content)
    write(target, f"# {MARK}\n{found.scene}")
    load_scene(target)  # with descriptions that were there before
    moving = [body.name for body in found.bodies]
    summary = {
        "robot": str(robot),
        "output": str(target),
        "links": [str(path) for path in files if path.suffix == ".toml"],
        "surfaces": [str(path) for path in files if path.suffix == ".stl"],
        "bodies": moving,
        "flexible": models,
        "told": list(found.told),
    }
    if json:
        return print_json(summary)
    for text in found.told:
        tell(f"note: {text}")
    shown = [path for path in files if path.suffix == ".toml"]
    shown += [target.parent / pictures] if found.surfaces else []
    print(f"{len(moving)} bodies that move: {', '.join(moving)}\nwritten to {', '.join(map(str, (target, *shown)))}")
