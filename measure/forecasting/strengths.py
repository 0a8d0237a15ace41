"""How strong the effects may be that verdicts weigh, why the others are not weighed, and an effect
that is suspected before recordings are looked at.

Each effect of the registry states its strengths (`sim.effects.parameter.strength`), those of
installed packages as well. They are a prior: log-uniform where an effect has one sign, from what a
minute of film hardly shows to beyond what is expected in the field; uniform where it has two. Those
of the library were fixed before any verdict on a film was made, that of `finite-span-loading`
later, from its prior, before any was made with it. Verdicts on markers state their power at the
same strengths.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from flagdata.errors import UnknownNameError, UsageError
from flagdata.recipes.registry import PlugInError
from measure.forecasting.regressors import EffectColumn, registered_columns, weighed_columns
from sim.effects import EFFECTS
from sim.effects.weighing import Need

WHERE = "--suspect"
"""Where a suspicion is given."""


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
        """1 where it can be stronger, −1 where it can be less than null; both where it may have
        either sign."""
        return tuple(sign for sign in (1, -1) if max(sign * self.low, sign * self.high) > 0)

    @property
    def expected(self) -> float:
        """Mean size over the prior."""
        if self.low > 0:
            return (self.high - self.low) / math.log(self.high / self.low)
        if self.high <= 0:
            return -(self.low + self.high) / 2
        return (self.low**2 + self.high**2) / (2 * (self.high - self.low))


def on_markers() -> tuple[Strengths, ...]:
    """Lists the strengths of the effects that verdicts on markers and meshes weigh."""
    return _strengths_of(weighed_columns(Need.MARKERS))


def on_films() -> tuple[Strengths, ...]:
    """Lists the strengths of the effects that verdicts on films weigh."""
    return _strengths_of(weighed_columns(Need.FILMS))


def every_strength() -> tuple[Strengths, ...]:
    """Lists the strengths of all effects of the registry, weighed or not."""
    return _strengths_of(registered_columns())


def _strengths_of(columns: Sequence[EffectColumn]) -> tuple[Strengths, ...]:
    ranges = [column.described.weighed_range for column in columns]
    return tuple(
        Strengths(column=column, low=low, high=high)
        for column, (low, high) in zip(columns, ranges, strict=True)
    )


def why_unweighed(recorded: Collection[Need]) -> dict[str, str]:
    """Effect of the registry → why a verdict does not weigh it.

    Args:
        recorded: what the recordings have.
    """
    reasons: dict[str, str] = {}
    for name in EFFECTS:
        try:
            effect = EFFECTS[name]
        except PlugInError as error:
            reasons[name] = error.what
            continue
        lacking = [
            f"it needs {need}: {why}" for need, why in effect.needs.items() if need not in recorded
        ]
        if reason := effect.unweighed or "; ".join(lacking):
            reasons[name] = reason
    return reasons


def what_copies(recorded: Collection[Need]) -> dict[str, str]:
    """Effect of the registry → what of the base model does the same as far as it is not stated, and
    what would show the effect; nothing of effects that need what is not recorded.

    Args:
        recorded: what the recordings have, and what is stated of them.
    """
    return {
        name: f"done as well by {copied.by}, as far as not stated; {copied.shown_by}, would show "
        f"it ({copied.how})"
        for name, effect in EFFECTS.usable()
        if (copied := effect.copied) is not None
        and copied.shown_by not in recorded
        and set(effect.needs) <= set(recorded)
    }


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
        if sign and sign not in strengths.signs:
            raise UsageError(
                f"{wanted} cannot be {'less' if sign < 0 else 'more'} than none",
                where=WHERE,
                fix=f"give {wanted} without the sign",
            )
        usual, *others = strengths.signs
        if others and not sign:
            raise UsageError(
                f"{wanted} may be above or below {strengths.column.described.null:g}",
                where=WHERE,
                fix=f"give the sign that is suspected, {wanted}+ or {wanted}-",
            )
        sign = sign or usual
        return cls(name=strengths.name, sign=sign, words=f"{wanted}{'+' if sign > 0 else '-'}")
