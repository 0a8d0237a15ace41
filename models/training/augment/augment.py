"""Which disturbances a training draws, how strong they are, and the named streams that they are
drawn from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from flagdata.core.arrays import Float32Array, FloatArray, UInt8Array
from flagdata.core.rng import stream
from flagdata.errors import InputError, UnknownNameError
from flagdata.recipes.registry import Registry

Film = UInt8Array
"""(n, height, width) gray."""

BEFORE = Registry(
    "disturbance",
    {
        "tree": "models.training.augment.rim:TREE",
        "second-flag": "models.training.augment.rim:SECOND_FLAG",
        "shake": "models.training.augment.residual_motion:SHAKE",
        "blur": "models.training.augment.light_and_lens:BLUR",
        "gamma": "models.training.augment.light_and_lens:GAMMA",
        "dusk": "models.training.augment.light_and_lens:DUSK",
        "noise": "models.training.augment.light_and_lens:NOISE",
        "coding": "models.training.augment.coding:CODING",
    },
)
"""Of films as they were taken, in the order in which they happen: scene, camera, light, file."""
AFTER = Registry(
    "disturbance",
    {
        "left-over-shake": "models.training.augment.residual_motion:LEFT_OVER_SHAKE",
        "pole-sway": "models.training.augment.residual_motion:POLE_SWAY",
    },
)
"""Of conditioned clips."""
DISTURBANCES = (*BEFORE, *AFTER)
"""Names of all."""


@dataclass(frozen=True, kw_only=True)
class Disturbance:
    """One disturbance.

    Attributes:
        apply: makes it of what `Drawn` says.
        unit: of its strength.
        least, most: strengths that make sense at all.
    """

    apply: Callable[[Drawn], Film]
    unit: str
    least: float = 0.0
    most: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Drawn:
    """What a disturbance is made of.

    Attributes:
        film: what it happens to.
        times: (n,) of its frames [s].
        strength: in the disturbance's unit.
        rng: of all else that it draws.
        other: gives another film of the training side, (n', height', width'), at its own rate.
        weight: (height, width) float32 1 on the cloth of a conditioned clip, 0 where it is frozen;
            1 everywhere before.
    """

    film: Film
    times: FloatArray
    strength: float
    rng: np.random.Generator
    other: Callable[[], Film]
    weight: Float32Array


@dataclass(frozen=True, kw_only=True)
class Strength:
    """How often a disturbance happens and how strongly: uniform from `low` to `high` in its unit.

    Attributes:
        share: of the films or clips, 0 to 1.
    """

    share: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True)
class Augment:
    """The disturbances of a training.

    Attributes:
        strengths: name of `DISTURBANCES` → how often and how strongly.

    Raises:
        UnknownNameError: a name that is none.
        InputError: a share outside of 0 to 1, or strengths that are not in order or beyond what
            makes sense.
    """

    strengths: Mapping[str, Strength] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, strength in self.strengths.items():
            limits: Disturbance = _disturbance(name)
            ordered = limits.least <= strength.low <= strength.high <= limits.most
            if not (0 <= strength.share <= 1 and ordered):
                raise InputError(
                    f"{name} of a share of {strength.share:g} of the films, {strength.low:g} to "
                    f"{strength.high:g} "
                    f"{limits.unit}",
                    where="[input] [augment]",
                    fix=f"give a share of 0 to 1, and low ≤ high from {limits.least:g} to "
                    f"{limits.most:g}",
                )

    def identity(self) -> dict[str, Any]:
        """As JSON."""
        return {name: vars(strength).copy() for name, strength in sorted(self.strengths.items())}

    def happens(self, name: str, *source: str | int) -> bool:
        """Decides whether a disturbance happens to a film, or to a variant of it."""
        strength = self.strengths.get(name)
        return strength is not None and self._stream(name, source).random() < strength.share

    def before(
        self, film: Film, times: FloatArray, *, source: str, other_film: Callable[[], Film]
    ) -> Film:
        """Disturbs a film as it was taken.

        Args:
            source: the recording, after which its streams are named.
            other_film: see `Drawn`.
        """
        everywhere = np.ones(film.shape[1:], dtype=np.float32)
        return self._apply_disturbances(BEFORE, film, times, (source,), other_film, everywhere)

    def after(
        self, clip: Film, times: FloatArray, *, source: str, variant: int, weight: Float32Array
    ) -> Film:
        """Disturbs a conditioned clip by what conditioning leaves."""

        def none() -> Film:
            raise TypeError("what happens after conditioning takes no other film")

        return self._apply_disturbances(AFTER, clip, times, (source, variant), none, weight)

    def _apply_disturbances(
        self,
        disturbances: Registry,
        film: Film,
        times: FloatArray,
        source: tuple[str | int, ...],
        other_film: Callable[[], Film],
        weight: Float32Array,
    ) -> Film:
        for name in disturbances:
            if self.happens(name, *source):
                rng, strength = self._stream(name, (*source, "drawn")), self.strengths[name]
                drawn = Drawn(
                    film=film,
                    times=times,
                    strength=rng.uniform(strength.low, strength.high),
                    rng=rng,
                    other=other_film,
                    weight=weight,
                )
                film = disturbances[name].apply(drawn)
        return film

    @staticmethod
    def _stream(name: str, source: tuple[str | int, ...]) -> np.random.Generator:
        return stream(0, "augment", name, *source)


def _disturbance(name: str) -> Disturbance:
    if name not in DISTURBANCES:
        raise UnknownNameError.of("disturbance", name, DISTURBANCES)
    return BEFORE[name] if name in BEFORE else AFTER[name]
