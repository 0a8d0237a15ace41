"""How simulated cloth is filmed: by the ζ and the camera of the target, where they are known, or by
draws of a prior.

The paper renders with one fixed ζ and trusts the network to see past it. Where the target's own ζ
is known the comparison is free of it; where it is not, ζ is drawn anew for each clip, so that what
the network does not see past becomes a part of the replicates' covariance in place of a bias.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Protocol

import numpy as np

from flagdata.core.arrays import UInt8Array
from flagdata.core.json_values import json_values
from flagdata.core.provenance import canonical, digest
from flagdata.core.rng import child_seed, stream
from flagdata.errors import InputError
from flagdata.recipes.typed_tables import Range
from flagdata.record.video_archive import decode
from flagdata.record.writer import Coding
from sim.assets import Assets
from sim.datasets import camera_picture
from sim.datasets.dataset_recipe import CameraSpec
from sim.render import RenderParameters
from sim.render.render_prior import RenderPrior

_NAMED = "render."


@dataclass(frozen=True, kw_only=True)
class FilmCamera:
    """The camera behind the picture: noise, then H.264.

    Attributes:
        rate_factor: x264's constant rate factor.
        read_noise, shot_noise: as of `sim.datasets.dataset_recipe.CameraSpec`, in 8-bit steps.
    """

    rate_factor: float = 21.0
    read_noise: float = 0.9
    shot_noise: float = 1.75

    def filmed(self, frames: UInt8Array, *, seed: int) -> UInt8Array:
        """Converts colours (n, height, width, 3) to gray frames (n, height, width) as they come
        back from the camera's file."""
        spec = CameraSpec(
            coding=Coding.H264,
            jpeg_quality=90.0,
            rate_factor=self.rate_factor,
            read_noise=self.read_noise,
            shot_noise=self.shot_noise,
            frame_slot=1,
        )
        coded = camera_picture.encode_pictures(
            frames, camera_picture.settings(spec, seed=seed), spec, seed=seed
        )
        return np.stack(decode(coded, where="a simulated film"))


RANGES = {
    "rate_factor": Range(low=18.0, high=24.0),
    "read_noise": Range(low=0.3, high=1.5),
    "shot_noise": Range(low=0.5, high=3.0),
}
"""What an unknown camera is drawn from: as the data set `flagsim-wide`, on which models are
trained."""


class View(Protocol):
    """Says by what ζ and camera a clip is filmed."""

    def at(self, seed: int) -> tuple[RenderParameters, FilmCamera]:
        """Returns ζ and the camera of the clip with this seed."""
        ...

    @property
    def identity(self) -> str:
        """A hash of all of it."""
        ...


@dataclass(frozen=True, kw_only=True)
class FixedView:
    """One ζ and camera for all clips, as the paper has it."""

    zeta: RenderParameters
    camera: FilmCamera

    def at(self, seed: int) -> tuple[RenderParameters, FilmCamera]:
        """Returns the same for every clip."""
        del seed
        return self.zeta, self.camera

    @property
    def identity(self) -> str:
        return digest(
            canonical({"zeta": json_values(self.zeta), "camera": vars(self.camera).copy()})
        )


@dataclass(frozen=True, kw_only=True)
class DrawnView:
    """ζ of a prior and cameras of `RANGES`, drawn anew for each clip."""

    prior: RenderPrior
    assets: Assets

    def at(self, seed: int) -> tuple[RenderParameters, FilmCamera]:
        drawn = {
            name: entry.at(stream(seed, "camera", name).random()) for name, entry in RANGES.items()
        }
        return self.prior.draw(child_seed(seed, "zeta"), self.assets), FilmCamera(**drawn)

    @property
    def identity(self) -> str:
        return digest(
            canonical(
                {
                    "prior": self.prior.identity(),
                    "camera": json_values(RANGES),
                }
            )
        )


def of_parameters(parameters: str | Mapping[str, Any], *, where: str) -> FixedView | None:
    """Reads the view that a simulated recording states in its parameters; None where it states
    none.

    Args:
        parameters: of the catalog's row, JSON or decoded.

    Raises:
        InputError: a ζ that this version cannot read.
    """
    content = json.loads(parameters) if isinstance(parameters, str) else parameters
    entries = {
        key.removeprefix(_NAMED): value for key, value in content.items() if key.startswith(_NAMED)
    }
    if "texture" not in entries or "background" not in entries:
        return None
    names = {entry.name for entry in fields(RenderParameters)}
    if unknown := sorted(set(entries) - names):
        raise InputError(
            f"render parameters {', '.join(unknown)} are not known",
            where=where,
            fix="update flagdata",
        )
    values = {
        name: round(value) if isinstance(getattr(RenderParameters, name, None), int) else value
        for name, value in entries.items()
    }
    camera = {
        name: float(content[f"camera.{name}"]) for name in RANGES if f"camera.{name}" in content
    }
    return FixedView(zeta=RenderParameters(**values), camera=FilmCamera(**camera))
