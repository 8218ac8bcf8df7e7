"""Systems with modes (`erls.equations.switches`), of what acts in the joints and contacts of a formulation."""

from __future__ import annotations

from typing import Any

from erls.equations.loops.closed_chain import ClosedChain


def switched(system: Any) -> Any:
    """A system with modes; the system itself where nothing has any, or nobody can say when they end.

    Motors along angles that are no coordinates, as in the minimum-norm gauge, come to their limits as steps pass.
    """
    tree = system.bare if isinstance(system, ClosedChain) else system
    if not getattr(tree, "along_coordinates", False) or not tree.size:
        return system
    if not tree.mechanism.switches:
        return system
    if isinstance(system, ClosedChain):
        from erls.equations.loops.switched import SwitchedChain  # here: it imports the compiler

        return SwitchedChain(system)
    from erls.equations.switches.tree import SwitchedTree  # here: as much as it takes

    return SwitchedTree(system)
