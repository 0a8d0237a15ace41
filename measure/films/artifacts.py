"""A verdict on films and its models in the lake, in one commit."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from flagdata.findings import quality_flags
from flagdata.lake import Artifact, Lake
from flagdata.provenance import canonical
from flagdata.schema import Kind
from measure.calibrate.simulation import VERSION
from measure.closing.artifacts import Kept, models_of, write
from measure.closing.models import NamedModel, acting
from measure.films.run import Outcome
from measure.verdict.record import Verdict

ANSWER = 1
"""Raised when the same recordings and options get another answer."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ClosedOnFilms:
    """A loop that was closed on films.

    Attributes:
        name: what the measurement is called.
        outcome: what the verdict was made from.
        verdict: what came out.
        models: of the verdict.
        page: HTML.
        reading: how films were read, JSON values.
        parents: artifacts that the recordings were read from; none for tables.
    """

    name: str
    outcome: Outcome
    verdict: Verdict
    models: tuple[NamedModel, ...]
    page: str
    reading: Mapping[str, Any]
    parents: tuple[str, ...]


def keep(lake: Lake, closed: ClosedOnFilms, *, branch: str) -> Kept:
    """Publish a verdict and its models; what is there already is not published again.

    Raises:
        FlagdataError: as `Lake.transaction`.
    """
    measurement = _measurement(closed)
    models = [_model(closed, model, measurement) for model in closed.models]
    with lake.transaction(f"close loop: {closed.name}", branch=branch) as transaction:
        if transaction.find(measurement.id) is not None:
            return Kept(measurement=measurement.id, models=models_of(lake, measurement.id, branch), existing=True)
        staged = transaction.staging(".zarr")
        write(staged, closed.verdict, page=closed.page)
        transaction.add(_measurement(closed, stored=transaction.put(staged)))
        for model in models:
            transaction.add(model)
    return Kept(measurement=measurement.id, models=tuple(model.id for model in models), existing=False)


def _recipe(closed: ClosedOnFilms) -> dict[str, Any]:
    recordings = closed.outcome.recordings
    return {
        "close-loop-on-films": ANSWER, "simulations": VERSION, "sources": [one.source for one in recordings],
        "spans": [[one.first, one.duration] for one in recordings], **closed.reading,
        **closed.outcome.options.recipe(),
    }  # fmt: skip


def _measurement(closed: ClosedOnFilms, stored: str | None = None) -> Artifact:
    verdict = closed.verdict
    findings = closed.outcome.findings
    values = {p.name: (p.after or p.before).value for p in verdict.parameters}
    values |= {f"{c.effect}.{c.parameter}": c.strength.value for c in acting(verdict)[:1]}
    report = {
        "schema": "flagdata.close-loop-report/1", "conclusion": verdict.conclusion.value, "named": list(verdict.named),
        "words": verdict.words, "p_value": verdict.test.p_value.value, "separating": verdict.separating,
        "findings": [finding.as_dict() for finding in findings],
    }  # fmt: skip
    return Artifact(
        kind=Kind.MEASUREMENT, name=closed.name, object=stored, parents=closed.parents, recipe=_recipe(closed),
        seed=closed.outcome.options.calibration.seed, parameters=canonical(values), quality=quality_flags(findings),
        report=json.dumps(report, allow_nan=False, ensure_ascii=False),
    )  # fmt: skip


def _model(closed: ClosedOnFilms, model: NamedModel, measurement: Artifact) -> Artifact:
    effects: Sequence[str] = list(model.content.get("effects", {}))
    report = {"schema": "flagdata.model-report/1", "words": closed.verdict.words, "findings": []}
    return Artifact(
        kind=Kind.MODEL, name=model.name, parents=(measurement.id, *closed.parents),
        seed=closed.outcome.options.calibration.seed, recipe={**_recipe(closed), "effects": effects},
        parameters=canonical(model.content), report=json.dumps(report, allow_nan=False, ensure_ascii=False),
    )  # fmt: skip
