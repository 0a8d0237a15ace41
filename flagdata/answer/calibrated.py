"""What `flagdata.calibrate` returns: the cloth of a flag or of drapes, with its posterior."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from flagdata.answer.answer import Answer
from flagdata.core.arrays import FloatArray
from flagdata.errors import RefusedError


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Calibrated(Answer):
    """The cloth of a flag or of drapes, or the flag as an anemometer.

    Attributes:
        quantities: "area_weight", "bending", "damping" as far as they are known; none of a reading
            model alone.
        level: of the intervals.
        draws: name → (n,) draws of their joint posterior.
        withheld: why no weight is given, where no simulated flag looks like a recording; None where
            one does.
        stated: the area weight as `flagdata.measure(area_weight=…)` takes it; None where it is not
            determined, or only bounded.
    """

    level: float
    draws: Mapping[str, FloatArray] = field(default_factory=dict)
    withheld: str | None = None
    stated: str | None = None

    @property
    def area_weight(self) -> float:
        """The posterior's median [kg/m²].

        Raises:
            RefusedError: it is withheld, not determined, or only bounded; or no flag was weighed.
        """
        quantity = self.quantities.get("area_weight")
        if quantity is None:
            raise RefusedError(self.sentence, where="area weight", fix="calibrate a flag's weight")
        median = quantity.value
        if median is None:
            fix = "look at `findings`; add recordings in other winds"
            raise RefusedError(self.sentence, where="area weight", fix=fix)
        return median
