"""What is measured: a clip as the network takes it, and how it was filmed, as far as that is
known."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from flagdata.core.arrays import UInt8Array
from flagdata.errors import InputError
from flagdata.lake import Artifact
from flagdata.recipes.retired_names import present_names
from measure.refine.space import BENDING, QUANTITIES, Space
from measure.refine.target_view import FixedView, View, of_parameters


@dataclass(frozen=True, kw_only=True, eq=False)
class Target:
    """A clip of a flag of 1.5 m at 25 Hz, or one resampled to look like it (dynamic similarity).

    Attributes:
        name: for tables and pictures.
        clip: (frame, height, width) uint8 gray, conditioned (`models.conditioning`), as the
            simulated clips are that it is compared with.
        view: how simulated flags are filmed to be compared with it.
        truth: name → its known values, SI; for the trace's dashed line and for scores.
    """

    name: str
    clip: UInt8Array
    view: View
    truth: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.clip.ndim != 3 or self.clip.dtype != np.uint8:
            raise InputError(
                f"the clip has the shape {self.clip.shape} and type {self.clip.dtype}",
                where=f"target {self.name!r}",
                fix="give uint8 of shape (frame, height, width)",
            )


def of_recording(recording: Artifact, clip: UInt8Array, *, otherwise: View, space: Space) -> Target:
    """Makes a target of a recording in the lake: ζ and truth are what its row states, if it is
    simulated.

    Args:
        clip: (frame, height, width) of it, conditioned.
        otherwise: the view of a recording that states no ζ.
    """
    content = present_names(json.loads(recording.parameters)) if recording.parameters else {}
    return as_stated(recording.name, clip, content, otherwise=otherwise, space=space)


def as_stated(
    name: str, clip: UInt8Array, parameters: Mapping[str, Any], *, otherwise: View, space: Space
) -> Target:
    """Makes a target of which `parameters` state what recordings of simulated flags state, or
    nothing.

    Args:
        clip: (frame, height, width), conditioned.
        parameters: name → value [SI], ζ and the camera among them if it is simulated.
        otherwise: the view of one that states no ζ.
    """
    stated_view = of_parameters(parameters, where=f"target {name!r}") if parameters else None
    return Target(
        name=name, clip=clip, view=stated_view or otherwise, truth=_truth(parameters, space)
    )


def knows_view(target: Target) -> bool:
    """Returns whether ζ and the camera are given, and not drawn."""
    return isinstance(target.view, FixedView)


def _truth(content: Mapping[str, Any], space: Space) -> dict[str, float]:
    names = [*(f"bending.{index}" for index in range(BENDING)), "area_weight", "wind_speed"]
    if any(name not in content for name in names):
        return {
            name: float(content[name]) for name in ("area_weight", "wind_speed") if name in content
        }
    point = space.unit(np.array([[float(content[name]) for name in names]]))
    truth = dict(
        zip((q.name for q in QUANTITIES), space.reported_quantities(point)[0].tolist(), strict=True)
    )
    return {
        **truth,
        "area_weight": float(content["area_weight"]),
        "wind_speed": float(content["wind_speed"]),
    }
