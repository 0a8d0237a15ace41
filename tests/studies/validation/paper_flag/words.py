"""The verdict and the table of the candidates tried, in words with their numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from tests.studies.validation.paper_flag.candidates import Candidate, Shear
from tests.studies.validation.paper_flag.evidence import NEVER
from tests.studies.validation.paper_flag.observe import Observations
from tests.studies.validation.paper_flag.recipe import Group
from tests.studies.validation.paper_flag.study import IN_TIME, Outcome, Study
from tests.studies.validation.paper_flag.verdict import Verdict, free


def verdict_words(seen: Observations, study: Study, verdict: Verdict) -> list[str]:
    """Sentences, the conclusion first."""
    best = verdict.best
    still = max(
        (tip for cell in study.declared if not cell.load.reactive for tip in cell.tips.values()),
        default=0.0,
    )
    clips = sorted(
        (c for c in seen.clips if c.spec.group is not Group.OTHER), key=lambda c: c.spec.speed
    )
    slow, fast = clips[0], clips[-1]
    found = (
        f"The sheet flutters at {slow.waves.frequency.value:.1f} Hz at {slow.spec.speed:g} m/s, up "
        "to "
        f"{fast.waves.frequency.value:.1f} Hz at {fast.spec.speed:g} m/s. The base model, which "
        "has neither fluid "
        f"inertia nor lift, never does: its tip ends up moving by {100 * still:.1f} % of the "
        "length at most."
    )
    closest = (
        f"Closest on what was not fitted comes {best.candidate.value} ({best.load}) at "
        f"{best.factor:.2f} of the "
        f"tunnel's speed: {_kinds(best)}."
    )
    fitted, every = _names(verdict.remaining_fitted), _names(verdict.remaining)
    remark = (
        "By frequencies and stop speeds alone, what remains within two standard errors of the "
        f"best: {fitted}. With "
        "the speed of the wave along the sheet and the amplitude, to which nothing was fitted: "
        f"{every}."
    )
    words = [found, closest, remark]
    if verdict.insufficient:
        misses = "; ".join(
            f"{kind.value} by {_percent(size)} (measurement and mesh leave "
            f"{_percent(verdict.tolerance[kind])} open)"
            for kind, size in verdict.insufficient.items()
        )
        words.append(f"It is not enough. The best model still misses, on average, {misses}.")
    words.append(_tension(study))
    return words


def _kinds(outcome: Outcome) -> str:
    return ", ".join(
        f"{kind.value} within {_percent(outcome.held_out_error(kind))} (mean of n = {len(values)})"
        for kind, values in outcome.held_out.items()
    )


def _tension(study: Study) -> str:
    """What one effect would need to be for each kind of measurement."""
    parts = [
        f"fitted to the {o.fitted_to[0].value} alone it is {o.load} with s = {o.factor:.2f}"
        for o in study.crossed
        if o.candidate is Candidate.REACTIVE
    ]
    return (
        f"The reactive loading by itself is not one number: {'; '.join(parts)}. Frequencies and "
        "the tunnel's log alone "
        "cannot separate the air's mass from the speed at the sheet: both scale the same load."
    )


def candidates_tried(study: Study, verdict: Verdict) -> list[tuple[str, str, str]]:
    """(candidate, judgement, why) for each."""
    rows = []
    kept = {o.candidate for o in verdict.remaining}
    for candidate in Candidate:
        linear = free(study.linear, candidate)
        if candidate in IN_TIME:
            model = free(study.in_time, candidate)
            judged = (
                "best"
                if candidate is verdict.best.candidate
                else "not excluded"
                if candidate in kept
                else "rejected"
            )
            rows.append(
                (
                    candidate.value,
                    judged,
                    f"in time, s = {model.factor:.2f}, {model.load}: {_kinds(model)}",
                )
            )
        elif all((values == NEVER).all() for values in linear.held_out.values()):
            rows.append(
                (candidate.value, "rejected", "linear: no strength and no s make the sheet flutter")
            )
        else:
            rows.append((candidate.value, "rejected", f"linear: {_kinds(linear)}"))
    return rows


def _names(outcomes: Sequence[Outcome]) -> str:
    names = [
        f"{o.candidate.value} ({'s free' if o.shear is Shear.FREE else 'logged speed'})"
        for o in outcomes
    ]
    return _joined(names)


def _joined(names: Iterable[str]) -> str:
    every = list(names)
    return every[0] if len(every) == 1 else f"{', '.join(every[:-1])} and {every[-1]}"


def _percent(logarithm: float) -> str:
    return f"{100 * float(np.expm1(logarithm)):.0f} %" if math.isfinite(logarithm) else "any amount"
