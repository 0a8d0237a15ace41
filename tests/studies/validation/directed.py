"""What the directed test sees, names and leaves of sets of one effect, and how often it rejects sets
in which nothing acts, which another generator made.

Sets and kinds are those of `one_design`; FLAGDATA_DIRECTED_ROUNDS gives how many rounds of sets are
made. They are kept in `out`, so that a run that was stopped goes on.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from measure.forecasting import Calibration
from measure.inference import Evidence
from measure.nulls import NullBank, Reference
from measure.shares import clopper_pearson
from measure.verdict import CRITERIA
from tests.studies.challenge.classes import class_of
from tests.studies.validation.one_design import KINDS, LookedAt, build_kinds, make_round, read_sets

LEVELS = (0.05, 0.1)


@dataclass(frozen=True, kw_only=True)
class Judged:
    """A set and what the test says of it.

    Attributes:
        name: of the set.
        acting: the effect that acts; empty where none does.
        value: its strength.
        p: of the base model.
        directed, course: its statistics.
        first: the effect that the set goes farthest the way of.
        alike: those that the set does not separate from it, it among them.
        own_free: p of what is beside the acting effect; None where it has no direction.
        other_free: the same beside the first of the others.
    """

    name: str
    acting: str
    value: float
    p: float
    directed: float
    course: float | None
    first: str
    alike: tuple[str, ...]
    own_free: float | None
    other_free: float | None


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Judges all sets."""
    kept = out / f"directed-{seed}"
    bank = build_kinds(kept / "kinds", seed=seed)
    for number in range(int(os.environ.get("FLAGDATA_DIRECTED_ROUNDS", "3"))):
        make_round(kept, seed=seed, number=number)
    sets = read_sets(kept)
    segments, noise = len(sets[0].segments.speeds), float(sets[0].segments.noise[0])
    reference = bank.reference(segments, noise=noise, seed=seed)
    sheet = grade([judge_set(one, bank, reference) for one in sets], kinds=reference.count)
    (out / "validate-directed.md").write_text(page(sheet), encoding="utf-8")
    return sheet


def judge_set(looked_at: LookedAt, bank: NullBank, reference: Reference) -> Judged:
    """Tests a set at the calibration that it was simulated with."""
    own, acting = looked_at.segments, looked_at.acting
    model = bank.model(own.design)
    evidence = Evidence.of(own.statistics, own.speeds, model)
    steps = tuple(float(step) for step in own.calibration[0])
    here = reference.at(Calibration().moved(steps))
    tested = here.test(evidence)
    names = [one.name for one in tested.scores.sought]
    alike = [names[place] for place in tested.scores.within(CRITERIA.alike_scores)]
    own_name = "" if acting is None else f"{acting.effect}.{acting.parameter}"
    own_free = other_free = None
    if own_name in names:
        place = reference.columns.index
        other = next(name for name in _in_order(tested.scores.largest, names) if name != own_name)
        own_free = here.p_beside(evidence, [place(own_name)])
        other_free = here.p_beside(evidence, [place(other)])
    return Judged(
        name=looked_at.name,
        acting="" if acting is None else acting.effect,
        value=0.0 if acting is None else acting.value,
        p=tested.p,
        directed=tested.scores.farthest,
        course=tested.course,
        first=alike[0],
        alike=tuple(alike),
        own_free=own_free,
        other_free=other_free,
    )


def _in_order(largest: np.ndarray, names: Sequence[str]) -> list[str]:
    return [names[place] for place in np.argsort(-largest)]


def grade(judged: Sequence[Judged], *, kinds: int) -> dict[str, Any]:
    """Counts what is seen, named and left."""
    with_one, without = [j for j in judged if j.acting], [j for j in judged if not j.acting]
    by_level = {
        f"{level:g}": {
            "effects": sum(j.p <= level for j in with_one),
            "nulls": sum(j.p <= level for j in without),
        }
        for level in LEVELS
    }
    named = [j for j in with_one if j.p <= CRITERIA.level and j.own_free is not None]
    least = max(CRITERIA.passing, 1 / (1 + kinds))
    return {
        "kinds": kinds,
        "effects": len(with_one),
        "nulls": len(without),
        "rejected": by_level,
        "named": {
            "of": len(named),
            "first": sum(_effect(j.first) == j.acting for j in named),
            "class first": sum(class_of(_effect(j.first)) == class_of(j.acting) for j in named),
            "among alike": sum(j.acting in map(_effect, j.alike) for j in named),
            "alike": float(np.mean([len(j.alike) for j in named])) if named else 0.0,
        },
        "passing": {
            "right": sum(j.own_free is not None and j.own_free > least for j in named),
            "best other": sum(j.other_free is not None and j.other_free > least for j in named),
        },
        "by effect": {
            effect: [sum(j.p <= CRITERIA.level for j in own), len(own)]
            for effect in sorted({j.acting for j in with_one})
            for own in [[j for j in with_one if j.acting == effect]]
        },
        "sets": [asdict(j) for j in judged],
    }


def _effect(name: str) -> str:
    return name.split(".")[0]


def _share(count: int, of: int) -> str:
    low, high = clopper_pearson(count, of, level=CRITERIA.interval)
    return f"{count} of {of} = {count / of:.2f} [{low:.2f}, {high:.2f}]"


def page(sheet: Mapping[str, Any]) -> str:
    """Writes the sheet in Markdown."""
    named, passing = sheet["named"], sheet["passing"]
    lines = [
        "# The directed test on sets of one design",
        "",
        (
            f"{sheet['effects']} sets of one registered effect and {sheet['nulls']} of none, of "
            "one cloth, 204 markers with a noise of 1.3 mm, 25 Hz, three recordings of 10 s in "
            f"steady winds, each looked at at its true calibration; {sheet['kinds']} of {KINDS} "
            "null kinds of the same design. `python -m tests.studies directed`."
        ),
        "",
        "| level | effects that are seen | sets of nothing that are rejected |",
        "|---|---|---|",
        *(
            f"| {level} | {_share(own['effects'], sheet['effects'])} | "
            f"{_share(own['nulls'], sheet['nulls'])} |"
            for level, own in sheet["rejected"].items()
        ),
        "",
        (
            f"Of {named['of']} that are rejected at {CRITERIA.level:g} and have a direction the "
            f"right effect is first in {named['first']}, its class in {named['class first']}; it "
            f"is among the {named['alike']:.1f} that sets do not separate from the first in "
            f"{named['among alike']}. With it free no other effect is pointed at in "
            f"{passing['right']}, with the first of the others free in {passing['best other']}."
        ),
        "",
        "| effect | seen | of |",
        "|---|---|---|",
        *(f"| {effect} | {seen} | {of} |" for effect, (seen, of) in sheet["by effect"].items()),
    ]
    return "\n".join(lines) + "\n"
