"""What `flagdata.calibrate` returns: the cloth of a flag as its posterior, or why no weight is given."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flagdata.arrays import FloatArray
from flagdata.errors import RefusedError
from flagdata.findings import Finding
from flagdata.html import table


@dataclass(frozen=True, kw_only=True)
class Weighed:
    """One quantity of a cloth, SI.

    Attributes:
        unit: of all numbers.
        value: the posterior's median; None where the recordings do not determine it, or bound it on one side only.
        sigma: its standard deviation; None of a bound.
        interval: at `level`, of a bound with an infinite end or one that the quantity cannot pass.
        assumed: what was assumed, at the level of the answer.
        bound: in words, where only a bound is known: "at least 0.41 kg/m²".
        level: of the interval, or of the bound.
    """

    unit: str
    value: float | None
    sigma: float | None
    interval: tuple[float, float]
    assumed: tuple[float, float]
    bound: str | None = None
    level: float = 0.9

    @property
    def text(self) -> str:
        """Value, interval and unit, or the bound; what was assumed where nothing is determined."""
        if self.bound is not None:
            return f"{self.bound}, {self.level * 100:.3g} %"
        if self.value is None:
            return f"not determined (assumed: {self.assumed[0]:.4g} to {self.assumed[1]:.4g} {self.unit})"
        return f"{self.value:.4g} [{self.interval[0]:.4g}, {self.interval[1]:.4g}] {self.unit}"


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Calibrated:
    """The cloth of a flag.

    Attributes:
        sentence: the area weight in one line, as `flagdata calibrate` prints it.
        level: of the intervals.
        quantities: "area_weight", "bending", "damping" as far as they are known.
        draws: name → (n,) draws of their joint posterior.
        withheld: why no weight is given, where no simulated flag looks like a recording; None where one does.
        stated: the area weight as `flagdata.measure(area_weight=…)` takes it; None where it is not determined, or only
            bounded.
        findings: what a reader has to know.
        document: everything, as `flagdata calibrate --json` writes it.
    """

    sentence: str
    level: float
    quantities: Mapping[str, Weighed]
    draws: Mapping[str, FloatArray]
    withheld: str | None
    stated: str | None
    findings: tuple[Finding, ...]
    document: Mapping[str, Any]

    @property
    def area_weight(self) -> float:
        """The posterior's median [kg/m²].

        Raises:
            RefusedError: it is withheld, not determined, or only bounded.
        """
        median = next(iter(self.quantities.values())).value
        if median is None:
            fix = "look at `findings`; add recordings in other winds"
            raise RefusedError(self.sentence, where="area weight", fix=fix)
        return median

    def __repr__(self) -> str:
        return f"Calibrated({self.sentence})"

    def _repr_html_(self) -> str:
        rows = {name.replace("_", " "): quantity.text for name, quantity in self.quantities.items()}
        return table(
            self.sentence,
            rows | {f"{finding.severity.value} {finding.kind}": finding.what for finding in self.findings},
        )
