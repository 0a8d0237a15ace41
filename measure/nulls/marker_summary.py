"""Tracked markers as one vector for the directed test: the mean over segments of what forecast
errors, and their moments about the pole, are along all columns."""

from __future__ import annotations

import numpy as np

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.errors import UsageError
from measure.forecasting.calibrated_parameters import THETA
from measure.forecasting.regressors import TURNED, library
from measure.forecasting.strengths import Strengths, on_markers
from measure.inference.segment_evidence import Evidence
from measure.nulls.directed_test import Sought, Summary
from measure.probes.statistics import Statistics

APPEARS = 0.25
"""Share of a shift that the fit's mesh expects of an effect which appears in recordings of other
meshes: the median of twelve, 0 to 0.55 (decision 062). Most of the sensitivity of a forecast is the
mesh's own chaos."""
_STILL = 1e-6
"""Mean wind below which nothing goes with it [m/s]."""


def sought_on_markers(columns: tuple[str, ...]) -> tuple[Sought, ...]:
    """Lists the effects that are weighed, of those that are among the columns, and a wind that is
    turned from its log: where the log has a tolerance, that is not known anyway."""
    (turned,) = (one for one in library() if one.name == TURNED)
    low, high = (end - turned.described.null for end in turned.described.prior)
    strengths = [*on_markers(), Strengths(column=turned, low=low, high=high)]
    return tuple(
        Sought(name=one.name, expected=one.expected, signs=one.signs)
        for one in strengths
        if one.name in columns
    )


def summarise_evidence(
    evidence: Evidence, places: list[int], *, usual_speed: float, damping: float
) -> Summary:
    """Summarises the experiment that evidence is of, by what a model leaves of it.

    Args:
        places: of the effects that are sought, among the columns.
        usual_speed: about which the mean of nulls goes with the wind [m/s].
        damping: logarithm of its ratio to the nominal one.

    Raises:
        UsageError: it is what is left across a column.
    """
    if evidence.statistics is None or evidence.speeds is None:
        raise UsageError(
            "evidence across a column has no statistics of its own",
            where="directed test",
            fix="test that of all columns",
        )
    parts = _parts(evidence.statistics)
    response = np.concatenate([part.response.mean(axis=0) for part in parts])
    faster = (evidence.speeds - usual_speed) / max(usual_speed, _STILL)
    known = response[:, : len(THETA)] * evidence.prior
    return Summary(
        values=np.concatenate([part.r.mean(axis=0) for part in parts]),
        directions=response[:, places],
        unknown=np.concatenate([known, _logged(parts)], axis=1),
        covariates=np.array([faster.mean(), (faster**2).mean()]),
        damping=damping,
    )


def chance_of_markers(statistics: Statistics) -> FloatArray:
    """Computes how segments differ from the mean of their experiment, (segment, column)."""
    return np.concatenate([part.r - part.r.mean(axis=0) for part in _parts(statistics)], axis=1)


def _parts(statistics: Statistics) -> list[Statistics]:
    """Lists the errors' statistics and, where they are looked at, the moments'."""
    return [statistics] if statistics.turning is None else [statistics, statistics.turning]


def _logged(parts: list[Statistics]) -> FloatArray:
    """Computes how the vector moves with what the log of each recording may be off by, (column,
    nuisance · recording); none of nulls, whose wind is known."""
    logged = [_of_each(part.log, parts[0].recording) for part in parts if part.log is not None]
    columns = sum(part.r.shape[1] for part in parts)
    return np.concatenate(logged) if len(logged) == len(parts) else np.zeros((columns, 0))


def _of_each(log: FloatArray, recording: IntArray) -> FloatArray:
    sums = [log[recording == index].sum(axis=0) for index in np.unique(recording)]
    return np.concatenate(sums, axis=1) / len(recording)
