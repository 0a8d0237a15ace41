"""`flagdata simulate`: a recipe or a scene into mesh sequences of the lake."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from flagdata.api.physics import Members
from flagdata.core.console import echo, in_steps, progress, say
from flagdata.core.json_values import json_values
from flagdata.core.printable import count_of
from flagdata.verbs.shared_options import Computed, OnBranch, OnLake
from flagdata.verbs.verb_options import Result, argument, options, verb

if TYPE_CHECKING:
    from sim.run import RunReport


@options
class SimulateCommand(Members, Computed, OnBranch, OnLake):
    """How many members of a recipe are simulated, and where they go."""

    recipe: str = argument("A recipe, a scene or a model.", "RECIPE")


@verb(SimulateCommand, example='flagdata.simulate("flag-gusts", count=4)')
def simulate(chosen: SimulateCommand) -> Iterator[Result]:
    """Simulate cloth in the wind: mesh sequences, with their parameters, seeds and energies.

    RECIPE is a TOML file, a recipe of the catalog by name, an ArcSim scene (.json), which is run
    with ArcSim's own steps, or a model of the lake by its name or id, as closing the loop leaves
    them.

    Each batch is one commit: a run that is stopped goes on with what is missing when the command is
    given again. On one machine the same recipe, seed and index give the same bits, whatever runs
    beside. A member that diverges or crumples is reported and not stored, and the command ends with
    1.

    \b
      flagdata simulate flag-search-space --lake lake --count 200
      flagdata simulate my-flag.toml --lake lake --batch 64 --device cuda
    """
    from flagdata.lake.merging import added_since
    from sim.run import simulate as run
    from sim.run.lake_models import load

    branch, device = chosen.branch, chosen.device
    lake = chosen.opened()
    lake.check_writable()
    loaded = load(chosen.recipe, lake, branch=branch)
    loaded = replace(loaded, count=chosen.count or loaded.count, batch=chosen.batch or loaded.batch)
    workers = (
        chosen.processes if device.startswith("cpu") else chosen.workers or 1
    )  # others take a batch at a time
    steps = in_steps(added_since(lake, branch))
    with steps, progress(loaded.count, label=loaded.name, unit="flag") as advance:
        report = run(lake, loaded, branch=branch, device=device, workers=workers, progress=advance)
    content = {"lake": str(lake.path), "recipe": loaded.name, **json_values(report)}
    yield Result("simulate", content, 1 if report.failed else 0)
    _print(report)


def _print(report: RunReport) -> None:
    from flagdata.lake.remaking import said

    for artifact in report.added:
        echo(artifact)
    for artifact, how in report.healed.items():
        echo(said(artifact, how))
    for failure in report.failed:
        say(f"member {failure['index']} is not stored: {failure['kind']}: {failure['what']}")
    steps = [f"{step * 1e3:.3g}" for step in sorted(report.steps.values())]
    speed = (
        f"{report.rate:.2f} flags/s, steps of {'–'.join(dict.fromkeys((steps[0], steps[-1])))} ms"
    )
    replaced = (
        f", {count_of(len(report.healed), 'damaged or missing object')} replaced"
        if report.healed
        else ""
    )
    say(
        f"{len(report.added) + len(report.healed)} simulated in {report.seconds:.1f} s ({speed}), "
        f"{len(report.existing)} in the lake already, {len(report.failed)} failed{replaced}"
    )
