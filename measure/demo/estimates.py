"""The wind that the shipped model reads off the demonstration's film, beside the anemometer's.

The film is drawn by kinematics, not simulated, and its flag is none that the model has seen: the section shows what an
estimate looks like, with its interval and its doubt, not how good it is.
"""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.dataset.pairs import Pairs
from flagdata.timebase import NANOSECONDS
from measure.pages.render import data_url
from models import estimator

EVERY = 5
"""One clip in so many is estimated: one in six seconds."""
FALSE_ALARM = 0.05
LEVEL = 0.9


@dataclass(frozen=True, kw_only=True, eq=False)
class Series:
    """Estimates of some clips of a recording.

    Attributes:
        time: (n,) of the clips' ends, from the first clip's start [s].
        wind, low, high: (n,) mean and interval of `LEVEL` [m/s].
        logged: (n,) the clips' ground truth, the anemometer's mean over a minute [m/s].
        unlike: (n,) whether the clip is unlike all that the model was trained on, at `FALSE_ALARM`.
        model: its name.
    """

    time: NDArray[np.float64]
    wind: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    logged: NDArray[np.float64]
    unlike: NDArray[np.bool_]
    model: str

    @property
    def sentence(self) -> str:
        """What is to be thought of it, in words."""
        share, count = float(self.unlike.mean()), len(self.unlike)
        rmse = float(np.sqrt(np.mean((self.wind - self.logged) ** 2)))
        unlike = f"{share:.0%} of the {count} clips are unlike what the model was trained on"
        if share > 2 * FALSE_ALARM:
            doubt = f"{unlike}, as a drawn flag should be; their estimates, shown hollow, are not to be relied on."
        else:
            doubt = f"{unlike} (expected of clips like those: {FALSE_ALARM:.0%})."
        return (
            f"The model {self.model!r}, trained on simulated flags, differs from the anemometer's minute means by "
            f"{rmse:.1f} m/s (root mean square). {doubt}"
        )


def read(pairs: Pairs) -> Series:
    """Estimates of one clip in `EVERY` by the shipped model.

    Raises:
        NotFoundError: no model came with the package.
        InputError: clips of another length than the model takes.
    """
    model = estimator.shipped()
    chosen = range(0, len(pairs), EVERY)
    order = sorted(chosen, key=lambda index: int(pairs.table.end[index]))
    clips = np.stack([pairs[index].clip[0].numpy() for index in order])
    found = model.estimate(model.inputs(clips))
    low, high = found.interval(LEVEL)
    wind = [target.name for target in found.targets].index("wind_speed")
    end = pairs.table.end[order]
    unlike = found.unlike
    return Series(
        time=(end - pairs.table.start[order].min()) / NANOSECONDS, wind=found.mean[:, wind], low=low[:, wind],
        high=high[:, wind], logged=pairs.table.wind[order],
        unlike=np.zeros(len(order), dtype=np.bool_) if unlike is None else unlike <= FALSE_ALARM, model=model.name,
    )  # fmt: skip


def picture(series: Series) -> str:
    """The series as a PNG in a data URL."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.5, 3.0), layout="constrained")
    axes = figure.subplots()
    axes.plot(series.time, series.logged, color="#2b6f8f", linewidth=1.4, label="anemometer, minute mean")
    axes.vlines(series.time, series.low, series.high, color="#c4622d", alpha=0.35, linewidth=1.2)
    for hollow, label in ((False, "model, 90 % interval"), (True, "model, clip unlike its training data")):
        own = series.unlike == hollow
        if own.any():
            face = "none" if hollow else "#c4622d"
            axes.plot(series.time[own], series.wind[own], "o", markersize=4, color="#c4622d", mfc=face, label=label)
    axes.set(xlabel="time since the first clip [s]", ylabel="wind speed [m/s]", ylim=(0, None))
    axes.legend(loc="lower right", fontsize=8, ncols=3)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=130)
    return data_url(buffer.getvalue(), "image/png")
