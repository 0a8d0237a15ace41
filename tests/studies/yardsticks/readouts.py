"""What embeddings are worth beside the table: triplets of clips of other lengths, and what a linear
model reads."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from flagdata.errors import InputError
from models.evaluation import Predictions, Resamples, estimate, triplets
from models.evaluation.bootstrap import ScoreEstimate
from models.evaluation.curves import check_point
from models.evaluation.predict import embed_entries
from models.maps.crops import Cropping
from models.maps.frontend import FrontEnd
from models.networks.targets import truth
from models.trained.estimator import Estimator
from models.training import Prepared
from tests.studies.yardsticks.linear import Readout, bouman

Films = Callable[[FrontEnd, Cropping], Prepared]
"""A front end and how films are cut → one clip of each film of the side that is judged."""


@dataclass(frozen=True, kw_only=True)
class FramesPoint:
    """Triplet accuracy of a model that sees so many frames."""

    JSON_NAMES: ClassVar = ("label", "frames", "accuracy=score.value", "interval=score.interval")

    label: str
    frames: int
    score: ScoreEstimate

    def __post_init__(self) -> None:
        where = f"triplet accuracy of {self.label!r} against frames"
        check_point(where, self.frames, "frames", self.score)
        if self.score.value > 1:
            raise InputError(
                f"the triplet accuracy is {self.score.value:g}, above 1",
                where=where,
                fix="give a share, not per cent",
            )


@dataclass(frozen=True, kw_only=True)
class Read:
    """The linear readout of a model's embedding on some data set."""

    JSON_NAMES: ClassVar = ("label", "data", "components=readout.components", "pearson")

    label: str
    data: str
    readout: Readout

    @property
    def pearson(self) -> dict[str, ScoreEstimate]:
        """Returns Pearson's r of each target."""
        return dict(zip(self.readout.targets, self.readout.pearson, strict=True))


def triplet_accuracies(
    runs: Sequence[Estimator], frames: Sequence[int], films: Films, *, seed: int
) -> list[FramesPoint]:
    """Computes the triplet accuracy of one network's embedding, given so many frames of each film
    from a random one on.

    A network on maps takes clips of any length, as the maps' size does not depend on it. It is not
    trained anew: the result shows what its distance is worth on clips shorter or longer than the
    training clips.

    Args:
        runs: networks of one recipe from several seeds; the mean over them is reported.
        frames: lengths of the clips.

    Raises:
        InputError: a film that is shorter, a length that the front end does not take, or clips
            without a triplet.
    """
    points, first = [], runs[0]
    for count in frames:
        cropping = replace(first.cropping, frames=count, scales=(1.0,), mirror=False)
        clips = films(replace(first.front_end, frames=count), cropping)
        resamples = Resamples.of(clips.sequence, generator=stream(seed, "evaluation", "bootstrap"))
        chosen = triplets.draw(clips.sequence, seed=seed)
        values = [
            triplets.accuracy_values(embed_entries(run.learners[0], clips), chosen, resamples)
            for run in runs
        ]
        accuracy = estimate(
            np.mean(values, axis=0), name="triplets", clips=len(clips), groups=resamples.groups
        )
        points.append(FramesPoint(label=first.name, frames=count, score=accuracy))
    return points


def takes_any_length(estimator: Estimator) -> bool:
    """Returns whether a network can be given clips of other lengths than those it learned from, and
    has an embedding."""
    return estimator.front_end.maps in ("spectral-maps", "wave-maps", "flow-maps", "flow-maps-3")


def quantities(parameters: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Returns what is read out of embeddings, of clips with these parameters: name → (n,).

    Raises:
        InputError: no clip states it.
    """
    area_weight, bending = truth(parameters, ("area_weight", "bending_scale")).T
    return {"area_weight": area_weight, "stiffness": 10**bending}


def readouts(
    predictions: Sequence[Predictions],
    parameters: Mapping[str, FloatArray],
    *,
    data: str,
    seed: int,
) -> list[Read]:
    """Follows the protocol of Bouman et al. 2013 on the embedding of each model's first run, one
    simulation left out at a time.

    Read out are the logarithms of the area weight [kg/m²] and of the stiffness, the geometric mean
    of the 15 bending coefficients [N·m].

    Args:
        parameters: name → (n,) values of the clips, as their records state them.

    Raises:
        InputError: too few clips, or a quantity that they do not state or that is the same in all
            of them.
    """
    wanted = quantities(parameters)
    reads: dict[str, Read] = {}
    for run in predictions:
        if run.embedding is not None and run.label not in reads:
            generator = stream(seed, "evaluation", "readout", run.label)
            readout = bouman(run.embedding, wanted, group=run.group, generator=generator)
            reads[run.label] = Read(label=run.label, data=data, readout=readout)
    return list(reads.values())
