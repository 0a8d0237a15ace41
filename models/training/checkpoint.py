"""Where a training stands: all that the steps still to come depend on, in one folder that is
replaced as a whole.

A checkpoint holds the learner, Adam's moments, the best learner so far, the course of the losses,
and the cursor of the batches, with the checksums of all files. It is written beside the last one
and renamed, so that a kill or a full disk leaves the last good one; the one before it is kept, for
where the last was damaged later.
"""

from __future__ import annotations

import copy
import json
import logging
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from flagdata.core.files.checksums import SUMS, check_sums, files_of, write_sums
from flagdata.core.files.durable import flush_file
from flagdata.core.files.file_locks import LOCK
from flagdata.core.numbered import read_bounded
from flagdata.errors import ConflictError, CorruptError, FlagdataError, RefusedError
from models.networks.learner import Learner
from models.trained.model_folder import (
    CARD,
    WEIGHTS,
    read_card,
    read_tensors,
    write_card,
    write_tensors,
)
from models.training.progress import LossCourse

_LOG = logging.getLogger("flagdata")
_ANEW = (
    "restore the folder from a copy, or delete all checkpoints beside it to train from the "
    "beginning"
)
_LAST = "last"
_NEXT = "next"
_BEFORE = "before"
_BEST = "best.safetensors"
_MOMENTS = "moments.safetensors"
_KINDS = ("exp_avg", "exp_avg_sq", "step")


@dataclass(kw_only=True)
class Standing:
    """Attributes:
    learner: as it is now.
    best: its state at the best validation loss; None before the first epoch's end.
    optimiser: Adam.
    course: of the losses.
    batches: state of the batches still to come.
    running: sum of the losses of the epoch that is under way, and how many steps it has had.
    """

    learner: Learner
    best: dict[str, Tensor] | None
    optimiser: torch.optim.Optimizer
    course: LossCourse
    batches: dict[str, Any]
    running: tuple[float, int] = (0.0, 0)

    @property
    def has_begun(self) -> bool:
        """Returns whether a step was taken."""
        return bool(self.course.epochs or self.running[1])


def check_folder(folder: Path) -> None:
    """Refuses a folder in which checkpoints would be kept beside, or in place of, anything else.

    Raises:
        ConflictError: it holds something that no training wrote.
    """
    files = {Path(LOCK)} | {
        Path(part) / name
        for part in (_LAST, _NEXT, _BEFORE)
        for name in (WEIGHTS, _BEST, _MOMENTS, CARD, SUMS)
    }
    expected = files | {file.parent for file in files}
    for path in sorted(folder.rglob("*")):
        if path.relative_to(folder) not in expected or path.is_symlink():
            raise ConflictError(
                "the run folder has files that no training wrote",
                where=str(path),
                fix="give a new or empty folder by --run",
            )


def save(folder: Path, standing: Standing, *, identity: dict[str, Any]) -> None:
    """Takes a checkpoint in `folder`; the one before it is kept beside it.

    Raises:
        FlagdataError: the disk refuses it; the last checkpoint is as it was.
    """
    fresh, last, before = folder / _NEXT, folder / _LAST, folder / _BEFORE
    try:
        shutil.rmtree(fresh, ignore_errors=True)
        fresh.mkdir(parents=True)
        write_tensors(fresh / WEIGHTS, standing.learner.state_dict())
        if standing.best is not None:
            write_tensors(fresh / _BEST, standing.best)
        write_tensors(fresh / _MOMENTS, _moments(standing))
        card = {
            "identity": identity,
            "course": standing.course.as_list(),
            "batches": standing.batches,
            "running": list(standing.running),
        }
        write_card(fresh, card)
        write_sums(fresh)
        for file in files_of(fresh):
            flush_file(file)
        if last.exists():
            shutil.rmtree(before, ignore_errors=True)
            last.rename(before)
        fresh.rename(last)
    except OSError as error:
        raise FlagdataError(
            f"writing the checkpoint failed: {error.strerror or error}",
            where=str(error.filename or folder),
            fix="free some space and give the command again: it goes on from the last checkpoint",
        ) from error


def restore(folder: Path, standing: Standing, *, identity: dict[str, Any]) -> bool:
    """Brings `standing` to where the last sound checkpoint in `folder` was taken; False where there
    is none at all.

    A damaged last one is passed over with a warning for the one before it, from which the same
    steps are taken again.

    Raises:
        RefusedError: it is of another recipe or of other data.
        CorruptError: all are damaged, or do not fit the recipe.
    """
    checkpoints = [path for path in (folder / _LAST, folder / _BEFORE) if path.exists()]
    damage: CorruptError | None = None
    for checkpoint in checkpoints:
        try:
            check_sums(checkpoint, fix=_ANEW)
        except CorruptError as error:
            damage = damage or error
            continue
        if damage is not None:
            _LOG.warning(
                "flagdata: warning: the last checkpoint is damaged: %s; the training goes on from "
                "the one before it"
                "\n  where: %s",
                damage.what,
                damage.where,
            )
        _take(checkpoint, standing, identity)
        return True
    if damage is not None:
        raise damage
    return False


def _take(folder: Path, standing: Standing, identity: dict[str, Any]) -> None:
    """Brings `standing` to where the checkpoint in `folder` itself, which is sound, was taken."""
    card = read_card(folder)
    stored = json.loads(json.dumps(identity))
    trained_on = card.get("identity")
    if not isinstance(trained_on, dict):
        raise CorruptError(
            "the checkpoint does not state its training", where=str(folder), fix=_ANEW
        )
    different = [name for name in stored if trained_on.get(name) != stored[name]]
    if different:
        raise RefusedError(
            f"the checkpoint is of another training: {', '.join(different)} differ",
            where=str(folder),
            fix="name another folder by --run, or delete this one",
        )
    try:
        standing.learner.load_state_dict(read_tensors(folder / WEIGHTS))
        _take_moments(standing, read_tensors(folder / _MOMENTS))
        standing.best = read_tensors(folder / _BEST) if (folder / _BEST).exists() else None
        if standing.best is not None:
            copy.deepcopy(standing.learner).load_state_dict(
                standing.best
            )  # it is needed at the training's end
        standing.course = LossCourse.of(card["course"])
        standing.batches = dict(card["batches"])
        standing.running = (float(card["running"][0]), int(card["running"][1]))
    except (
        KeyError,
        TypeError,
        ValueError,
        RuntimeError,
        IndexError,
        OverflowError,
        AttributeError,
    ) as error:
        raise CorruptError(
            f"the checkpoint does not fit its recipe: {error}",
            where=str(folder),
            fix="delete it and train again",
        ) from None


def _moments(standing: Standing) -> dict[str, Tensor]:
    """Flattens Adam's state by parameter, "0.exp_avg" …."""
    state = standing.optimiser.state_dict()["state"]
    return {
        f"{index}.{kind}": values[kind]
        for index, values in state.items()
        for kind in _KINDS
        if kind in values
    }


def _take_moments(standing: Standing, tensors: dict[str, Tensor]) -> None:
    state = standing.optimiser.state_dict()
    shapes = {
        index: tuple(weights.shape) for index, weights in enumerate(standing.learner.parameters())
    }
    moments: dict[int, dict[str, Tensor]] = {}
    for name, tensor in tensors.items():
        digits, _, kind = name.partition(".")
        index = read_bounded(digits, most=len(shapes))
        if index not in shapes:
            raise ValueError(f"moments are of parameter {digits!r}, which is none of the model")
        moments.setdefault(index, {})[kind] = tensor
    for index, values in moments.items():
        wanted = {kind: () if kind == "step" else shapes[index] for kind in _KINDS}
        if {kind: tuple(tensor.shape) for kind, tensor in values.items()} != wanted:
            raise ValueError(f"the moments of parameter {index} are of other kinds or shapes")
    state["state"] = moments
    standing.optimiser.load_state_dict(state)
