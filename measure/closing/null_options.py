"""What commands that test against nulls share: their options, what findings end them, and bars of
progress."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from flagdata.core.console import say
from flagdata.core.findings import Finding
from flagdata.core.printable import printable
from flagdata.errors import UsageError
from flagdata.verbs.shared_options import ByNulls
from measure.closing.verdict_findings import check_findings, finding_text

if TYPE_CHECKING:
    from measure.forecasting.setting import Stage
    from measure.trajectories.experiment_recipe import ExperimentRecipe


def nulls_given(
    recipe: ExperimentRecipe | None, chosen: ByNulls, *, level: float | None
) -> dict[str, Any]:
    """Returns `level` and `nulls` as the command line or else the recipe says them; without what
    neither does.

    Raises:
        UsageError: a bank, and a number of nulls to simulate.
    """
    if chosen.bank is not None and chosen.nulls is not None:
        raise UsageError(
            "both --nulls and --bank are given", where="--nulls", fix="keep one of them"
        )
    if chosen.bank is not None and chosen.scheduler is not None:
        raise UsageError(
            "--scheduler and --bank are given: nothing is simulated",
            where="--scheduler",
            fix="keep one of them",
        )
    values = {"level": level, "nulls": chosen.nulls}
    if recipe is not None:
        values = {
            name: getattr(recipe, name) if value is None else value
            for name, value in values.items()
        }
    return {name: value for name, value in values.items() if value is not None}


def refuse(findings: Sequence[Finding]) -> None:
    """Reports what was found, up to an error, which ends it."""
    for finding in findings:
        check_findings((finding,))
        say(finding_text(finding), mark=finding.severity.value)


def stage_bars() -> Stage:
    """Draws a bar for each stage; the nulls take most of the time."""
    import sys

    from tqdm import tqdm

    bars: dict[str, tqdm] = {}
    interval = (
        0.2 if sys.stderr.isatty() else 10.0
    )  # a log file gets a line now and then, not an animation

    def advance(stage: str, done: int, total: int) -> None:
        if stage not in bars:
            bars[stage] = tqdm(
                total=total,
                desc=printable(stage),
                bar_format="{desc}: {percentage:3.0f} %|{bar}| {elapsed}<{remaining}",
                ncols=100,
                mininterval=interval,
                file=sys.stderr,
            )
        bars[stage].update(done - bars[stage].n)
        if done >= total:
            bars[stage].close()

    return advance
