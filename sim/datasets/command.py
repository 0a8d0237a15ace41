"""`flagdata build`: a data set's recipe into a lake."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import click

from flagdata.addresses import lake_place
from flagdata.console import (
    LocalPath,
    document,
    echo,
    following,
    in_steps,
    json_option,
    lake_option,
    progress,
    say,
    say_beside_bars,
    table,
)
from flagdata.printable import counted

if TYPE_CHECKING:
    from flagdata.lake import Lake
    from sim.datasets.plan import Plan


@click.command()
@click.argument("recipe", metavar="RECIPE")
@click.option("--plan", "only_plan", is_flag=True, help="Print counts, bytes and hours, and make nothing.")
@click.option("--scheduler", metavar="ADDRESS", help="A Dask scheduler, tcp://HOST:PORT; without it, this machine.")
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    metavar="N",
    help="Processes on this machine; by default one a core.",
)
@click.option("--renderer", metavar="NAME", help="raster, cycles or workbench, instead of the recipe's.")
@click.option("--device", default="cpu", show_default=True, help="Where workers compute: cpu, cuda.")
@click.option("--branch", default="main", show_default=True, help="The line of work to commit on.")
@click.option("--card", type=LocalPath(), metavar="FILE", help="Where the card goes; by default cards/.")
@json_option
@lake_option
def build(
    recipe: str,
    only_plan: bool,
    scheduler: str | None,
    workers: int | None,
    renderer: str | None,
    device: str,
    branch: str,
    card: Path | None,
    as_json: bool,
    lake_path: str,
) -> None:
    """Build a data set: simulate its sequences, film them, and lay both into the lake with their ground truth.

    RECIPE is a TOML file, or a recipe of the catalog: flagsim, flagsim-small, clothsim, field, outdoor. The lake is
    made if there is none.

    A build that was stopped or killed goes on where its last commit was when the command is given again, and ends with
    the same objects. At the end the data set's card, an HTML page, is written into the lake's folder cards.

    \b
      flagdata build flagsim-small --lake lake --plan
      flagdata build flagsim-small --lake lake
      flagdata build flagsim --lake /shared/lake --scheduler tcp://10.0.0.1:8786
    """
    from flagdata.errors import UsageError
    from sim.datasets.reading import load, with_renderer

    loaded = load(recipe)
    if renderer is not None:
        loaded = with_renderer(loaded, renderer)
    if scheduler is not None and workers is not None:
        raise UsageError("--workers with --scheduler", fix="start more workers at the scheduler")
    if only_plan:
        from sim.datasets.plan import plan

        planned = plan(loaded, _lake(lake_path), workers=_workers(scheduler, workers), branch=branch, device=device)
        if as_json:
            document("build-plan", planned.as_dict())
        else:
            _print_plan(planned)
        return

    from flagdata.lake.merging import added_since
    from sim.datasets import card as cards
    from sim.datasets.build import Build
    from sim.datasets.cluster import connected
    from sim.datasets.plan import length

    cards.check(card)
    lake = _lake(lake_path) or _made(lake_path)
    lake.check_writable()
    lasting = length(loaded, lake, workers=_workers(scheduler, workers), branch=branch, device=device)
    if lasting is not None:
        say(lasting)
    with in_steps(added_since(lake, branch)), connected(scheduler, workers=workers or _cores()) as client:
        report = Build(
            lake=lake, recipe=loaded, client=client, bars=progress, say=say_beside_bars, branch=branch, device=device
        ).run()
    written = None
    with following(f"the data set {loaded.name}", "writing its card"):
        written = str(cards.write_card(lake, loaded, branch=branch, path=card))
    if as_json:
        document("build", {"lake": str(lake.path), "recipe": loaded.name, "card": written, **vars(report)})
        return
    for failure in report.failed:
        say(f"replaced: {failure}")
    replaced = f"; {counted(report.healed, 'damaged or missing object')} replaced" if report.healed else ""
    say(
        f"{report.new_sequences} of {report.sequences} sequences and {report.new_films} of {report.films} films made "
        f"in {report.seconds:.0f} s; {report.clips} clips{replaced}"
    )
    if written is not None:
        echo(written)


def _lake(path: str) -> Lake | None:
    """Opens the lake at a path; None where nothing exists."""
    from flagdata.lake import Lake

    location = lake_place(path)
    if not (any(True for _ in location.iterdir()) if location.is_dir() else location.exists()):
        return None
    return Lake.open(location)


def _made(path: str) -> Lake:
    from flagdata.lake import Lake

    say(f"making a lake in {path}")
    return Lake.create(path)


def _workers(scheduler: str | None, workers: int | None) -> int:
    if scheduler is None:
        return workers or _cores()
    from sim.datasets.cluster import connected, threads

    with connected(scheduler, workers=0) as client:
        return max(1, threads(client))


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _print_plan(planned: Plan) -> None:
    sides = list(planned.sequences)
    rows = [(side, planned.sequences[side], planned.films[side], planned.clips[side]) for side in sides]
    totals = ("all", *(sum(counts.values()) for counts in (planned.sequences, planned.films, planned.clips)))
    table(("side", "sequences", "films", "clips"), [*rows, totals])
    rates = planned.rates
    say(
        f"to be made: {planned.missing_sequences} sequences and {planned.missing_films} films, "
        f"{planned.size / 1e9:.2f} GB, {planned.seconds / 3600:.2f} h on {planned.workers} workers"
    )
    say(
        f"measured here: {rates.sequence_seconds:.2f} s and {rates.sequence_bytes / 1e6:.2f} MB a sequence, "
        f"{rates.film_seconds:.2f} s and {rates.film_bytes / 1e6:.2f} MB a film ({planned.recipe.renderer})"
    )
