"""What `flagdata.measure` returns: the posterior of a film as arrays, or why the film was
refused."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flagdata.answer import Quantity
from flagdata.answer.wind_elsewhere import WindComparison
from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding
from flagdata.core.html import table
from flagdata.errors import RefusedError


@dataclass(frozen=True, kw_only=True, eq=False)
class Windows:
    """The windows of a film, each by itself, in order.

    Attributes:
        start, end: (k,) of their frames [s from the film's first frame].
        p: (k,) that a familiar clip is at least as strange.
        value: quantity → (k,) means; NaN where only a bound is known.
        low, high: quantity → (k,) ends of the intervals; infinite at an end that nothing bounds.
    """

    start: FloatArray
    end: FloatArray
    p: FloatArray
    value: Mapping[str, FloatArray]
    low: Mapping[str, FloatArray]
    high: Mapping[str, FloatArray]


@dataclass(frozen=True, kw_only=True, eq=False)
class Answer:
    """What a film says.

    Attributes:
        sentence: in one line, as `flagdata measure` prints it.
        quantities: name → quantity: "wind_speed", "area_weight" (area weight) and what else the
            network estimates.
        draws: name → (n,) draws of the joint posterior, in the same order for all names.
        windows: each by itself.
        gusts: intensity of the gusts, standard deviation over mean wind [1]; None where the windows
            are not taken as one series, as of a film of one window.
    """

    sentence: str
    quantities: Mapping[str, Quantity]
    draws: Mapping[str, FloatArray]
    windows: Windows
    gusts: Quantity | None


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Measured:
    """A film, measured or refused.

    Attributes:
        film: its name.
        rate, duration: of it [Hz, s].
        network: that measured it.
        refused: whether the gate refused it.
        verdict: of the gate, in one sentence.
        reasons: why the film is refused, the weightiest first; `value` is the figure of a counted
            fault, or the p of a window that is unlike the training clips.
        findings: on film, size, weight and windows.
        figures: of how the film was made fit: camera, flags, crop; as in `--json` under
            "conditioning". None of a film that is too short for that.
        given: the answer; None where it is not shown: of a refused film, unless it was asked for
            `anyway`.
        elsewhere: how the wind differs from one that was stated as `wind`; None where none was, or
            no answer is shown.
    """

    film: str
    rate: float
    duration: float
    network: str
    refused: bool
    verdict: str
    reasons: tuple[Finding, ...]
    findings: tuple[Finding, ...]
    figures: Mapping[str, Any] | None
    given: Answer | None
    elsewhere: WindComparison | None = None

    @property
    def answer(self) -> Answer:
        """What the film says.

        Raises:
            RefusedError: the film was refused, and was not measured `anyway`; or there is nothing
                to measure in it.
        """
        if self.given is None:
            raise RefusedError(
                self.verdict,
                where=self.film,
                fix=self.reasons[0].fix or "look at it with anyway=True",
            )
        return self.given

    @property
    def sentence(self) -> str:
        """The answer in one line. Raises as `answer`."""
        return self.answer.sentence

    @property
    def quantities(self) -> Mapping[str, Quantity]:
        """Name → quantity. Raises as `answer`."""
        return self.answer.quantities

    @property
    def wind(self) -> Quantity:
        """The wind speed [m/s], of a long film the mean over its windows. Raises as `answer`."""
        return self.answer.quantities["wind_speed"]

    @property
    def draws(self) -> Mapping[str, FloatArray]:
        """Name → (n,) draws of the joint posterior. Raises as `answer`."""
        return self.answer.draws

    @property
    def windows(self) -> Windows:
        """The windows, each by itself. Raises as `answer`."""
        return self.answer.windows

    @property
    def gusts(self) -> Quantity | None:
        """How strong the gusts are; None of a film whose windows are not taken as one series.
        Raises as `answer`."""
        return self.answer.gusts

    def __repr__(self) -> str:
        if self.given is None:
            return f"Measured({self.film}: refused: {self.verdict})"
        mark = "refused, not to be relied on: " if self.refused else ""
        return f"Measured({self.film}: {mark}{self.given.sentence})"

    def _repr_html_(self) -> str:
        rows = (
            {}
            if self.given is None
            else {
                name.replace("_", " "): quantity.text
                for name, quantity in self.given.quantities.items()
            }
        )
        rows |= {"film": f"{self.duration:.2f} s at {self.rate:.4g} Hz", "gate": self.verdict}
        return table(
            repr(self),
            rows
            | {
                f"{finding.severity.value} {finding.kind}": finding.what
                for finding in self.findings
            },
        )
