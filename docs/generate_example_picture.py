"""The moving picture of the README's first screen, from the film that comes with the package.

`python -m docs.generate_example_picture` measures the film window by window and writes
docs/pictures/example.webp: the film beside the wind as it was measured, as the anemometer logged
it, and the mean that was simulated.
"""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image, ImageDraw

import flagdata
from flagdata.answer.measured import Measured
from flagdata.examples import Example
from flagdata.timebase import NANOSECONDS, from_datetime
from tests.studies.example import START

PICTURE = Path(__file__).with_name("pictures") / "example.webp"
MOST_BYTES = 600_000
"""What a first screen may weigh."""
_STEP = 1.2  # s of a window of the network
_EVERY = 3  # of the film's frames is shown
_FILM = (320, 240)  # px
_CHART = (400, 240)  # px, so that its words can be read on a screen of 400 px
_DPI = 100


def chart(found: Measured, flag: Example) -> tuple[Image.Image, float, float]:
    """The winds over the film's time, and where its first and last instant lie [px from the
    left]."""
    figure = Figure(figsize=(_CHART[0] / _DPI, _CHART[1] / _DPI), dpi=_DPI)
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.08, 0.2, 0.89, 0.68))
    windows = found.windows
    middle = (windows.start + windows.end) / 2
    speed, low, high = (of["wind_speed"] for of in (windows.value, windows.low, windows.high))
    axes.errorbar(
        middle,
        speed,
        yerr=(speed - low, high - speed),
        fmt="o",
        ms=4,
        lw=1.2,
        color="#00796b",
        label="read off the film, 90 %",
    )
    during, logged = log_on_film(flag)
    axes.plot(during, logged, color="#c62828", lw=1.2, label="cup anemometer")
    axes.axhline(flag.truth["wind_speed"], color="0.35", lw=1, ls="--", label="simulated, mean")
    axes.set(xlim=(0, found.duration), ylim=(0, None))
    axes.set_xlabel("time [s]", fontsize=11, labelpad=1)
    axes.set_title("wind [m/s]", fontsize=11, loc="left")
    axes.tick_params(labelsize=11)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(
        fontsize=9,
        frameon=False,
        loc="lower left",
        handlelength=1.4,
        labelspacing=0.1,
        borderpad=0.1,
    )
    canvas.draw()
    picture = Image.fromarray(np.asarray(canvas.buffer_rgba())[:, :, :3])
    (left, _), (right, _) = axes.transData.transform([(0, 0), (found.duration, 0)])
    return picture, float(left), float(right)


def log_on_film(flag: Example) -> tuple[np.ndarray, np.ndarray]:
    """Instants on the film's clock [s from its first frame] and logged speeds [m/s], both
    (sample,)."""
    wind = flagdata.wind(flag.log)
    return (
        wind.start - from_datetime(START)
    ) / NANOSECONDS + wind.time - flag.clock_offset, wind.speed


def moving(found: Measured, flag: Example) -> bytes:
    """The picture: an animated WebP in the film's own time."""
    film = flagdata.frames(flag.film)
    still, left, right = chart(found, flag)
    pictures = []
    for image, instant in zip(film.images[::_EVERY], film.time[::_EVERY], strict=True):
        whole = Image.new("RGB", (_FILM[0] + _CHART[0], _FILM[1]), "white")
        whole.paste(Image.fromarray(image).resize(_FILM, Image.Resampling.LANCZOS), (0, 0))
        whole.paste(still, (_FILM[0], 0))
        at = _FILM[0] + left + (right - left) * float(instant - film.time[0]) / found.duration
        ImageDraw.Draw(whole).line([(at, 0.12 * _CHART[1]), (at, 0.8 * _CHART[1])], fill="#9e9e9e")
        pictures.append(whole)
    written = io.BytesIO()
    pictures[0].save(
        written,
        "WEBP",
        save_all=True,
        append_images=pictures[1:],
        loop=0,
        quality=45,
        method=4,
        duration=round(1000 * _EVERY / film.rate),
    )
    return written.getvalue()


def main() -> None:
    """Write the picture."""
    flag = flagdata.example()
    PICTURE.write_bytes(moving(flagdata.measure(flag.source, windows=_STEP), flag))


if __name__ == "__main__":
    main()
