"""A pole that is not vertical."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import torch
from torch import Tensor

from flagdata.errors import UsageError
from sim.cloth.state import State
from sim.cloth.system import InapplicableError, System
from sim.effects.cloth_geometry import horizontal, left_of, norm
from sim.effects.effect import Effect
from sim.effects.parameter import Value, strength
from sim.effects.weighing import Copied, Need


@dataclass(frozen=True, kw_only=True)
class TiltedPole(Effect):
    """Attachments and start are turned rigidly about the lowest attachment, by the rotation vector
    ω = lean (z × f) − sway f, with f the horizontal direction from the attachments to the middle of
    the cloth.

    Attributes:
        lean: top toward the fly.
        sway: top toward z × f, to the left of who looks along the flag.
    """

    needs: ClassVar[Mapping[Need, str]] = {Need.STILL: "carried attachments go their own ways"}
    copied: ClassVar[Copied | None] = Copied(
        by="the directions of wind and gravity",
        shown_by=Need.ANCHORS,
        how="a plumb line beside the pole",
    )
    lean: Annotated[
        Value,
        strength(
            unit="rad",
            prior=(-0.5, 0.9),
            weighed=(-0.4, 0.6),
            step=0.02,
            admissible=(-math.pi / 2, math.pi / 2),
            source="vertical poles within 2°; wall-mounted poles lean by 30–45°",
        ),
    ] = 0.0
    sway: Annotated[
        Value,
        strength(
            unit="rad",
            prior=(-0.1, 0.1),
            weighed=(-0.25, 0.25),
            step=0.02,
            admissible=(-math.pi / 2, math.pi / 2),
            source="poles set by eye: within 2–5°; tall ones bend in the wind",
        ),
    ] = 0.0

    def apply(self, system: System, state: State) -> tuple[System, State]:
        if not len(system.held):
            raise UsageError("nothing holds the cloth", where="tilted pole", fix="give handles")
        if system.motion is not None:
            raise InapplicableError(
                "a pole cannot tilt where attachments are carried",
                where="tilted pole",
                fix="leave it out: their ways are those that are given",
            )
        fly = horizontal(state.position.mean(0) - system.anchors.mean(0), axis=0)
        length = norm(fly, axis=0)
        if bool((length == 0).any()):
            raise UsageError(
                "the cloth hangs straight below its attachments: it has no fly to lean to",
                where="tilted pole",
                fix="start with the flag out to one side",
            )
        fly = fly / length
        turn = self.lean * left_of(fly, axis=0) - self.sway * fly
        lowest = system.anchors[:, 2].argmin(0)
        pivot = system.anchors.gather(0, lowest.expand(1, 3, -1))
        system = replace(system, anchors=system.anchors + change(turn, system.anchors - pivot))
        return system, replace(
            state,
            position=state.position + change(turn, state.position - pivot),
            velocity=state.velocity + change(turn, state.velocity),
        )


def change(turn: Tensor, vectors: Tensor) -> Tensor:
    """Applies R − I to vectors (n, 3, batch), for the rotation vector (3, batch); exactly 0 for
    none.

    Rodrigues: R − I = sin α/α [ω]× + (1 − cos α)/α² [ω]×², without the division.
    """
    angle = norm(turn, axis=0) / torch.pi
    axis = turn.expand_as(vectors)
    once = torch.linalg.cross(axis, vectors, dim=1)
    return torch.sinc(angle) * once + torch.sinc(angle / 2) ** 2 / 2 * torch.linalg.cross(
        axis, once, dim=1
    )
