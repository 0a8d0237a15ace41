"""Turbulence: gusts with the von Kármán spectrum, drawn beforehand."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Annotated, ClassVar, Self

import numpy as np
import torch
from torch import Tensor

from sim.effects.cloth_geometry import disturbed_wind
from sim.effects.effect import WindEffect
from sim.effects.parameter import NOT_NEGATIVE, Value, shape, strength
from sim.wind import sampled
from sim.wind.spectral_wind import VonKarman


@dataclass(frozen=True, kw_only=True)
class Gusts(WindEffect):
    """The wind u becomes u + I (g₁ u_h + r₂ g₂ z × u_h + r₃ g₃ |u_h| z), u_h its horizontal part.

    Attributes:
        intensity: I, the standard deviation along the wind over the mean speed.
        lateral: r₂, the standard deviation across the wind over that along it.
        vertical: r₃, the vertical one over that along the wind.
        times: (n,) of the samples [s].
        samples: (n, 3, batch or 1) g, of mean 0 and variance 1 in the ensemble.
    """

    unweighed: ClassVar[str] = "the course of the wind is tested by itself"
    effect_class: ClassVar[str] = "turbulence"
    intensity: Annotated[
        Value,
        strength(
            unit="1",
            prior=(0.0, 0.43),
            admissible=NOT_NEGATIVE,
            source="EN 1991-1-4 at 10 m: 1/ln(10 m/z₀) is 0.12 at sea, 0.19 in open land, 0.43 in "
            "towns",
        ),
    ] = 0.0
    lateral: Annotated[
        Value,
        shape(
            unit="1",
            prior=(0.6, 1.0),
            admissible=NOT_NEGATIVE,
            source="0.75–0.8 near the ground (ESDU 85020)",
        ),
    ] = 0.78
    vertical: Annotated[
        Value,
        shape(
            unit="1",
            prior=(0.3, 0.7),
            admissible=NOT_NEGATIVE,
            source="0.5–0.55 near the ground (ESDU 85020)",
        ),
    ] = 0.52
    times: tuple[float, ...] = (0.0, 1e9)
    samples: Tensor = field(default_factory=lambda: torch.zeros(2, 3, 1))

    def __post_init__(self) -> None:
        super().__post_init__()
        sampled.check(self.times, self.samples, where="gusts")

    def velocity(self, time: float, wind: Tensor) -> Tensor:
        now = sampled.place(self.times, time, sampled.Beyond.REFUSE, where="gusts")
        along, leftward, up = sampled.between(self.samples, *now)
        relative = [
            self.intensity * along,
            self.intensity * self.lateral * leftward,
            self.intensity * self.vertical * up,
        ]
        return disturbed_wind(wind, torch.stack(torch.broadcast_tensors(*relative)))

    def with_series(
        self,
        rng: np.random.Generator,
        *,
        batch: int,
        speed: float,
        length: float = 60.0,
        duration: float = 60.0,
        rate: float = 10.0,
    ) -> Self:
        """Draws a realisation of these gusts for each member.

        The transverse parts take the same spectrum with half the length scale, as in isotropic
        turbulence.

        Args:
            rng: a named stream.
            batch: number of members.
            speed: mean wind that carries the eddies past [m/s].
            length: longitudinal integral length scale [m].
            duration: of the series [s].
            rate: samples a second; the run is linear between them.
        """
        series = []
        for scale in (length, length / 2, length / 2):
            spectrum = VonKarman(mean=speed, intensity=0.1, length=scale)
            count = round(duration * rate) + 1
            draws = [spectrum.series(rng, duration=count / rate, rate=rate) for _ in range(batch)]
            series.append((np.stack(draws, axis=-1) - speed) / spectrum.sigma)
        samples = torch.from_numpy(np.stack(series, axis=1))
        return replace(self, samples=samples, times=tuple(np.arange(len(samples)) / rate))

    @classmethod
    def drawn(cls, rng: np.random.Generator, *, batch: int) -> Self:
        """As for all effects, with two minutes of gusts for each member in a mean wind of 5 m/s."""
        return (
            super().drawn(rng, batch=batch).with_series(rng, batch=batch, speed=5.0, duration=120.0)
        )
