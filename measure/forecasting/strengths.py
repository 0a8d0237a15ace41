"""How strong the library's effects may be, and an effect that is suspected before recordings are
looked at.

The strengths are a prior: log-uniform where an effect has one sign, from what a minute of film
hardly shows to beyond what is expected in the field; uniform where it has two. They were fixed
before any verdict on a film was made, that of `finite-span-loading` later, from its prior, before
any was made with it. Verdicts on markers state their power at the same strengths.
Not among them: a wind that is turned from its log, which has a tolerance of its own or looks like
another view; internal damping, which is calibrated; gusts, whose course is looked at by itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from flagdata.errors import UnknownNameError, UsageError
from measure.forecasting.regressors import EffectColumn, library

WHERE = "--suspect"
"""Where a suspicion is given."""
_RANGES: dict[str, tuple[float, float]] = {
    "power-law-drag.exponent": (-0.5, 0.8),
    "tangential-linear-drag.coefficient": (0.03, 1.5),
    "tangential-quadratic-drag.coefficient": (0.006, 0.3),
    "lift.coefficient": (0.3, 8.0),
    "added-mass.mass": (0.03, 0.6),
    "reactive-loading.mass": (0.03, 0.6),
    "air-density.change": (-0.4, 0.8),
    "permeability.permeability": (1e-3, 5e-2),
    "hem-mass.line_density": (4e-3, 8e-2),
    "hem-stiffness.ratio": (3.0, 60.0),
    "vertical-wind.inclination": (-0.4, 0.4),
    "shear.exponent": (-0.3, 0.8),
    "pole-wake.share": (0.2, 1.5),
    "hysteresis.couple": (5e-5, 2e-3),
    "rest-curvature.curvature": (-6.0, 6.0),
    "full-hoist.stiffness": (30.0, 2e4),
    "tilted-pole.lean": (-0.4, 0.6),
    "tilted-pole.sway": (-0.25, 0.25),
    "wet-mass.uptake": (0.05, 1.0),
    "slack.length": (0.01, 0.15),
    "finite-span-loading.share": (0.05, 1.2),
}
_SLACK = EffectColumn(effect="slack", parameter="length", step=0.02)


@dataclass(frozen=True, kw_only=True)
class Strengths:
    """An effect with the strengths that it may have.

    Attributes:
        column: which strength of which effect.
        low, high: of the strength beyond its null value, in its unit.
    """

    column: EffectColumn
    low: float
    high: float

    @property
    def name(self) -> str:
        """effect.parameter."""
        return self.column.name

    @property
    def signs(self) -> tuple[int, ...]:
        """1 where it can only be stronger, 1 and −1 where it may have either sign."""
        return (1,) if self.low > 0 else (1, -1)

    @property
    def expected(self) -> float:
        """Mean size over the prior."""
        if self.low > 0:
            return (self.high - self.low) / math.log(self.high / self.low)
        return (self.low**2 + self.high**2) / (2 * (self.high - self.low))


def all_strengths() -> tuple[Strengths, ...]:
    """Lists the strengths of all effects that have any."""
    columns = {column.name: column for column in (*library(), _SLACK)}
    return tuple(
        Strengths(column=columns[name], low=low, high=high) for name, (low, high) in _RANGES.items()
    )


def on_markers() -> tuple[Strengths, ...]:
    """Lists the strengths of the effects that verdicts on markers weigh."""
    names = {column.name for column in library()}
    return tuple(strengths for strengths in all_strengths() if strengths.name in names)


@dataclass(frozen=True, kw_only=True)
class Suspicion:
    """An effect that is suspected before recordings are looked at.

    Attributes:
        name: effect.parameter.
        sign: 1 for more of it, −1 for less.
        words: as the user gave it, with the sign.
    """

    name: str
    sign: int
    words: str

    @classmethod
    def parse(cls, text: str, candidates: Sequence[Strengths]) -> Suspicion:
        """Parses a suspicion such as `lift`, `vertical-wind-` or `tilted-pole.lean+`.

        Args:
            candidates: the effects that may be suspected.

        Raises:
            UnknownNameError: none of them.
            UsageError: an effect of several strengths, or of two signs without one, or one that has
                no such sign.
        """
        sign = {"+": 1, "-": -1}.get(text[-1:], 0)
        wanted = text[:-1] if sign else text
        matching = [
            strengths
            for strengths in candidates
            if wanted in (strengths.name, strengths.column.effect)
        ]
        if not matching:
            effects = dict.fromkeys(strengths.column.effect for strengths in candidates)
            raise UnknownNameError.of(
                "effect",
                wanted,
                [*effects, *(strengths.name for strengths in candidates)],
                where=WHERE,
            )
        if len(matching) > 1:
            names = " or ".join(strengths.name for strengths in matching)
            raise UsageError(
                f"{wanted} has several strengths", where=WHERE, fix=f"suspect one of them: {names}"
            )
        (strengths,) = matching
        if strengths.low > 0 and sign < 0:
            raise UsageError(
                f"{wanted} cannot be less than none",
                where=WHERE,
                fix=f"give {wanted} without the sign",
            )
        if strengths.low < 0 and not sign:
            raise UsageError(
                f"{wanted} may be above or below {strengths.column.described.null:g}",
                where=WHERE,
                fix=f"give the sign that is suspected, {wanted}+ or {wanted}-",
            )
        sign = sign or 1
        return cls(name=strengths.name, sign=sign, words=f"{wanted}{'+' if sign > 0 else '-'}")
