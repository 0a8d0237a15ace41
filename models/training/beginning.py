"""What a recipe asks of the clips that it names, compared when a training begins: before anything
is prepared."""

from __future__ import annotations

import numpy as np
import torch

from flagdata.core.arrays import IntArray
from flagdata.dataset.pairs import Pairs
from flagdata.errors import InputError
from flagdata.lake import Lake
from models.networks.learner import Loss
from models.networks.targets import Scaling
from models.training.conditioned_clips import SIZE
from models.training.inputs import complete_truth, simulations
from models.training.stated_films import StatedFilms
from models.training.steps import check_batch
from models.training.training_recipe import TrainingRecipe

_MULTIPLE = 8  # of the sizes that every front end takes [px]


def check_clips(
    recipe: TrainingRecipe,
    lake: Lake,
    train: Pairs,
    validation: Pairs,
    *,
    films: IntArray,
    at: str | None,
) -> None:
    """Checks that a recipe can be trained on the clips of two sides.

    Args:
        films: rows of `train` that are learned from, one of each film.
        at: the version that the sides are of.

    Raises:
        InputError, UsageError: their length, rate, size, number, targets or simulations do not fit;
            the fix is a line of the recipe, where one helps.
    """
    check_batch(len(films), recipe.optimiser.batch)
    StatedFilms.of(lake, train, validation, at=at).check_learned(recipe.front_end, recipe.cropping)
    _check_size(recipe, train, validation)
    if recipe.loss.name is Loss.CONTRASTIVE:
        _check_alike(simulations(train, films), side="training")
        _check_alike(simulations(validation, np.arange(len(validation))), side="validation")
    if names := recipe.loss.targets:
        truth = complete_truth(train.table.parameter_columns(films), names)
        Scaling(names=names).check(truth, where="the training side")
        of_validation = complete_truth(validation.table.parameter_columns(), names)
        Scaling(names=names).check(of_validation, where="the validation side")
        with torch.random.fork_rng(devices=[]):
            recipe.learner().fit_scale(torch.from_numpy(truth))


def _check_size(recipe: TrainingRecipe, *sides: Pairs) -> None:
    """Refuses pictures of which every crop would be enlarged; those of one clip of each side are
    looked at."""
    size = recipe.front_end.size
    side = (
        SIZE
        if recipe.cropping.conditioned
        else min(min(pairs[0].clip.shape[-2:]) for pairs in sides)
    )
    if size > side:
        most = side // _MULTIPLE * _MULTIPLE
        raise InputError(
            f"the recipe takes pictures of {size} px, and the films have {side} px",
            where="[input] size",
            fix=f"write size = {most} in [input], or build films of {size} px or more"
            if most
            else f"build films of {size} px or more",
        )


def _check_alike(sequence: IntArray, *, side: str) -> None:
    """Refuses clips (n,) of these simulations that a contrastive loss has no pair of."""
    simulations, count = np.unique(sequence, return_counts=True)
    if len(simulations) < 2 or count.max() < 2:
        raise InputError(
            f"the {side} side has no two clips of one simulation beside another's, which a "
            "contrastive loss compares",
            where="[loss] name",
            fix='write name = "posterior" and targets in [loss], or learn from a data set of '
            "several films a sequence",
        )
