"""A class of the campaign in this process; `tests.studies.hostile.campaign.campaign` starts it."""

from __future__ import annotations

import argparse
import gc
import pkgutil
from contextlib import suppress
from importlib import import_module
from pathlib import Path

from tests.studies.hostile import KINDS
from tests.studies.hostile.campaign import run

PACKAGES = {
    "recipes": ("flagdata", "sim", "models", "measure"),
    "models": ("flagdata", "models", "measure"),
    "bombs": ("flagdata", "sim", "models"),
}
"""Packages whose modules a class uses, where it uses others than flagdata's."""


def load(names: tuple[str, ...]) -> None:
    """Load all modules of some packages, which the examples would load one after another."""
    for name in names:
        package = import_module(name)
        for module in pkgutil.walk_packages(package.__path__, f"{name}."):
            if not module.name.endswith("__main__") and ".blender" not in module.name:
                with suppress(ImportError):
                    import_module(module.name)
    gc.freeze()  # or each example would look at all of it, and so copy it


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    load(PACKAGES.get(options.kind, ("flagdata",)))
    subjects = import_module(f"tests.studies.hostile.{options.kind}").subjects()
    run(subjects, count=options.count, start=options.seed, out=options.out)
