"""A field recording as a user would bring it: an H.264 file at 60 fps, and an anemometer's CSV on another clock.

The two share one gusty wind. What a user does not know (the offset of the two clocks) is drawn from the seed and
written nowhere but into the returned `Field`, so that results can be compared with it.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError
from flagdata.rng import stream
from measure.demo.flag import DrawnFlag
from sim.wind.spectral import VonKarman

BEFORE = 120.0  # s of wind logged before the camera starts
_AFTER = 30.0
WIND_RATE = 20  # Hz at which the true wind is made
START = datetime(2026, 5, 14, 9, 30, tzinfo=UTC)
ZONE = "+02:00"  # of the logger's wall clock

SENSOR = """\
name = "cup-logger"
about = "A cup anemometer on a logger of one's own, described so that flagdata can read it"
source = "the demonstration"

[file]
delimiter = ";"
decimal = ","

[time]
columns = ["Date", "Time"]
format = "%d.%m.%Y %H:%M:%S"

[channels.wind_speed]
column = "Wind speed [km/h]"
unit = "km/h"
range = [0, 200]

[channels.wind_direction]
column = "Wind direction [deg]"
unit = "deg"

[sensor]
name = "cup anemometer"
height = 4.0
distance-constant = 2.3
averaging = 1.0
threshold = 0.4
resolution = 0.1
accuracy = 0.1
"""


@dataclass(frozen=True, kw_only=True)
class FieldRecipe:
    """What to make.

    Attributes:
        seed: root of all random streams.
        duration: of the video [s].
        frame_rate: of the video [Hz].
        wind: the gusts; an intensity near zero makes the steady wind in which clocks cannot be found.
        distance_constant: of the cup anemometer [m].
        threshold: speed below which the cups stand still [m/s].
        resolution: of the logged speed [m/s].
        dropout: length of one gap in the log [s].
        largest_offset: the hidden offset is drawn uniformly within ± this [s].
    """

    seed: int
    duration: float = 600.0
    frame_rate: int = 60
    wind: VonKarman = field(default_factory=lambda: VonKarman(mean=5.0, intensity=0.2, length=60.0))
    distance_constant: float = 2.3
    threshold: float = 0.4
    resolution: float = 0.1
    dropout: float = 7.0
    largest_offset: float = 45.0

    def __post_init__(self) -> None:
        if self.duration < 10 or self.frame_rate < 1:
            raise InputError(
                f"a recording of {self.duration} s at {self.frame_rate} Hz", fix="make it at least 10 s long, at 1 Hz"
            )


@dataclass(frozen=True, kw_only=True)
class Field:
    """Where the files are, and the truth about them.

    Attributes:
        clock_offset: what must be added to the camera's clock to reach the anemometer's [s].
        wind: true speed at the flag [m/s] at `WIND_RATE`, starting `BEFORE` seconds before the first frame.
    """

    video: Path
    log: Path
    clock_offset: float
    wind: NDArray[np.float64]


def make_field(recipe: FieldRecipe, folder: Path, *, advance: Callable[[int], None]) -> Field:
    """Write `flag.mp4`, `anemometer.csv` and its `cup-logger.toml` into `folder`.

    Args:
        advance: called with the number of frames done.
    """
    wind, at_frames, offset = film(recipe)
    video, log = folder / "flag.mp4", folder / "anemometer.csv"
    write_video(video, recipe, at_frames, advance)
    write_log(log, recipe, wind, offset)
    (folder / "cup-logger.toml").write_text(SENSOR, encoding="utf-8")
    return Field(video=video, log=log, clock_offset=offset, wind=wind)


def film(recipe: FieldRecipe) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Simulate the film, with its hidden true values.

    Returns:
        The true wind [m/s] at `WIND_RATE` from `BEFORE` seconds before the first frame on; that at each frame [m/s];
        and the offset [s] to add to the camera's clock to reach the anemometer's.
    """
    offset = float(stream(recipe.seed, "clock").uniform(-recipe.largest_offset, recipe.largest_offset))
    duration = BEFORE + recipe.duration + _AFTER
    wind = recipe.wind.series(stream(recipe.seed, "wind"), duration=duration, rate=WIND_RATE)
    times = np.arange(round(recipe.duration * recipe.frame_rate)) / recipe.frame_rate + BEFORE
    return wind, np.interp(times, np.arange(len(wind)) / WIND_RATE, wind), offset


def write_video(path: Path, recipe: FieldRecipe, wind: NDArray[np.float64], advance: Callable[[int], None]) -> None:
    """An H.264 file of the drawn flag in the wind of each frame [m/s], its metadata naming `START`."""
    flag = DrawnFlag()
    with av.open(str(path), "w") as container:
        container.metadata["creation_time"] = START.isoformat()
        video = container.add_stream("libx264", rate=recipe.frame_rate, options={"preset": "veryfast", "crf": "23"})
        video.width, video.height, video.pix_fmt = flag.width, flag.height, "yuv420p"
        video.codec_context.time_base = Fraction(1, recipe.frame_rate)
        video.codec_context.thread_count = 1  # the same bytes on every machine
        for number, image in enumerate(flag.frames(wind, recipe.frame_rate, stream(recipe.seed, "camera"))):
            frame = av.VideoFrame.from_ndarray(image, format="gray").reformat(format="yuv420p")
            frame.pts = number
            container.mux(video.encode(frame))
            advance(1)
        container.mux(video.encode())


def write_log(path: Path, recipe: FieldRecipe, wind: NDArray[np.float64], offset: float) -> None:
    """Once a second: the cups' mean speed over the second before the stamp, in km/h, by the logger's own wall clock,
    which runs `offset` seconds ahead of the camera's; with a gap, and a reading that sticks."""
    start = START + timedelta(seconds=offset - BEFORE)  # the logger's time at the first value of `wind`
    zone = datetime.strptime(ZONE, "%z").tzinfo
    rng = stream(recipe.seed, "anemometer")
    first = start.replace(microsecond=0) + timedelta(seconds=2)  # the logger stamps its own whole seconds
    seconds = len(wind) // WIND_RATE - 2
    edges = (first - start).total_seconds() + np.arange(-1, seconds)
    total = np.concatenate([[0.0], np.cumsum(_cups(wind, recipe.distance_constant)) / WIND_RATE])
    speed = np.diff(np.interp(edges, np.arange(len(total)) / WIND_RATE, total))
    speed = np.where(speed < recipe.threshold, 0.0, speed + 0.05 * rng.standard_normal(seconds))
    speed = np.round(np.maximum(speed, 0.0) / recipe.resolution) * recipe.resolution
    gap = int(rng.integers(seconds // 4, seconds // 2))
    stuck = int(rng.integers(seconds // 2, 3 * seconds // 4))
    direction = np.cumsum(rng.normal(0, 2, seconds)) + 240
    for reading in (speed, direction):
        reading[stuck : stuck + 12] = reading[stuck]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, delimiter=";")
        writer.writerow(["Date", "Time", "Wind speed [km/h]", "Wind direction [deg]"])
        for second in range(seconds):
            if gap <= second < gap + recipe.dropout:
                continue
            stamp = (first + timedelta(seconds=second)).astimezone(zone)
            decimal = f"{speed[second] * 3.6:.2f}".replace(".", ",")
            writer.writerow([f"{stamp:%d.%m.%Y}", f"{stamp:%H:%M:%S}", decimal, f"{direction[second] % 360:.0f}"])


def _cups(wind: NDArray[np.float64], distance_constant: float) -> NDArray[np.float64]:
    """A rotating sensor: du/dt = (U - u) |U| / ℓ, ℓ the distance constant (Kristensen 1998); explicit steps."""
    reading = np.empty_like(wind)
    now = wind[0]
    for i, u in enumerate(wind):
        now += (u - now) * min(1.0, abs(u) / (distance_constant * WIND_RATE))
        reading[i] = now
    return reading
