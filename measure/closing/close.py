"""Closing the loop: an experiment in, a verdict in numbers and sentences out."""

from __future__ import annotations

from measure.forecasting.setting import Stage
from measure.loop.run import LoopOptions, solve
from measure.report.verdict_statement import with_sentences
from measure.trajectories.trajectory import Experiment
from measure.verdict.verdict_record import Verdict


def close_loop(
    experiment: Experiment, options: LoopOptions, *, stage: Stage | None = None
) -> Verdict:
    """Reaches the verdict on an experiment.

    Args:
        stage: called with progress.

    Raises:
        InputError: recordings that cannot be used (see `measure.trajectories.checks` for what is
            looked at before).
    """
    return with_sentences(solve(experiment, options, stage=stage))
