"""What commands that test against nulls share: their options, what findings end them, and bars of progress."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from flagdata.console import LocalPath, say
from flagdata.errors import UsageError
from flagdata.findings import Finding
from flagdata.printable import printable
from measure.closing.findings import checked, finding_text

if TYPE_CHECKING:
    from measure.forecasting.setting import Stage
    from measure.observe.recipe import ExperimentRecipe

_Command = Callable[..., Any]


def null_options(*, level: str) -> Callable[[_Command], _Command]:
    """The options `--nulls`, `--bank`, `--level`, `--seed` and `--workers` of a command.

    Args:
        level: help of `--level`.
    """
    options = (
        click.option(
            "--nulls",
            type=click.IntRange(min=1),
            help="Number of recordings without any effect to simulate for comparison, 160 or more; on films the number "
            "of meshes and time-stepping methods, 20 by default.",
        ),
        click.option(
            "--bank",
            type=LocalPath(exists=True),
            help="Folder of such simulations that were made before, by the study `challenge bank` of a checkout.",
        ),
        click.option("--level", type=click.FloatRange(0, 1, min_open=True, max_open=True), help=level),
        click.option(
            "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of the simulated nulls."
        ),
        click.option(
            "--workers", type=click.IntRange(min=1), help="Number of processes; by default one for each core."
        ),
    )

    def decorated(command: _Command) -> _Command:
        for option in reversed(options):
            command = option(command)
        return command

    return decorated


def nulls_given(
    recipe: ExperimentRecipe | None, *, level: float | None, nulls: int | None, bank: Path | None
) -> dict[str, Any]:
    """`level` and `nulls` of options, as the command line or else the recipe says them; without what neither does.

    Raises:
        UsageError: a bank, and a number of nulls to simulate.
    """
    if bank is not None and nulls is not None:
        raise UsageError("both --nulls and --bank are given", where="--nulls", fix="keep one of them")
    said = {"level": level, "nulls": nulls}
    if recipe is not None:
        said = {name: getattr(recipe, name) if value is None else value for name, value in said.items()}
    return {name: value for name, value in said.items() if value is not None}


def refuse(findings: Sequence[Finding]) -> None:
    """Report what was found, up to an error, which ends it."""
    for finding in findings:
        checked((finding,))
        say(finding_text(finding), mark=finding.severity.value)


def stage_bars() -> Stage:
    """A bar for each stage; the nulls take most of the time."""
    import sys

    from tqdm import tqdm

    bars: dict[str, tqdm] = {}
    interval = 0.2 if sys.stderr.isatty() else 10.0  # a log file gets a line now and then, not an animation

    def advance(what: str, done: int, total: int) -> None:
        if what not in bars:
            bars[what] = tqdm(
                total=total, desc=printable(what), unit="part", ncols=100, mininterval=interval, file=sys.stderr
            )
        bars[what].update(done - bars[what].n)
        if done >= total:
            bars[what].close()

    return advance
