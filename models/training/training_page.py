"""What a training answers: losses by epoch, and how the network reads clips that it did not learn
from."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import torch

from flagdata.answer.answer import Answer, Array, Figure, Gallery, Head, Section, Table, Tone
from flagdata.answer.charts import Axis, Chart, Colour, Dots, Line, Panel
from flagdata.answer.quantity import Bound, Quantity, Span
from flagdata.core.arrays import FloatArray, IntArray
from flagdata.dataset import Pairs
from flagdata.lake import Artifact
from flagdata.pages.page_pictures import moving
from models.networks.learner import Learner, Loss
from models.networks.targets import TARGETS, Target
from models.trained.estimator import Estimator
from models.trained.model_folder import read_tensors, write_tensors
from models.training.inputs import Prepared, clip_as_taken
from models.training.progress import LossCourse
from models.training.training_recipe import TrainingRecipe

PAGE = "training.html"
_JUDGED = "judged.safetensors"
"""In a model's folder the clips that its page shows; models of earlier versions have none."""
_LEVEL = 0.90
_SHOWN = 6
_MOST = 400
"""Clips that validate, and are judged for the page, at most."""
_TOGETHER = 32  # clips
_SIDE = 200  # px


@dataclass(frozen=True, kw_only=True, eq=False)
class JudgedClips:
    """Clips that validated a training, as the trained network reads them.

    Attributes:
        target: what is read.
        truth, estimate: (n,).
        low, high: (n,) ends of the 90 % intervals; empty of a network without distributions.
        rows: (n,) of the pairs.
    """

    target: Target
    truth: FloatArray
    estimate: FloatArray
    low: FloatArray
    high: FloatArray
    rows: IntArray

    @property
    def error(self) -> float:
        """Root mean square of estimate less truth."""
        return float(np.sqrt(np.mean((self.estimate - self.truth) ** 2)))

    def sample(self, count: int) -> list[int]:
        """Chooses clips from the least truth to the greatest."""
        order = np.argsort(self.truth, kind="stable")
        places = np.linspace(0, len(order) - 1, min(count, len(order))).round().astype(int)
        return [int(place) for place in order[places]]

    def write(self, folder: Path) -> None:
        """Writes the clips to a model's folder."""
        names = [one.name for one in fields(self) if one.name != "target"]
        tensors = {name: torch.from_numpy(getattr(self, name)) for name in names}
        write_tensors(folder / _JUDGED, tensors)

    @classmethod
    def read(cls, folder: Path, recipe: TrainingRecipe) -> JudgedClips | None:
        """Reads the clips of the model in a folder; None where it has none.

        Raises:
            CorruptError: the file is damaged.
        """
        if not (folder / _JUDGED).is_file():
            return None
        arrays: dict[str, Any] = {
            name: tensor.numpy() for name, tensor in read_tensors(folder / _JUDGED).items()
        }
        return cls(target=TARGETS[recipe.loss.targets[0]], **arrays)


@torch.no_grad()
def judge_clips(
    recipe: TrainingRecipe, learner: Learner, validation: Prepared
) -> JudgedClips | None:
    """Reads clips that validated with the trained network: its first target, which of most is the
    wind. None of a network without targets."""
    if learner.objective is Loss.CONTRASTIVE:
        return None
    count = len(validation)
    rows = np.unique(np.linspace(0, count - 1, min(count, _MOST)).round().astype(np.int64))
    device, estimator = next(learner.parameters()).device, _estimator(recipe, learner.eval())
    name = learner.scaling.names[0]
    estimates, lows, highs = [], [], []
    for first in range(0, len(rows), _TOGETHER):
        chosen = rows[first : first + _TOGETHER]
        inputs = validation.batch(chosen, np.zeros(len(chosen), dtype=np.int64)).to(device)
        if learner.objective is Loss.POSTERIOR:
            found = estimator.estimate(inputs)
            low, high = found.interval(_LEVEL)
            estimates.append(found.mean[:, 0])
            lows.append(low[:, 0])
            highs.append(high[:, 0])
        else:
            points = learner.point_estimates(learner.network(inputs))
            estimates.append(points[:, 0].double().cpu().numpy())
    return JudgedClips(
        target=TARGETS[name],
        truth=validation.truth((name,))[rows, 0],
        estimate=np.concatenate(estimates),
        low=np.concatenate(lows or [np.empty(0)]),
        high=np.concatenate(highs or [np.empty(0)]),
        rows=rows,
    )


def _estimator(recipe: TrainingRecipe, learner: Learner) -> Estimator:
    return Estimator(
        name=recipe.name,
        learners=(learner,),
        front_end=recipe.front_end,
        cropping=recipe.cropping,
        widening=torch.ones(len(learner.scaling.targets)),
        cloud=None,
        card={},
    )


def training_answer(
    recipe: TrainingRecipe,
    card: Mapping[str, Any],
    judged: JudgedClips | None,
    pairs: Pairs,
    *,
    artifact: Artifact | None = None,
) -> Answer:
    """Returns how far a training came.

    Args:
        card: of the model.
        judged: clips that validated; None of a network without targets.
        pairs: that they are of.
        artifact: the model in the lake; None before it is there.
    """
    course = LossCourse.of(card["course"])
    figures = [Figure(title="Losses and learning rate by the epoch", content=course.chart())]
    if judged is not None:
        figures.append(
            Figure(
                title=f"{judged.target.about} of clips that validate, estimated over true",
                content=_scatter(judged),
                caption=f"{len(judged.truth):,} clips that the network did not learn from; the "
                "epoch was chosen by them, so that others are read a little worse.",
            )
        )
    provenance = {"recipe": recipe.hash, "seed": str(recipe.seed)}
    if artifact is not None:
        provenance["artifact"] = artifact.id
    return Answer(
        question="train",
        subject=recipe.name
        if recipe.title in ("", recipe.name)
        else f"{recipe.name}: {recipe.title}",
        sentence=_sentence(recipe, course, judged),
        tone=Tone.SETTLED if course.epochs else Tone.OPEN,
        quantities={} if judged is None else {"rmse": _rmse(judged)},
        arrays=_course_arrays(course) | ({} if judged is None else _clip_arrays(judged)),
        document=_document(card, artifact),
        head=Head(figures=figures, facts=_facts(card)),
        make_sections=lambda: [*_sections(recipe, course, judged, pairs)],
        provenance=provenance,
    )


def _document(card: Mapping[str, Any], artifact: Artifact | None) -> dict[str, Any]:
    names = ("name", "title", "seed", "parameters", "epochs", "best", "seconds", "data")
    return {
        "artifact": None if artifact is None else artifact.id,
        "object": None if artifact is None else artifact.object,
        **{name: card[name] for name in (*names, "recipe_hash", "code_version")},
    }


def _rmse(judged: JudgedClips) -> Quantity:
    """Returns the error of the clips that chose the epoch, which say nothing about others: it has
    no interval."""
    span = Span(low=-math.inf, high=math.inf, level=_LEVEL, bound=Bound.NOTHING, estimated=False)
    return Quantity(name="rmse", unit=judged.target.unit, value=judged.error, sigma=None, span=span)


def _course_arrays(course: LossCourse) -> dict[str, Array]:
    """Returns the curves over the epochs."""
    columns = {
        "training_loss": ("1", "mean loss of the clips that are learned", "train"),
        "validation_loss": ("1", "mean loss of the clips that validate", "validation"),
        "learning_rate": ("1", "at the epoch's end", "rate"),
        "seconds": ("s", "that the epoch took", "seconds"),
    }
    numbers = np.array([epoch.number + 1 for epoch in course.epochs], dtype=np.int64)
    return {
        "epoch": Array(dimensions=("epoch",), values=numbers, about="from 1", coordinate=True),
        **{
            name: Array(
                dimensions=("epoch",),
                values=np.array([getattr(epoch, key) for epoch in course.epochs]),
                unit=unit,
                about=about,
            )
            for name, (unit, about, key) in columns.items()
        },
    }


def _clip_arrays(judged: JudgedClips) -> dict[str, Array]:
    """Returns truth and estimate over the clips that validate."""
    columns = {"true": judged.truth, "estimated": judged.estimate}
    if len(judged.low):
        columns |= {"estimated_low": judged.low, "estimated_high": judged.high}
    about = f"{judged.target.about} of clips that validate"
    return {
        name: Array(dimensions=("clip",), values=values, unit=judged.target.unit, about=about)
        for name, values in columns.items()
    }


def _sentence(recipe: TrainingRecipe, course: LossCourse, judged: JudgedClips | None) -> str:
    best = course.best
    if best is None:
        return f"{recipe.name} has not learned for an epoch"
    when = f"epoch {best.number + 1} of {len(course.epochs)} was the best"
    if judged is None:
        return f"{recipe.name} is trained; {when}, with a validation loss of {best.validation:.3g}"
    unit = "" if judged.target.unit == "1" else f" {judged.target.unit}"
    return (
        f"{recipe.name} misses the {judged.target.about} of clips that validate by "
        f"{judged.error:.3g}{unit} in the root mean square; {when}"
    )


def _facts(card: Mapping[str, Any]) -> dict[str, str]:
    return {
        "parameters": f"{card['parameters']:,}",
        "epochs": str(card["epochs"]),
        "took": f"{card['seconds']:,.0f} s",
    }


def _scatter(judged: JudgedClips) -> Chart:
    ends = [float(judged.truth.min()), float(judged.truth.max())]
    unit = judged.target.unit
    return Chart(
        rows=[
            [
                Panel(
                    marks=[
                        Line(x=ends, y=ends, colour=Colour.QUIET, dashed=True, width=0.9),
                        Dots(
                            x=judged.truth,
                            y=judged.estimate,
                            low=judged.low,
                            high=judged.high,
                            label="mean, and the 90 % interval" if len(judged.low) else "",
                            size=3.0,
                        ),
                    ],
                    x=Axis(label=f"true {judged.target.about} [{unit}]"),
                    y=Axis(label=f"estimated [{unit}]"),
                )
            ]
        ],
        height=4.1,
        width=5.6,
    )


def _sections(
    recipe: TrainingRecipe, course: LossCourse, judged: JudgedClips | None, pairs: Pairs
) -> Iterator[Section]:
    if judged is not None:
        clips = Gallery(figures=[_clip(recipe, judged, pairs, i) for i in judged.sample(_SHOWN)])
        yield Section(title="Clips, with truth and estimate", parts=[clips], anchor="clips")
    rows: Sequence[Sequence[str]] = [
        (
            str(epoch.number + 1),
            f"{epoch.train:.4f}",
            f"{epoch.validation:.4f}",
            f"{epoch.rate:.2g}",
            f"{epoch.seconds:.0f}",
        )
        for epoch in course.epochs
    ]
    columns = ("epoch", "training loss", "validation loss", "learning rate", "took [s]")
    yield Section(
        title="Epoch by epoch",
        parts=[Table(columns=columns, rows=rows)],
        anchor="epochs",
        folded=True,
    )


def _clip(recipe: TrainingRecipe, judged: JudgedClips, pairs: Pairs, number: int) -> Figure:
    digits, unit = judged.target.digits, judged.target.unit
    ends = (
        f" [{judged.low[number]:.{digits}f}, {judged.high[number]:.{digits}f}]"
        if len(judged.low)
        else ""
    )
    frames = clip_as_taken(pairs, int(judged.rows[number]), recipe.front_end)
    return Figure(
        title="clip",
        content=moving(frames, rate=recipe.front_end.rate, side=_SIDE),
        caption=f"true {judged.truth[number]:.{digits}f} {unit}, estimated "
        f"{judged.estimate[number]:.{digits}f}{ends} {unit}",
        width=_SIDE,
    )
