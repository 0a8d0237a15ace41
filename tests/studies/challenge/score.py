"""Opens the keys of sets whose verdicts are filed, and grades them.

Definitions, in the words of the sheet:

- *False positive*: a null whose base model was not found sufficient. A refusal of the data counts
  as one.
- *Half-detection strength*: the impact (see `AnswerKey.impact`) at which half are detected, of a
  class of effects (see `rates.Power`). Identification is graded on sets of one effect at twice that
  or more; effects from outside the library are called strong by twice that of any other class.
- *Top-1*: the effect named, or the best ranked of those named, acted; *class-level*: one of its
  class did.
- *False discovery*: a claim that an effect of some class acts where none does. "One of" makes a
  single claim.
- *None of the library*: the verdict says so, or that the library explains only a part.
- *E_red*: (before − after)/(before − least), with the error of the true model, by the fitter's
  numerics, as the least; the median over a set's comparisons, where an effect was named.
- *Control separated*: the same freedom spent on the best wrong effect leaves a larger misfit on the
  recordings left out in turn, by an interval of the paired difference that does not reach zero. Of
  all sets with an effect of the library where effects were named and a control was run, that does
  not act itself (of two effects it may be the other); "one of" counts as not separated. *By a
  single recording*: the mean difference is larger than the mean half-width of the single
  comparisons' intervals.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from flagdata.errors import RefusedError
from measure.verdict import Conclusion
from tests.studies.challenge import filing
from tests.studies.challenge.answer_key import opened
from tests.studies.challenge.classes import class_of
from tests.studies.challenge.folder import ChallengeFolder
from tests.studies.challenge.outcome import Outcome
from tests.studies.challenge.rates import Power
from tests.studies.challenge.recipe import Kind
from tests.studies.challenge.true_model import ReferenceErrors
from tests.studies.shares import Share

ENOUGH = 2.0
"""Times the half-detection strength, from where identification is graded."""


@dataclass(frozen=True, kw_only=True)
class Gate:
    """What a good challenge reaches: `value` at least (or at most) `wanted`; None where there were
    no cases."""

    name: str
    value: float | None
    wanted: float
    at_most: bool = False

    @property
    def met(self) -> bool:
        """Whether it is reached."""
        if self.value is None:
            return False
        return self.value <= self.wanted if self.at_most else self.value >= self.wanted

    def as_dict(self) -> dict[str, Any]:
        """JSON values."""
        return {
            "name": self.name,
            "value": self.value,
            "wanted": self.wanted,
            "bound": "at most" if self.at_most else "at least",
            "met": self.met,
        }


@dataclass(frozen=True, kw_only=True)
class Coefficients:
    """Strengths against the truth, where the effect was named.

    Attributes:
        errors: relative, (estimate − true)/|true|, of strengths that are no bounds.
        covered: of the intervals.
        levels: at which these were stated.
    """

    errors: tuple[float, ...]
    covered: Share
    levels: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class HalfStrength:
    """The half-detection strength of an effect, in its own unit, with 90 % bounds."""

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """The score of a challenge.

    Attributes:
        title: of the challenge.
        outcomes: of all sets, in the order of their names.
        power: against impact, by class; None where no library effect acted alone.
        by_noise, by_rate: the same, with groups by marker noise in millimetres and by frame rate,
            over every set in which something acted.
        criteria: hashes of the thresholds that the verdicts were made by, sorted; one where all
            were made alike.
        filmed: whether the sets were films.
    """

    title: str
    outcomes: tuple[Outcome, ...]
    power: Power | None
    by_noise: Power | None
    by_rate: Power | None
    criteria: tuple[str, ...] = ()
    filmed: bool = False

    def of_kind(self, *kinds: Kind) -> list[Outcome]:
        """Outcomes of sets of these kinds."""
        return [outcome for outcome in self.outcomes if outcome.key.kind in kinds]

    @property
    def strong(self) -> list[Outcome]:
        """Outcomes of sets of one effect, at twice its class's half-detection strength or more."""
        power = self.power
        if power is None:
            return []
        return [
            o for o in self.of_kind(Kind.ONE) if o.key.impact >= ENOUGH * power.half[_class(o)][0]
        ]

    @property
    def strong_outside(self) -> list[Outcome]:
        """Outcomes of sets with an effect from outside the library, at twice the half-detection
        strength of a class of effects outside those graded, or more."""
        power = self.power
        if power is None:
            return []
        return [o for o in self.of_kind(Kind.OUTSIDE) if o.key.impact >= ENOUGH * power.overall[0]]

    @property
    def half_strengths(self) -> dict[str, HalfStrength]:
        """Effect → the strength that is detected half of the time: that of its class as an impact,
        times the median of strength over impact in its own sets, which are proportional while
        effects are weak."""
        found: dict[str, HalfStrength] = {}
        for effect in sorted({o.key.effects[0].effect for o in self.of_kind(Kind.ONE)}):
            own = [
                o
                for o in self.of_kind(Kind.ONE)
                if o.key.effects[0].effect == effect and o.key.impact > 0
            ]
            if self.power is not None and own:
                half, low, high = self.power.half[class_of(effect)]
                scale = float(np.median([abs(o.key.effects[0].value) / o.key.impact for o in own]))
                unit = own[0].key.effects[0].unit
                found[effect] = HalfStrength(
                    value=half * scale, low=low * scale, high=high * scale, unit=unit
                )
        return found

    def share(self, cases: Sequence[Outcome], happened: Callable[[Outcome], bool]) -> Share:
        """Among some outcomes."""
        return Share.of(happened(case) for case in cases)

    @property
    def false_positives(self) -> Share:
        return self.share(self.of_kind(Kind.NULL), lambda o: o.detected or o.refused)

    @property
    def false_discoveries(self) -> Share:
        return Share.of(not claim for outcome in self.outcomes for claim in outcome.claims)

    @property
    def outside_recall(self) -> Share:
        return self.share(self.of_kind(Kind.OUTSIDE), lambda o: o.outside_said)

    @property
    def separated(self) -> Share:
        found = [o.separated for o in self.of_kind(Kind.ONE, Kind.PAIR)]
        return Share.of(apart for apart in found if apart is not None)

    @property
    def separated_singly(self) -> Share:
        gaps = [o.control_gap for o in self.of_kind(Kind.ONE, Kind.PAIR)]
        return Share.of(gap > 1.0 for gap in gaps if gap is not None)

    @property
    def reductions(self) -> list[float]:
        """E_red of the sets with a library effect in which one was named."""
        found = [outcome.reduction for outcome in self.of_kind(Kind.ONE, Kind.PAIR)]
        return [value for value in found if value is not None]

    @property
    def coefficients(self) -> Coefficients:
        errors: list[float] = []
        covered: list[bool] = []
        levels: list[float] = []
        for outcome in self.of_kind(Kind.ONE, Kind.PAIR):
            for acting in outcome.key.effects:
                strength = outcome.strength(acting)
                if acting.effect in outcome.named and strength is not None:
                    if strength["bound"] is None:
                        errors.append((strength["value"] - acting.value) / abs(acting.value))
                    covered.append(_within(acting.value, strength))
                    levels.append(strength["level"])
        return Coefficients(
            errors=tuple(errors), covered=Share.of(covered), levels=tuple(sorted(set(levels)))
        )

    def _gates_of_films(self) -> tuple[Gate, ...]:
        """What is asked of verdicts on films, whose effects are set at strengths that a film
        shows."""
        seen = [o for o in self.of_kind(Kind.OUTSIDE) if o.detected]
        reductions = self.reductions
        return (
            Gate(
                name="false positives on nulls",
                value=self.false_positives.value,
                wanted=0.05,
                at_most=True,
            ),
            Gate(
                name="class among those named, of one effect",
                wanted=0.6,
                value=self.share(self.of_kind(Kind.ONE), lambda o: o.class_among_named).value,
            ),
            Gate(
                name="wrong name given alone, of all sets",
                wanted=0.05,
                at_most=True,
                value=self.share(self.outcomes, lambda o: o.wrong_alone).value,
            ),
            Gate(
                name="none of the library or partly, of what was detected from outside",
                wanted=0.5,
                value=self.share(seen, lambda o: o.outside_said).value,
            ),
            Gate(
                name="median E_red",
                value=float(np.median(reductions)) if reductions else None,
                wanted=0.5,
            ),
        )

    @property
    def gates(self) -> tuple[Gate, ...]:
        """What the project asks of itself."""
        reductions = self.reductions
        if self.filmed:
            return self._gates_of_films()
        return (
            Gate(
                name="false positives on nulls",
                value=self.false_positives.value,
                wanted=0.05,
                at_most=True,
            ),
            Gate(
                name="class-level identification of strong effects",
                wanted=0.9,
                value=self.share(self.strong, lambda o: o.class_right).value,
            ),
            Gate(
                name="top-1 identification of strong effects",
                wanted=0.8,
                value=self.share(self.strong, lambda o: o.first_right).value,
            ),
            Gate(name="recall of none of the library", value=self.outside_recall.value, wanted=0.7),
            Gate(
                name="median E_red",
                value=float(np.median(reductions)) if reductions else None,
                wanted=0.7,
            ),
            Gate(name="control separated", value=self.separated.value, wanted=0.9),
        )

    @property
    def shares(self) -> dict[str, Share]:
        """Every share of the sheet, by what it is of."""
        one, pairs, outside = (self.of_kind(kind) for kind in (Kind.ONE, Kind.PAIR, Kind.OUTSIDE))
        strong = self.strong
        return {
            "false positives on nulls": self.false_positives,
            "detected: one effect": self.share(one, lambda o: o.detected),
            "detected: two effects": self.share(pairs, lambda o: o.detected),
            "detected: outside the library": self.share(outside, lambda o: o.detected),
            "class-level, strong": self.share(strong, lambda o: o.class_right),
            "top-1, strong": self.share(strong, lambda o: o.first_right),
            "class-level, all of one effect": self.share(one, lambda o: o.class_right),
            "top-1, all of one effect": self.share(one, lambda o: o.first_right),
            "true effect among those named": self.share(one, lambda o: o.among_named),
            "several named as one of, of one effect": self.share(
                one, lambda o: o.conclusion is Conclusion.ONE_OF
            ),
            "pairs: one class found": self.share(pairs, lambda o: o.found_classes >= 1),
            "pairs: both classes found": self.share(
                pairs, lambda o: o.found_classes == len(o.true_classes)
            ),
            "pairs: incompleteness said or both found": self.share(
                pairs, lambda o: o.outside_said or o.found_classes == len(o.true_classes)
            ),
            "false discoveries among claims": self.false_discoveries,
            "recall of none of the library": self.outside_recall,
            "recall of none of the library, strong": self.share(
                self.strong_outside, lambda o: o.outside_said
            ),
            "none of the library, said wrongly of one effect": self.share(
                one, lambda o: o.outside_said
            ),
            "control separated": self.separated,
            "control separated by a single recording": self.separated_singly,
            "interval covers the true strength": self.coefficients.covered,
            "not decided": self.share(
                self.outcomes, lambda o: o.conclusion is Conclusion.UNDECIDED
            ),
            "not decided, of one effect": self.share(
                one, lambda o: o.conclusion is Conclusion.UNDECIDED
            ),
            "data refused": self.share(self.outcomes, lambda o: o.refused),
        }


def score(
    folder: ChallengeFolder,
    *,
    only: Sequence[str] = (),
    reference: ReferenceErrors | None = None,
    progress: Callable[[int], object] | None = None,
) -> Sheet:
    """Open the keys and grade. What had been filed by then is kept on record, and no verdict can be
    filed afterwards.

    Args:
        only: names of sets; none for all.
        reference: errors against which E_red is measured where an effect of the library was named;
            None for the verdict's own floor.
        progress: called with 1 for each set.

    Raises:
        RefusedError: sets without a verdict.
        CorruptError: a verdict, a key or data that are not as they were.
    """
    manifest = folder.manifest()
    names = folder.chosen(tuple(only))
    missing = [name for name in names if not filing.filed(folder, name)]
    if missing:
        raise RefusedError(
            f"{len(missing)} of {len(names)} sets have no filed verdict: {', '.join(missing[:5])}"
            f"{' …' if len(missing) > 5 else ''}",
            where=str(folder.path),
            fix="run `python -m tests.studies challenge run` first; keys stay sealed until then",
        )
    filed = {name: filing.read(folder, name) for name in names}
    for name in names:
        folder.checked(name)
    filing.note_opening(folder, names)
    outcomes: list[Outcome] = []
    for name in names:
        content, where = folder.seal(name), str(folder.sealed(name))
        key = opened(content, manifest["sets"][name]["commitment"], where=where)
        outcome = Outcome.of(key, filed[name])
        if reference is not None and outcome.named and outcome.true:
            outcome = replace(outcome, true_model_errors=reference(folder, key))
        outcomes.append(outcome)
        if progress is not None:
            progress(1)
    found = graded(manifest["title"], outcomes)
    return replace(
        found,
        criteria=tuple(sorted({h for one in filed.values() if (h := one.criteria) is not None})),
        filmed=folder.filmed,
    )


def graded(title: str, outcomes: Sequence[Outcome]) -> Sheet:
    """The sheet of some outcomes."""
    one = [o for o in outcomes if o.key.kind is Kind.ONE and o.key.impact > 0]
    acted = [o for o in outcomes if o.key.impact > 0]
    return Sheet(
        title=title,
        outcomes=tuple(outcomes),
        power=_power(one, _class),
        by_noise=_power(acted, lambda o: f"{1e3 * o.key.noise:g}"),
        by_rate=_power(acted, lambda o: str(o.key.rate)),
    )


def _within(value: float, interval: Mapping[str, Any]) -> bool:
    """Decides whether an interval contains a value; a filed end that is None is infinite
    (`filing`)."""
    low, high = interval["low"], interval["high"]
    return (low is None or low <= value) and (high is None or value <= high)


def _class(outcome: Outcome) -> str:
    return class_of(outcome.key.effects[0].effect)


def _power(cases: Sequence[Outcome], group: Callable[[Outcome], str]) -> Power | None:
    if not cases:
        return None
    return Power.fitted(
        [o.key.impact for o in cases], [group(o) for o in cases], [o.detected for o in cases]
    )
