"""A drawn flag in a gusty wind and a cup's log of it on another clock, whose offset is drawn from
the seed."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import timedelta
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from flagdata.timebase import NANOSECONDS, from_datetime
from measure.demo import BEFORE, CUP, START
from measure.demo.logger import write_log
from sim.datasets import log_of_air
from sim.wind import VonKarman
from tests.drawn.flag import DrawnFlag

WIND_RATE = 20
"""Hz, at which the true wind is made."""
_AFTER = 30.0
_LARGEST_OFFSET = 45.0


@dataclass(frozen=True, kw_only=True)
class DrawnRecipe:
    """What to make.

    Attributes:
        seed: root of all random streams.
        duration: of the film [s].
        rate: frames a second [Hz].
        wind: the gusts; an intensity near zero makes the steady wind in which clocks cannot be
            found.
        clock: what must be added to the camera's clock to reach the anemometer's [s]; drawn if
            `None`.
    """

    seed: int
    duration: float = 600.0
    rate: int = 25
    wind: VonKarman = field(default_factory=lambda: VonKarman(mean=5.0, intensity=0.2, length=60.0))
    clock: float | None = None

    @property
    def offset(self) -> float:
        """What must be added to the camera's clock to reach the anemometer's [s]."""
        if self.clock is not None:
            return self.clock
        return float(stream(self.seed, "clock").uniform(-_LARGEST_OFFSET, _LARGEST_OFFSET))

    def blown(self) -> FloatArray:
        """The true wind [m/s] at `WIND_RATE`, from `BEFORE` seconds before the first frame on."""
        return self.wind.series(
            stream(self.seed, "wind"), duration=BEFORE + self.duration + _AFTER, rate=WIND_RATE
        )

    def at_frames(self) -> FloatArray:
        """The wind at each frame [m/s]."""
        wind = self.blown()
        times = np.arange(round(self.duration * self.rate)) / self.rate + BEFORE
        return np.interp(times, np.arange(len(wind)) / WIND_RATE, wind)


def write_drawn_log(path: Path, recipe: DrawnRecipe) -> float:
    """The cup's log; the true offset of the clocks [s]."""
    wind = recipe.blown()
    times = np.arange(len(wind)) / WIND_RATE
    begin = from_datetime(START) - round(BEFORE * NANOSECONDS)
    velocity = np.stack([wind, 0 * wind, 0 * wind], axis=1)
    series = log_of_air(
        CUP, times, velocity, instrument=recipe.seed, seed=recipe.seed, begin=begin
    ).series
    first = (int(series.time[0]) - begin) / NANOSECONDS - BEFORE
    stamp = START + timedelta(seconds=first + recipe.offset)
    write_log(
        path,
        series.channels["wind_speed"],
        series.channels["wind_direction"],
        first=stamp,
        quiet=60,
        seed=recipe.seed,
    )
    return recipe.offset


def write_drawn_film(
    path: Path, winds: FloatArray, *, rate: int, seed: int, flag: DrawnFlag
) -> None:
    """A film of a drawn flag in the winds (n,) of its frames [m/s]."""
    with av.open(str(path), "w") as container:
        container.metadata["creation_time"] = START.isoformat()
        video = container.add_stream(
            "libx264", rate=rate, options={"preset": "ultrafast", "crf": "23"}
        )
        video.width, video.height, video.pix_fmt = flag.width, flag.height, "yuv420p"
        video.codec_context.time_base = Fraction(1, rate)
        for number, image in enumerate(flag.frames(winds, rate, stream(seed, "camera"))):
            frame = av.VideoFrame.from_ndarray(image, format="gray").reformat(format="yuv420p")
            frame.pts = number
            container.mux(video.encode(frame))
        container.mux(video.encode(None))
