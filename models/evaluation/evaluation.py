"""Every score of every model, computed once: what the page, the words and the JSON document are
made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flagdata.core import rng
from flagdata.core.findings import Finding, Severity
from flagdata.core.json_values import json_values
from flagdata.errors import UnknownNameError
from models.evaluation import score_table, triplets
from models.evaluation.bootstrap import DRAWS, Resamples
from models.evaluation.curves import LearningPoint
from models.evaluation.predictions import WIND, Predictions
from models.evaluation.predictive_calibration import (
    CURVE,
    LEVELS,
    Coverage,
    RankHistogram,
    coverage,
    rank_histogram,
    tarp,
)
from models.evaluation.scores import BinError, error_against

SCHEMA = "flagdata.evaluation/1"
_LEVELS = tuple(sorted({*CURVE, *LEVELS}))
_COMPARED = ("rmse", "accuracy", "area_weight_error", "triplets")


@dataclass(frozen=True, kw_only=True)
class WindError:
    """A model's error against the true wind."""

    label: str
    bins: tuple[BinError, ...]


@dataclass(frozen=True, kw_only=True)
class CalibrationCurve:
    """How far a model's distributions of one target are to be believed."""

    label: str
    target: str
    coverage: tuple[Coverage, ...]
    ranks: RankHistogram


@dataclass(frozen=True, kw_only=True)
class Expected:
    """Expected coverage of all targets together (TARP)."""

    label: str
    coverage: tuple[Coverage, ...]


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """All scores of all models on the same clips.

    Attributes:
        data: what was tested on, as data set and tag.
        seed: of resamples, triplets and reference points.
        clips, groups: tested on; groups are sequences.
        rows: of the table.
        targets: scores of every target.
        reference: label that the differences are against; the lowest wind RMSE unless another was
            asked for, None if no model gives the wind.
        differences: paired, over the same draws of sequences.
        wind_errors, calibrations, expected: of the models that have them.
        learning: as it was given.
        findings: what a reader has to know.
        unseen: whether no model learned from these sequences.
        split, split_by: the side that was judged, and how sides were decided, see
            `flagdata.dataset.Pairs`.
    """

    data: str
    seed: int
    clips: int
    groups: int
    rows: tuple[score_table.Row, ...]
    targets: tuple[score_table.TargetRow, ...]
    reference: str | None
    differences: tuple[score_table.Difference, ...]
    wind_errors: tuple[WindError, ...]
    calibrations: tuple[CalibrationCurve, ...]
    expected: tuple[Expected, ...]
    learning: tuple[LearningPoint, ...]
    findings: tuple[Finding, ...]
    unseen: bool
    split: str | None
    split_by: Mapping[str, Any] | None


def evaluate(
    predictions: Sequence[Predictions],
    *,
    data: str,
    seed: int,
    draws: int = DRAWS,
    reference: str | None = None,
    learning: Sequence[LearningPoint] = (),
    unseen: bool = True,
    split: str | None = None,
    split_by: Mapping[str, Any] | None = None,
) -> Evaluation:
    """Scores models that were tested on the same clips.

    Args:
        predictions: of each model; several of one label are its runs with other seeds.
        data: data set and tag, for the heading.
        seed: of all that is drawn.
        draws: of the bootstrap.
        reference: label that the others are compared with.
        learning: scores of models that were trained on fewer sequences, shown beside these.
        unseen: whether no model learned from these sequences.
        split, split_by: of the pairs that were judged, see `flagdata.dataset.Pairs`.

    Raises:
        InputError: predictions that are not of the same clips.
        UnknownNameError: a label that no model has.
    """
    models = score_table.models(predictions)
    if reference is not None and reference not in models:
        raise UnknownNameError.of("model", reference, models)
    group = predictions[0].group
    resamples = Resamples.of(
        group, generator=rng.stream(seed, "evaluation", "bootstrap"), draws=draws
    )
    findings: list[Finding] = []
    if not unseen:
        text = (
            "models may have learned from these clips, so that errors are smaller than on others; "
            "evaluate on another side by --side"
        )
        findings.append(_warning("seen-in-training", text))
    chosen = triplets.draw(group, seed=seed) if triplets.possible(group) else None
    if chosen is None:
        findings.append(
            _warning(
                "no-triplets",
                "no sequence has two clips beside another's: there is no triplet accuracy",
            )
        )
    if resamples.groups < 20:
        text = (
            f"intervals rest on {resamples.groups} sequences; below 20 a percentile interval is "
            "too narrow"
        )
        findings.append(_warning("few-sequences", text))
    runs = {
        label: [score_table.metric_values(run, resamples, chosen) for run in of]
        for label, of in models.items()
    }
    values = {label: score_table.mean_values(of) for label, of in runs.items()}
    with_wind = {label: of for label, of in models.items() if WIND in of[0].targets}
    with_samples = {label: of for label, of in models.items() if of[0].samples is not None}
    varied = {
        label: of for label, of in with_samples.items() if (np.ptp(of[0].truth, axis=0) > 0).all()
    }
    findings += [
        _warning(
            "no-tarp",
            f"a target of {label} is the same in all clips: there is no expected coverage (TARP)",
        )
        for label in with_samples
        if label not in varied
    ]
    if reference is None and with_wind:
        reference = min(with_wind, key=lambda label: float(values[label]["rmse"][0]))
    return Evaluation(
        data=data,
        seed=seed,
        clips=len(group),
        groups=resamples.groups,
        rows=tuple(
            row
            for label, of in models.items()
            for row in score_table.rows(of, runs[label], resamples)
        ),
        targets=tuple(
            row for of in models.values() for row in score_table.target_rows(of, resamples)
        ),
        reference=reference,
        differences=()
        if reference is None
        else score_table.differences(
            values, reference, clips=len(group), groups=resamples.groups, metrics=_COMPARED
        ),
        wind_errors=tuple(
            WindError(label=label, bins=error_against(of, WIND, resamples))
            for label, of in with_wind.items()
        ),
        calibrations=tuple(
            CalibrationCurve(
                label=label,
                target=target,
                coverage=coverage(of, target, resamples, levels=_LEVELS),
                ranks=rank_histogram(of, target),
            )
            for label, of in with_samples.items()
            for target in of[0].targets
        ),
        expected=tuple(
            Expected(
                label=label,
                coverage=tarp(of, resamples, generator=rng.stream(seed, "evaluation", "tarp")),
            )
            for label, of in varied.items()
        ),
        unseen=unseen,
        split=split,
        split_by=split_by,
        learning=tuple(learning),
        findings=tuple(findings),
    )


def _warning(kind: str, text: str) -> Finding:
    return Finding(kind=kind, severity=Severity.WARNING, what=text)


def as_document(evaluation: Evaluation) -> dict[str, Any]:
    """Returns the evaluation as JSON values with its schema tag; null for what is not known."""
    return {
        "schema": SCHEMA,
        "data": evaluation.data,
        "split": evaluation.split,
        "split_by": evaluation.split_by,
        "seed": evaluation.seed,
        "clips": evaluation.clips,
        "groups": evaluation.groups,
        "models": json_values(evaluation.rows),
        "targets": json_values(evaluation.targets),
        "reference": evaluation.reference,
        "differences": json_values(evaluation.differences),
        "wind_errors": json_values(evaluation.wind_errors),
        "calibration": json_values(evaluation.calibrations),
        "tarp": json_values(evaluation.expected),
        "learning": json_values(evaluation.learning),
        "findings": json_values(evaluation.findings),
    }
