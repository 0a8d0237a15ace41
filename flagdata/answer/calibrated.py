"""What `flagdata.calibrate` returns: the cloth of a flag as its posterior, or why no weight is
given."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flagdata.answer import Quantity
from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding
from flagdata.core.html import table
from flagdata.errors import RefusedError


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Calibrated:
    """The cloth of a flag.

    Attributes:
        sentence: the area weight in one line, as `flagdata calibrate` prints it.
        level: of the intervals.
        quantities: "area_weight", "bending", "damping" as far as they are known.
        draws: name → (n,) draws of their joint posterior.
        withheld: why no weight is given, where no simulated flag looks like a recording; None where
            one does.
        stated: the area weight as `flagdata.measure(area_weight=…)` takes it; None where it is not
            determined, or only bounded.
        findings: what a reader has to know.
        document: everything, as `flagdata calibrate --json` writes it.
    """

    sentence: str
    level: float
    quantities: Mapping[str, Quantity]
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
            rows
            | {
                f"{finding.severity.value} {finding.kind}": finding.what
                for finding in self.findings
            },
        )
