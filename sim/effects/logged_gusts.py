"""Gusts as an anemometer logged them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Self

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor

from flagdata.record.signals import WindSeries
from sim.effects.cloth_geometry import disturbed_wind
from sim.effects.effect import WindEffect
from sim.effects.parameter import Value, strength
from sim.wind import sampled


@dataclass(frozen=True, kw_only=True)
class LoggedGusts(WindEffect):
    """The wind u becomes u + q (R(φ) s/⟨s⟩ − 1) u_h: speed s and turn φ as logged, relative to
    their means.

    Attributes:
        share: q; 1 to follow the log, 0 for its mean.
        times: (n,) of the samples since the start of the run [s].
        samples: (n, 3, batch or 1) the log's relative deviations along the mean wind, to its left,
            and up.
    """

    unweighed: ClassVar[str] = "a log that resolves gusts is the base model's wind"
    effect_class: ClassVar[str] = "turbulence"
    share: Annotated[
        Value,
        strength(
            unit="1",
            prior=(0.5, 1.2),
            source="1 at the anemometer; less where it is farther from the flag than the eddies "
            "are long",
        ),
    ] = 0.0
    times: tuple[float, ...] = (0.0, 1e9)
    samples: Tensor = field(default_factory=lambda: torch.zeros(2, 3, 1))

    def __post_init__(self) -> None:
        super().__post_init__()
        sampled.check(self.times, self.samples, where="logged gusts")

    def velocity(self, time: float, wind: Tensor) -> Tensor:
        now = sampled.place(self.times, time, sampled.Beyond.REFUSE, where="logged gusts")
        return disturbed_wind(wind, self.share * sampled.between(self.samples, *now))

    @classmethod
    def of(
        cls,
        time: ArrayLike,
        speed: ArrayLike,
        *,
        direction: ArrayLike | None = None,
        share: Value = 1.0,
    ) -> Self:
        """Makes gusts from samples of a log.

        Args:
            time: (n,) since the start of the run [s].
            speed: (n,) [m/s].
            direction: (n,) blowing from, clockwise from north [rad]; none to leave the direction
                constant.
            share: q.

        Raises:
            InputError: gaps of more than 5 s, a mean speed of 0, or shapes that do not fit.
        """
        times, _, relative = sampled.about_mean(time, speed, direction, where="logged gusts")
        samples = np.stack([np.real(relative), np.imag(relative), np.zeros_like(times)], axis=1)[
            ..., None
        ]
        return cls(share=share, times=tuple(times.tolist()), samples=torch.from_numpy(samples))

    @classmethod
    def from_log(cls, series: WindSeries, *, start: int, share: Value = 1.0) -> Self:
        """Makes gusts from the usable samples of a log, with its direction where it has one.

        Args:
            series: with the channel wind_speed.
            start: of the run on the log's clock [UTC ns]. The log must begin no later.

        Raises:
            InputError: no wind speed, or as for `of`.
        """
        time, speed, direction = sampled.usable(series, start=start, where="logged gusts")
        return cls.of(time, speed, direction=direction, share=share)

    @classmethod
    def drawn(cls, rng: np.random.Generator, *, batch: int) -> Self:
        """As for all effects, with an hour of sway in place of a log: ± 30 % in speed, ± 0.3 rad in
        direction."""
        time = np.arange(0.0, 3600.0, 0.5)
        speed, direction = 5 + 1.5 * np.sin(0.7 * time), 0.3 * np.sin(0.4 * time)
        values = cls.parameters()["share"].prior
        return cls.of(
            time,
            speed,
            direction=direction,
            share=torch.from_numpy(rng.uniform(*values, size=batch)),
        )
