"""`flagdata simulate`: a recipe or a scene into mesh sequences of the lake."""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from flagdata.console import document, echo, in_steps, json_option, lake_option, progress, say
from flagdata.printable import counted

if TYPE_CHECKING:
    from sim.run import RunReport


@click.command()
@click.argument("recipe", metavar="RECIPE")
@click.option("--count", type=click.IntRange(min=1), metavar="N", help="How many members, instead of the recipe's.")
@click.option("--batch", type=click.IntRange(min=1), metavar="N", help="How many at a time, instead of the recipe's.")
@click.option("--device", default="cpu", show_default=True, help="Where to compute: cpu, cuda, cuda:1.")
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    metavar="N",
    help="Batches at a time; by default one for each core.",
)
@click.option("--branch", default="main", show_default=True, help="The line of work to commit on.")
@json_option
@lake_option
def simulate(
    recipe: str,
    count: int | None,
    batch: int | None,
    device: str,
    workers: int | None,
    branch: str,
    as_json: bool,
    lake_path: str,
) -> None:
    """Simulate cloth in the wind: mesh sequences, with their parameters, seeds and energies.

    RECIPE is a TOML file, a recipe of the catalog by name, an ArcSim scene (.json), which is run with ArcSim's own
    steps, or a model of the lake by its name or id, as closing the loop leaves them.

    Each batch is one commit: a run that is stopped goes on with what is missing when the command is given again. On
    one machine the same recipe, seed and index give the same bits, whatever runs beside. A member that diverges or
    crumples is reported and not stored, and the command ends with 1.

    \b
      flagdata simulate flag-search-space --lake lake --count 200
      flagdata simulate my-flag.toml --lake lake --batch 64 --device cuda
    """
    from flagdata.lake import Lake
    from flagdata.lake.merging import added_since
    from sim.run import simulate as run
    from sim.run.models import load

    lake = Lake.open(lake_path)
    lake.check_writable()
    loaded = load(recipe, lake, branch=branch)
    loaded = replace(loaded, count=count or loaded.count, batch=batch or loaded.batch)
    steps = in_steps(added_since(lake, branch))
    with steps, progress(loaded.count, label=loaded.name, unit="flag") as advance:
        report = run(lake, loaded, branch=branch, device=device, workers=workers or _cores(device), progress=advance)
    if as_json:
        document("simulate", {"lake": str(lake.path), "recipe": loaded.name, **report.as_dict()})
    else:
        _print(report)
    if report.failed:
        sys.exit(1)


def _cores(device: str) -> int:
    """Counts the cores that the process may use; 1 on any other device, which takes one batch at a time."""
    if not device.startswith("cpu"):
        return 1
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _print(report: RunReport) -> None:
    from flagdata.lake.healing import said

    for artifact in report.added:
        echo(artifact)
    for artifact, how in report.healed.items():
        echo(said(artifact, how))
    for failure in report.failed:
        say(f"member {failure['index']} is not stored: {failure['kind']}: {failure['what']}")
    steps = [f"{step * 1e3:.3g}" for step in sorted(report.steps.values())]
    speed = f"{report.rate:.2f} flags/s, steps of {'–'.join(dict.fromkeys((steps[0], steps[-1])))} ms"
    replaced = f", {counted(len(report.healed), 'damaged or missing object')} replaced" if report.healed else ""
    say(
        f"{len(report.added) + len(report.healed)} simulated in {report.seconds:.1f} s ({speed}), "
        f"{len(report.existing)} in the lake already, {len(report.failed)} failed{replaced}"
    )
