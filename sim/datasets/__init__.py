"""Data sets: recipes of simulated and rendered recordings, their building on many processes, and
their cards.

A recipe (`recipe`, read by `reading`) says which scene is simulated how often for each side of the
split, how the meshes are filmed, and what the anemometer beside them says. `build` turns it into
mesh sequences and recordings of a lake, which load like real ones.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from sim.datasets.anemometer import log_of_air, velocities
    from sim.datasets.camera_picture import encode_pictures, settings
    from sim.datasets.cast import Cast, Roll, casts
    from sim.datasets.dataset_films import EPOCH, PlannedFilm, Sequences
    from sim.datasets.dataset_recipe import (
        AnemometerSpec,
        CameraSpec,
        DatasetRecipe,
        Truth,
        with_counts,
    )
    from sim.datasets.dataset_toml import DATASETS, load, parse

__getattr__ = lazy_exports(__name__, __file__)
