"""`flagdata build`: a data set's recipe into a lake."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from flagdata.api.learning import Building
from flagdata.core.console import echo, following, in_steps, progress, say, say_beside_bars, table
from flagdata.core.files.addresses import lake_place
from flagdata.core.json_values import json_values
from flagdata.core.printable import count_of
from flagdata.verbs.verb_options import Result, verb

if TYPE_CHECKING:
    from flagdata.lake import Lake
    from sim.datasets.build_plan import Plan


@verb(Building, example='flagdata.build("flagsim-small", lake="lake", workers=2)')
def build(chosen: Building) -> Iterator[Result]:
    """Build a data set: simulate its sequences, film them, and lay both into the lake with their
    ground truth.

    RECIPE is a TOML file, or a recipe of the catalog: flagsim, flagsim-small, clothsim, field,
    outdoor (`flagdata catalog datasets NAME` prints one to copy). --sequences and --films change
    how many are made: the data set is then called after the counts. The lake is made if there is
    none.

    Builds of several machines each make a part, --shard 1/4 to 4/4, on branches that flagdata merge
    brings together; the same command without --shard then writes the card.

    A build that was stopped or killed goes on where its last commit was when the command is given
    again, and ends with the same objects. At the end the data set's card, an HTML page, is written
    into the lake's folder cards.

    \b
      flagdata build flagsim-small --lake lake --plan
      flagdata build flagsim-small --lake lake
      flagdata build flagsim-small --sequences 100 --films 500 --lake lake
      flagdata build flagsim --lake /shared/lake --scheduler tcp://10.0.0.1:8786
    """
    from flagdata.errors import UsageError
    from sim.datasets.dataset_recipe import with_counts
    from sim.datasets.dataset_toml import load, with_renderer
    from sim.datasets.shard import Shard

    branch, device, scheduler = chosen.branch, chosen.device, chosen.scheduler
    loaded = load(str(chosen.recipe))
    if chosen.renderer is not None:
        loaded = with_renderer(loaded, chosen.renderer)
    shard = None if chosen.shard is None else Shard.parse(chosen.shard)
    loaded = with_counts(loaded, sequences=chosen.sequences, films=chosen.films)
    if shard is not None and chosen.card is not None:
        raise UsageError("a shard has no card", where="--card", fix="leave --card out")
    if scheduler is not None and chosen.workers is not None:
        raise UsageError("--workers with --scheduler", fix="start more workers at the scheduler")
    lake = _lake(chosen)
    if chosen.plan:
        from sim.datasets.build_plan import plan

        planned = plan(
            loaded, lake, workers=_workers(chosen), branch=branch, device=device, shard=shard
        )
        yield Result("build-plan", json_values(planned))
        _print_plan(planned)
        return

    from flagdata.lake.merging import added_since
    from sim.datasets import card as cards
    from sim.datasets.build import Build
    from sim.datasets.build_plan import length
    from sim.workers import connect_workers

    cards.check(chosen.card)
    lake = lake or _made(str(chosen.lake))
    lake.check_writable()
    lasting = length(
        loaded, lake, workers=_workers(chosen), branch=branch, device=device, shard=shard
    )
    if lasting is not None:
        say(lasting)
    with (
        in_steps(added_since(lake, branch)),
        connect_workers(scheduler, workers=chosen.processes, say=say_beside_bars) as workers,
    ):
        report = Build(
            lake=lake,
            recipe=loaded,
            workers=workers,
            bars=progress,
            branch=branch,
            device=device,
            shard=shard,
        ).run()
    written = None
    if shard is None:
        with following(f"the data set {loaded.name}", "writing its card"):
            written = str(cards.write_card(lake, loaded, branch=branch, path=chosen.card))
    yield Result(
        "build", {"lake": str(lake.path), "recipe": loaded.name, "card": written, **vars(report)}
    )
    for failure in report.failed:
        say(f"replaced: {failure}")
    replaced = (
        f"; {count_of(report.healed, 'damaged or missing object')} replaced"
        if report.healed
        else ""
    )
    say(
        f"{report.new_sequences} of {report.sequences} sequences and {report.new_films} of "
        f"{report.films} films made "
        f"in {report.seconds:.0f} s; {report.clips} clips{replaced}"
    )
    if written is not None:
        echo(written)


def _lake(chosen: Building) -> Lake | None:
    """Opens the lake; returns None where nothing is at its path."""
    if isinstance(chosen.lake, str | Path):
        location = lake_place(chosen.lake)
        if not (any(True for _ in location.iterdir()) if location.is_dir() else location.exists()):
            return None
    return chosen.opened()


def _made(path: str) -> Lake:
    from flagdata.lake import Lake

    say(f"making a lake in {path}")
    return Lake.create(path)


def _workers(chosen: Building) -> int:
    if chosen.scheduler is None:
        return chosen.processes
    from sim.workers import connect_workers

    with connect_workers(chosen.scheduler, workers=0) as workers:
        return max(1, workers.count)


def _print_plan(planned: Plan) -> None:
    sides = list(planned.sequences)
    rows = [
        (side, planned.sequences[side], planned.films[side], planned.clips[side]) for side in sides
    ]
    totals = (
        "all",
        *(sum(counts.values()) for counts in (planned.sequences, planned.films, planned.clips)),
    )
    table(("side", "sequences", "films", "clips"), [*rows, totals])
    rates = planned.rates
    say(
        f"to be made: {planned.missing_sequences} sequences and {planned.missing_films} films, "
        f"{planned.size / 1e9:.2f} GB, {planned.hours:.2f} h on {planned.workers} workers"
    )
    say(
        f"measured here: {rates.sequence_seconds:.2f} s and {rates.sequence_bytes / 1e6:.2f} MB a "
        "sequence, "
        f"{rates.film_seconds:.2f} s and {rates.film_bytes / 1e6:.2f} MB a film "
        f"({planned.recipe.renderer})"
    )
