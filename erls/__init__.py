"""Mechanisms and robots with flexible links: Equivalent Rigid Link System and component mode synthesis.

The command line in three lines::

    import erls

    scene = erls.load_scene("data/l_shape/steel_tall.toml")
    run = erls.simulate(scene)
    run.position("tip", [0.5, 1.0])  # dense output, at any time

The public names stand in ``__init__.pyi``; each is imported when it is first used, so that importing the package is
cheap.
"""

from typing import Any

import lazy_loader

_named, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from fe_import.files.versions import package_version

        return package_version("erls")
    return _named(name)
