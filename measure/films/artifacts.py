"""A verdict on films as it is kept in the lake."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from measure.calibrate.simulation import VERSION
from measure.closing.artifacts import Answer
from measure.closing.models import NamedModel, acting
from measure.films.page import page
from measure.films.run import Outcome
from measure.films.words import words
from measure.verdict.record import Verdict

ANSWER = 3
"""Raised when the same recordings and options get another answer."""


def answer_of(
    verdict: Verdict,
    outcome: Outcome,
    *,
    name: str,
    models: tuple[NamedModel, ...],
    reading: Mapping[str, Any],
    parents: tuple[str, ...],
) -> Answer:
    """That of films and of tables of observables.

    Args:
        name: what the measurement is called.
        models: of the verdict.
        reading: how films were read, JSON values.
        parents: artifacts that the recordings were read from; none for tables.
    """
    recordings = outcome.recordings
    recipe = {
        "close-loop-on-films": ANSWER,
        "simulations": VERSION,
        "sources": [one.source for one in recordings],
        "spans": [[one.first, one.duration] for one in recordings],
        **reading,
        **outcome.options.recipe(),
    }
    return Answer(
        name=name,
        verdict=verdict,
        models=models,
        effects=acting(verdict)[:1],
        findings=outcome.findings,
        page=page(verdict, outcome),
        words=words(verdict),
        recipe=recipe,
        parents=parents,
        seed=outcome.options.calibration.seed,
    )
