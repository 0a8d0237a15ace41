"""Classes of the campaign in this process; `tests.studies.hostile.campaign.campaign` starts it."""

from __future__ import annotations

import argparse
import gc
import json
import pkgutil
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

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
    parser.add_argument("counts", nargs="+", metavar="KIND=COUNT")
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    counts = {kind: int(count) for kind, _, count in (one.partition("=") for one in options.counts)}
    outcomes: dict[str, Any] = {}
    for kind in sorted(
        counts, key=lambda kind: len(PACKAGES.get(kind, ()))
    ):  # the fewest modules first
        load(PACKAGES.get(kind, ("flagdata",)))
        subjects = import_module(f"tests.studies.hostile.{kind}").subjects()
        outcomes[kind] = run(subjects, count=counts[kind], start=options.seed)
        options.out.write_text(json.dumps(outcomes))
