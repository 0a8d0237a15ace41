"""Training from catalogs: recipes, inputs that were prepared once, steps that can be taken up
again, checkpoints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from models.training.augment.augment import Augment
    from models.training.conditioned_clips import FitFilm
    from models.training.inputs import Prepared, prepare_clips, prepare_films
    from models.training.train_command import sides_of
    from models.training.training_recipe import DataSpec, TrainingRecipe, load, parse

__getattr__ = lazy_exports(__name__, __file__)
