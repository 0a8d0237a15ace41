"""Gusts as an anemometer logged them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Self

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor

from flagdata.errors import InputError
from flagdata.schema import UNUSABLE
from flagdata.signals import WindSeries
from flagdata.timebase import NANOSECONDS
from sim.effects import history
from sim.effects.effect import WindEffect
from sim.effects.parameter import Value, strength

# Longer gaps in a log are not bridged: large eddies last a few seconds.
_LONGEST_GAP = 5.0


@dataclass(frozen=True, kw_only=True)
class LoggedGusts(WindEffect):
    """The wind u becomes u + q (R(φ) s/⟨s⟩ − 1) u_h: speed s and turn φ as logged, relative to their means.

    Attributes:
        share: q; 1 to follow the log, 0 for its mean.
        times: (n,) of the samples since the start of the run [s].
        samples: (3, n, batch or 1) the log's relative deviations along the mean wind, to its left, and up.
    """

    share: Annotated[
        Value,
        strength(
            unit="1",
            prior=(0.5, 1.2),
            source="1 at the anemometer; less where it is farther from the flag than the eddies are long",
        ),
    ] = 0.0
    times: tuple[float, ...] = (0.0, 1e9)
    samples: Tensor = field(default_factory=lambda: torch.zeros(3, 2, 1))

    def __post_init__(self) -> None:
        super().__post_init__()
        history.check(self.times, self.samples, where="logged gusts")

    def velocity(self, time: float, wind: Tensor) -> Tensor:
        return history.disturbed(wind, self.share * history.at(self.times, self.samples, time, where="logged gusts"))

    @classmethod
    def of(cls, time: ArrayLike, speed: ArrayLike, *, direction: ArrayLike | None = None, share: Value = 1.0) -> Self:
        """From samples of a log.

        Args:
            time: (n,) since the start of the run [s].
            speed: (n,) [m/s].
            direction: (n,) blowing from, clockwise from north [rad]; none to leave the direction constant.
            share: q.

        Raises:
            InputError: gaps of more than 5 s, a mean speed of 0, or shapes that do not fit.
        """
        t, s = np.asarray(time, dtype=np.float64), np.asarray(speed, dtype=np.float64)
        from_north = np.zeros_like(s) if direction is None else np.asarray(direction, dtype=np.float64)
        if not (t.ndim == 1 and t.shape == s.shape == from_north.shape and len(t) > 1):
            raise InputError(
                f"shapes {t.shape}, {s.shape}, {from_north.shape}", where="logged gusts", fix="give (n,) each, n > 1"
            )
        widest = float(np.max(np.diff(t)))
        if widest > _LONGEST_GAP:
            raise InputError(
                f"the log has a gap of {widest:.1f} s",
                where="logged gusts",
                fix=f"choose a stretch without gaps of more than {_LONGEST_GAP:g} s",
            )
        mean = complex(np.mean(s * np.exp(1j * from_north)))
        if not abs(mean) > 0:
            raise InputError("the mean wind is zero", where="logged gusts", fix="choose a stretch with wind")
        # Clockwise from above is a turn to the right: the conjugate.
        relative = np.conj(s * np.exp(1j * from_north) / mean) - 1
        samples = np.stack([np.real(relative), np.imag(relative), np.zeros_like(s)])[..., None]
        return cls(share=share, times=tuple(t.tolist()), samples=torch.from_numpy(samples))

    @classmethod
    def from_log(cls, series: WindSeries, *, start: int, share: Value = 1.0) -> Self:
        """From the usable samples of a log, with its direction where it has one.

        Args:
            series: with the channel wind_speed.
            start: of the run on the log's clock [UTC ns]. The log must begin no later.

        Raises:
            InputError: no wind speed, or as for `of`.
        """
        if "wind_speed" not in series.channels:
            raise InputError("no channel wind_speed", where="logged gusts", fix="give a log of a wind speed")
        speed = series.channels["wind_speed"]
        direction = series.channels.get("wind_direction")
        usable = ((series.flags & UNUSABLE) == 0) & np.isfinite(speed)
        if direction is not None:
            usable &= np.isfinite(direction)
            direction = direction[usable]
        time = (series.time[usable] - start) / NANOSECONDS
        return cls.of(time, speed[usable], direction=direction, share=share)

    @classmethod
    def drawn(cls, rng: np.random.Generator, *, batch: int) -> Self:
        """As for all effects, with an hour of sway in place of a log: ± 30 % in speed, ± 0.3 rad in direction."""
        time = np.arange(0.0, 3600.0, 0.5)
        speed, direction = 5 + 1.5 * np.sin(0.7 * time), 0.3 * np.sin(0.4 * time)
        values = cls.parameters()["share"].prior
        return cls.of(time, speed, direction=direction, share=torch.from_numpy(rng.uniform(*values, size=batch)))
