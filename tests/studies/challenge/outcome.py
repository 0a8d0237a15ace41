"""A verdict beside the answer key: the claim, the truth, and whether they agree."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from statistics import fmean, median
from typing import Any

from measure.verdict import NOT_REJECTED, Conclusion
from tests.studies.challenge.answer_key import Acting, AnswerKey
from tests.studies.challenge.classes import class_of
from tests.studies.challenge.filing import Filing
from tests.studies.challenge.recipe import Kind

FIELD = "corrective-field"
"""Name of the candidate for forces outside the library: it names no effect."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What became of one set.

    Attributes:
        key: what was true.
        conclusion: None where the data were refused.
        named: effects, the best ranked first.
        ranking: candidates as in the verdict.
        comparisons, apart: as in the verdict.
        seconds: it took.
        true_model_errors: comparison → error of the true model [m], where it is known.
    """

    key: AnswerKey
    conclusion: Conclusion | None
    named: tuple[str, ...]
    ranking: tuple[Mapping[str, Any], ...]
    comparisons: tuple[Mapping[str, Any], ...]
    seconds: float
    apart: Mapping[str, Any] | None = None
    true_model_errors: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, key: AnswerKey, filing: Filing) -> Outcome:
        """From what was sealed and what was filed."""
        if filing.verdict is None:
            return cls(
                key=key,
                conclusion=None,
                named=(),
                ranking=(),
                comparisons=(),
                seconds=filing.seconds,
            )
        verdict = filing.verdict
        rank = [candidate["effect"] for candidate in verdict["ranking"]]
        named = [name for name in verdict["named"] if name != FIELD]
        named.sort(key=lambda name: rank.index(name) if name in rank else len(rank))
        return cls(
            key=key,
            conclusion=Conclusion(verdict["conclusion"]),
            named=tuple(named),
            ranking=tuple(verdict["ranking"]),
            comparisons=tuple(verdict["comparisons"]),
            seconds=filing.seconds,
            apart=verdict.get("apart"),
        )

    @property
    def refused(self) -> bool:
        return self.conclusion is None

    @property
    def detected(self) -> bool:
        """Whether the base model was rejected."""
        return self.conclusion is not None and self.conclusion not in NOT_REJECTED

    @property
    def true(self) -> tuple[str, ...]:
        """Effects of the library that acted."""
        return (
            ()
            if self.key.kind is Kind.OUTSIDE
            else tuple(acting.effect for acting in self.key.effects)
        )

    @property
    def true_classes(self) -> frozenset[str]:
        return frozenset(class_of(effect) for effect in self.true)

    @property
    def first(self) -> str | None:
        """The effect named, the best ranked where there are several."""
        return self.named[0] if self.named else None

    @property
    def first_right(self) -> bool:
        """Whether that one acted."""
        return self.first in self.true

    @property
    def class_right(self) -> bool:
        """Whether one of its class acted."""
        return self.first is not None and class_of(self.first) in self.true_classes

    @property
    def among_named(self) -> bool:
        """Whether every effect that acted is among those named."""
        return bool(self.true) and set(self.true) <= set(self.named)

    @property
    def class_among_named(self) -> bool:
        """Whether an effect of a class that acted is among those named, alone or as one of
        several."""
        return bool(self.true_classes & {class_of(name) for name in self.named})

    @property
    def wrong_alone(self) -> bool:
        """Whether one effect was named alone, and none of its class acted."""
        return self.conclusion is Conclusion.EFFECT and not self.class_among_named

    @property
    def found_classes(self) -> int:
        """How many of the classes that acted were named."""
        return len(self.true_classes & {class_of(name) for name in self.named})

    @property
    def outside_said(self) -> bool:
        """Whether the verdict is that the library does not suffice."""
        return self.conclusion in (Conclusion.OUTSIDE, Conclusion.PARTLY)

    @property
    def claims(self) -> tuple[bool, ...]:
        """For each claim that an effect of some class acts, whether one does. "One of" is a single
        claim."""
        named = dict.fromkeys(class_of(name) for name in self.named)
        if self.conclusion is Conclusion.ONE_OF:
            return (any(name in self.true_classes for name in named),) if named else ()
        return tuple(name in self.true_classes for name in named)

    @property
    def reduction(self) -> float | None:
        """E_red: the median over the comparisons on unseen data, against the true model's error
        where that is known, else as the verdict states it."""
        shares = [share for share in map(self._share, self.comparisons) if share is not None]
        return median(shares) if shares and self.named else None

    def _share(self, entry: Mapping[str, Any]) -> float | None:
        before, after = entry["before"]["value"], entry["after"]["value"]
        least = self.true_model_errors.get(entry["what"])
        if least is None:
            return entry["share"]
        return (before - after) / (before - least) if before > least else None

    @property
    def separated(self) -> bool | None:
        """Whether the wrong-effect control is worse than what was named on what was left out, by an
        interval that does not reach zero, and not one of several was named; None where none was, or
        no control was run, or one that acts: of two effects the control may be the other, which is
        none that is wrong."""
        acting = {effect.effect for effect in self.key.effects}
        if (
            not self.named
            or self.apart is None
            or any(entry["control_name"] in acting for entry in self.comparisons)
        ):
            return None
        return self.conclusion is not Conclusion.ONE_OF and self.apart["low"] > 0

    @property
    def control_gap(self) -> float | None:
        """By how much the wrong-effect control is worse than the effect, in half-widths of the
        interval of their paired difference; means over the comparisons. None where one effect was
        not named or there is no control."""
        if len(self.named) < 1 or self.conclusion is Conclusion.ONE_OF:
            return None
        entries = [entry["apart"] for entry in self.comparisons if entry["apart"] is not None]
        widths = [(entry["high"] - entry["low"]) / 2 for entry in entries]
        return (
            fmean(entry["value"] for entry in entries) / fmean(widths)
            if entries and fmean(widths) > 0
            else None
        )

    def strength(self, acting: Acting) -> Mapping[str, Any] | None:
        """The estimate of an effect's strength, where it was weighed with that parameter."""
        return next(
            (
                candidate["strength"]
                for candidate in self.ranking
                if candidate["effect"] == acting.effect
                and candidate["parameter"] == acting.parameter
            ),
            None,
        )
