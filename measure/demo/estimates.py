"""The wind that the shipped model reads off the demonstration's film, beside the anemometer's.

The film is drawn by kinematics, not simulated, and its flag is none that the model has seen: the section shows what an
estimate looks like, with its interval and its doubt, not how good it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from flagdata.lake import Artifact
from measure.estimate import pictures
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
"""Of the flag that was drawn, as if it were one that the model knows."""


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
        strange, count = int(verdict.strange.sum()), len(self.measured.windows)
        compared = self.beside.of_minute
        known = f"The model {self.measured.model!r} was trained on simulated flags."
        if compared is not None:
            known += f" It differs from the anemometer's minute means by {compared.rmse:.1f} m/s (root mean square)."
        unlike = f"{strange} of {count} windows are unlike what the model was trained on"
        if verdict.refused:
            return (
                f"{known} {unlike}, as a drawn flag should be: `flagdata measure` refuses the film, and what is shown "
                "hollow is not to be relied on."
            )
        return f"{known} {unlike} (expected of familiar films: {verdict.false_alarm:.0%})."


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
    measured = measure(
        film, model, gate=gate_of(model), dependence=of_model(model), options=Options(size=SIZE, step=STEP)
    )
    return Series(measured=measured, beside=beside(measured, start=film.start, wind=film.record.wind()))


def picture(series: Series) -> str:
    """The series as a PNG in a data URL."""
    return pictures.series(series.beside, level=series.measured.verdict.level)
