"""Makes the films of the list that are missing: `python -m tests.studies vtk-films
[BEGINNING_OF_NAME ...]`.

The folder is FLAGDATA_FILMS, by default `out/films`.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from pathlib import Path

from flagdata.core.rng import stream
from tests.evidence import REFERENCE
from tests.studies.validation.environments import VTK
from tests.studies.validation.vtk_films.designs import SEED, Design, designs, scene_of
from tests.studies.validation.vtk_films.runs import read
from tests.studies.validation.vtk_films.scene import film

FOLDER = Path(os.environ.get("FLAGDATA_FILMS", "out/films"))


def path_of(design: Design, folder: Path) -> Path:
    """Of its film."""
    return folder / f"{design.name}.mp4"


def make(wanted: Iterable[Design], *, folder: Path, python: Path) -> None:
    """Make the films that are missing.

    Raises:
        UnusableError: VTK failed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for design in wanted:
        path = path_of(design, folder)
        if not path.exists():
            scene = scene_of(design, read(REFERENCE, design.run))
            film(python, scene, path, stream(SEED, "films", design.name, "noise"))


if __name__ == "__main__":
    chosen = [one for one in designs() if one.name.startswith(tuple(sys.argv[1:]) or "")]
    make(chosen, folder=FOLDER, python=VTK.find())
