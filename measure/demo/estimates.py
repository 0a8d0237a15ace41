"""The wind that the shipped model reads off the demonstration's film, beside the anemometer's.

The film is drawn by kinematics, not simulated, and its flag is none that the model has seen: the section shows what an
estimate looks like, with its interval and its novelty, not how good it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flagdata.lake import Artifact
from measure.estimate import pictures
from measure.estimate.conditioned import ConditionedFilm
from measure.estimate.dependence import of_model
from measure.estimate.film import RecordFilm
from measure.estimate.gate import gate_of
from measure.estimate.measuring import Measurement, Options, measure
from measure.estimate.series import Beside, beside
from measure.estimate.similarity import FlagSize
from models import estimator

STEP = 6.0
"""From one window to the next [s]."""
SIZE = FlagSize(length=1.5, height=1.0)
"""Size of the flag that was drawn, as if it were one that the model knows."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Series:
    """Some windows of a recording, measured.

    Attributes:
        measured: by the shipped model.
        beside: the anemometer's wind.
    """

    measured: Measurement
    beside: Beside

    @property
    def sentence(self) -> str:
        """What is to be thought of it, in words."""
        verdict = self.measured.verdict
        strange, count = int(verdict.strange.sum()), len(verdict.window_p)
        compared = self.beside.window
        known = (
            f"The model {self.measured.model!r} was trained on simulated flags; this one is drawn by plain formulas, "
            "and moves faster in stronger wind, but not as cloth does: its readings can follow the wind, not meet it."
        )
        if compared is not None and compared.bias is not None and compared.interval is not None:
            low, high = compared.interval
            known += (
                f" Beside the anemometer over the same windows they are {_apart(compared.bias)} (root mean square "
                f"{compared.rmse:.1f} m/s [{low:.1f}, {high:.1f}] 90 %, "
                f"n = {compared.count - compared.bounded} windows){_together(self.beside)}."
            )
        unlike = f"{strange} of {count} windows are unlike what the network was trained on"
        if verdict.refused:
            return (
                f"{known} {unlike}, as a drawn flag should be: `flagdata measure` refuses the film, and what is shown "
                "hollow is not to be relied on."
            )
        return f"{known} {unlike} ({verdict.refusing} would refuse the film)."


def _apart(bias: float) -> str:
    """In words, how far readings lie from the reference in the mean [m/s]."""
    return f"{abs(bias):.1f} m/s {'too high' if bias > 0 else 'too low'} in the mean"


def _together(beside: Beside) -> str:
    """In words, how the readings and the reference of their windows rise and fall together."""
    if beside.logged is None:
        return ""
    both = np.isfinite(beside.wind) & np.isfinite(beside.logged)
    if both.sum() < 3 or not np.ptp(beside.wind[both]) or not np.ptp(beside.logged[both]):
        return ""
    return f", their correlation {np.corrcoef(beside.wind[both], beside.logged[both])[0, 1]:.2f}"


def read(path: Path, recording: Artifact) -> Series:
    """Windows of a recording by the shipped model.

    Args:
        path: of the recording's object.

    Raises:
        NotFoundError: no model came with the package.
        InputError: a film that is too short or too slow.
    """
    model = estimator.shipped()
    film = RecordFilm(path, name=recording.name)
    options = Options(size=SIZE, step=STEP)
    measured = measure(
        ConditionedFilm(film), model, gate=gate_of(model), dependence=of_model(model), options=options
    )  # fmt: skip
    return Series(measured=measured, beside=beside(measured, start=film.start, wind=film.record.wind()))


def picture(series: Series) -> str:
    """The series as a PNG in a data URL."""
    return pictures.series(series.beside, level=series.measured.verdict.level)
