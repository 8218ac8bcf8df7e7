"""The same motion described differently: turned, moved, in other units, renumbered, later."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from erls.maths.so3 import Array
from hard_cases.case import Case, of_subject, same_as
from hard_cases.flexible import arms, beam

_FIXED = {"duration": 0.1, "step": 2e-4, "integrator": "generalized_alpha", "tolerance": 1e-6}  # tightens iterations
_ADAPTIVE = {"duration": 0.2, "tolerance": 1e-4}
_LINKS = {"upper": beam(0.5), "lower": beam(0.4, 7e10)}
_TURN = Rotation.from_euler("xyz", [31.0, -47.0, 122.0], degrees=True)
_MOVE = np.array([12.3, -4.5, 6.7])


def _scene(**simulation: Any) -> dict[str, Any]:
    return arms((0.5, 0.4), ("upper", "lower"), (-20.0, 50.0), simulation=simulation)


def _with(case: Case, **tables: Any) -> Case:
    assert isinstance(case.scene, dict)
    return dataclasses.replace(case, scene={**case.scene, **tables})


def _turned(case: Case) -> Case:
    assert isinstance(case.scene, dict)
    first = Rotation.from_euler("xyz", case.scene["base"]["rotation_deg"], degrees=True)
    base = {"rotation_deg": (_TURN * first).as_euler("xyz", degrees=True).tolist()}
    return _with(case, base=base, gravity=_TURN.apply(case.scene["gravity"]).tolist())


def _moved(case: Case) -> Case:
    assert isinstance(case.scene, dict)
    return _with(case, base={**case.scene["base"], "position": _MOVE.tolist()})


_LONGER, _HEAVIER = 1e3, 1e3  # millimetres and grams


def _in_millimetres(case: Case) -> Case:
    """All numbers in millimetres, grams and seconds: stresses keep theirs."""
    assert isinstance(case.scene, dict)
    links = {}
    for name, link in case.links.items():
        materials = {
            "m": {**link["materials"]["m"], "density": link["materials"]["m"]["density"] * _HEAVIER / _LONGER**3}
        }
        modulus = link["materials"]["m"]["youngs_modulus"] * _HEAVIER / _LONGER
        materials["m"]["youngs_modulus"] = modulus
        sections = {
            "s": {**link["sections"]["s"], **{k: link["sections"]["s"][k] * _LONGER for k in ("width", "height")}}
        }
        nodes = {k: [_LONGER * x for x in at] for k, at in link["frame"]["nodes"].items()}
        links[name] = {**link, "materials": materials, "sections": sections, "frame": {**link["frame"], "nodes": nodes}}
    joints = [{**joint, "dh": {**joint["dh"], "a": _LONGER * joint["dh"]["a"]}} for joint in case.scene["joints"]]
    simulation = {**case.scene["simulation"], "tolerance": _LONGER * case.scene["simulation"]["tolerance"]}
    gravity = [_LONGER * g for g in case.scene["gravity"]]
    return dataclasses.replace(_with(case, joints=joints, simulation=simulation, gravity=gravity), links=links)


def _renumbered(case: Case) -> Case:
    """Nodes of the links in the other order."""
    links = {}
    for name, link in case.links.items():
        nodes = dict(reversed(link["frame"]["nodes"].items()))
        member = link["frame"]["members"][0]
        members = [{**member, "from": member["to"], "to": member["from"]}]
        links[name] = {**link, "frame": {**link["frame"], "nodes": nodes, "members": members}}
    return dataclasses.replace(case, links=links)


def _two_arms(order: tuple[int, int], **simulation: Any) -> dict[str, Any]:
    """Two arms on the ground, listed in one order or the other."""
    both = [
        ("left", "upper", 0.5, {"position": [0.0, -0.3, 0.0]}, -20.0),
        ("right", "lower", 0.4, {"position": [0.0, 0.3, 0.0]}, 35.0),
    ]
    scene = _scene(**simulation)
    chosen = [both[k] for k in order]
    scene["joints"] = [
        {
            "name": f"j {n}",
            "on": "ground",
            "branch": branch,
            "dh": {"convention": "standard", "a": a},
            "initial": {"position_deg": angle},
        }
        for n, _, a, branch, angle in chosen
    ]
    scene["links"] = [{"name": n, "model": f"{m}.toml", "mesh_pose": {"frame": "joint"}} for n, m, *_ in chosen]
    scene["points"] = [{"name": f"tip {n}", "link": n, "node": "tip"} for n in ("left", "right")]
    return scene


def _pushed(begin: float, **simulation: Any) -> dict[str, Any]:
    """A chain that rests, held by stiff springs, until a torque begins."""
    scene = arms((0.5, 0.4), ("upper", "lower"), (-90.0, 0.0), simulation=simulation)
    load = {"type": "torque", "profiles": [{"shape": "step", "start": begin, "value": 2.0}]}
    scene["joints"][0] |= {"drive": load}
    return {**scene, "initial": {"deformation": "static"}}


def _later(case: Case) -> Case:
    assert isinstance(case.scene, dict)
    simulation = case.scene["simulation"]
    return dataclasses.replace(case, scene=_pushed(0.15, **{**simulation, "duration": simulation["duration"] + 0.1}))


def _pair(
    name: str, scene: Callable[..., dict[str, Any]], twin: Callable[[Case], Case], fast: bool = False, **more: Any
) -> list[Case]:
    """With equal steps and with adaptive ones."""
    truth, quick = same_as(twin, by="its twin", **more), ("erls", "ffr")
    return [
        Case(f"{name}, equal steps", scene(**_FIXED), truth, links=_LINKS, fast=quick if fast else ()),
        Case(f"{name}, adaptive", scene(**_ADAPTIVE), truth, links=_LINKS, fast=quick[:1] if fast else ()),
    ]


def _as_before(places: Array) -> Array:
    return _TURN.inv().apply(places.reshape(-1, 3)).reshape(places.shape)


CASES = of_subject(
    "invariance",
    [
        *_pair("world turned", _scene, _turned, back=_as_before, fast=True),
        *_pair("base moved by 15 m", _scene, _moved, back=lambda places: places - _MOVE),
        *_pair("millimetres and grams", _scene, _in_millimetres, back=lambda places: places / _LONGER, fast=True),
        *_pair("nodes of links renumbered", _scene, _renumbered),
        *_pair(
            "links renumbered",
            lambda **s: _two_arms((0, 1), **s),
            lambda case: dataclasses.replace(case, scene=_two_arms((1, 0), **case.scene["simulation"])),
        ),  # type: ignore[arg-type]
        *_pair("a tenth of a second later", lambda **s: _pushed(0.05, **s), _later, later=0.1),
    ],
)
