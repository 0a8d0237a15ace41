"""Starts the worker with the Python of Blender's environment: `python -I launch.py`.

The worker's source lies beside this file, in an installation that may be of another Python with
another NumPy. Only its two packages are made importable, by name; its folder on `sys.path` would
bring the rest of that installation along.
"""

import sys
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

PACKAGES = ("flagdata", "sim")


def expose(name: str, root: Path) -> None:
    """Makes the package that lies in a folder importable, without that folder's other packages.

    Raises:
        ImportError: it is not there.
    """
    folder = root / name
    spec = spec_from_file_location(
        name, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    if spec is None or spec.loader is None:
        raise ImportError(f"there is no package {name} in {root}")
    module = module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)


if __name__ == "__main__":
    root_folder = Path(__file__).resolve().parents[2]
    if root_folder.parent.name == "flagdata":  # installed: the packages lie inside it
        expose("flagdata", root_folder.parents[1])
    else:
        for package in PACKAGES:
            expose(package, root_folder)
    import_module("sim.blender.worker").main()
