"""What `flagdata measure --refine N` calls: clips in, a refinement and its section of the report out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flagdata.console import progress
from flagdata.lake import Artifact
from measure.refine.procedure import Settings, refine
from measure.refine.refinement import Refinement
from measure.refine.space import Space
from measure.refine.target import Target, of_recording
from measure.refine.view import DrawnView, View
from models.estimator import Estimator
from sim.assets import Assets
from sim.render.prior import named
from sim.run import load

SCENE = "flag-wide"
"""Recipe whose ranges are the prior: that of the data set on which models are trained."""
RENDERS = "flags"
"""Prior of ζ, where a target's own is not known."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Clip:
    """A clip to refine.

    Attributes:
        name: for people.
        frames: (frame, height, width) uint8 gray, as many and as fast as the model takes, of the region with the flag,
            at instants that make the flag look like one of 1.5 m (see `measure.estimate`).
        recording: its row in the lake, where it has one: a simulated recording states its own ζ.
    """

    name: str
    frames: NDArray[np.uint8]
    recording: Artifact | None = None


def run(
    clips: Sequence[Clip], estimator: Estimator, *, budget: int, seed: int, level: float, cache: Path | None = None,
    view: View | None = None,
) -> Refinement:  # fmt: skip
    """Refine clips of one flag, with a progress bar.

    Args:
        budget: simulated clips for each.
        cache: folder for evaluations, so that an interrupted run goes on.
        view: how all were filmed, where that is known; None takes what their recordings state, and otherwise draws ζ
            anew for each simulated clip.

    Raises:
        InputError: see `measure.refine.procedure.refine`.
    """
    recipe = load(SCENE)
    space = Space.of(recipe)
    otherwise = view or DrawnView(prior=named(RENDERS), assets=Assets())
    targets = [
        Target(name=clip.name, clip=clip.frames, view=otherwise)
        if view is not None or clip.recording is None
        else of_recording(clip.recording, clip.frames, otherwise=otherwise, space=space)
        for clip in clips
    ]
    settings = Settings(budget=budget, seed=seed, level=level)
    with progress(budget * len(targets), label="refining", unit="clip") as advance:
        return refine(targets, estimator, recipe, settings=settings, cache=cache, advance=advance)
