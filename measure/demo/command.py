"""`flagdata demo`: the main job end to end on data made on the spot, by the same commands a user types."""

from __future__ import annotations

import time
from enum import StrEnum
from pathlib import Path

import click

from flagdata.console import LocalPath, document, json_option, say
from measure.demo.cards import Truth
from measure.demo.transcript import Transcript

SHORTEST = 3.0
"""Length of the shortest film [min]: an alignment needs two minutes beside the log, and loses some to the log's gap."""
SCHEMA = "flagdata.demo/1"
"""Of its folder's manifest."""


class Part(StrEnum):
    """What is shown."""

    ALL = "all"
    FIELD = "field"
    """A film and a log, put on one clock, and the wind that is read off the film."""
    LOOP = "loop"
    """A tracked flag, and what the model of it lacks."""


@click.command()
@click.option(
    "--out",
    "out",
    type=LocalPath(),
    default=Path("out/demo"),
    show_default=True,
    help="Folder for the pages and the data. What an earlier demonstration wrote there is replaced, unless it was "
    "changed or anything else lies beside it.",
)
@click.option("--seed", type=click.IntRange(min=0), default=2026, show_default=True, help="Seed of all that is random.")
@click.option(
    "--minutes",
    type=click.FloatRange(SHORTEST, 120),
    default=4.0,
    show_default=True,
    help="Length of the film it makes.",
)
@click.option(
    "--part",
    type=click.Choice([p.value for p in Part]),
    default=Part.ALL.value,
    show_default=True,
    help="What to show.",
)
@json_option
def demo(out: Path, seed: int, minutes: float, part: str, as_json: bool) -> None:
    """Film a simulated flag beside an anemometer, on which something acts that no file states, and take the two files
    through every step, to pages to open.

    The folder appears with the last of its files; its manifest.json lists them all. Running the demonstration again
    removes exactly what is listed there and is as it was written.
    """
    from flagdata.outputs import fresh_folder
    from measure.demo.index import write_index
    from measure.demo.story import field_steps, loop_step, weighing_step

    parts = (Part.FIELD, Part.LOOP) if part == Part.ALL else (Part(part),)
    began = time.monotonic()
    say(f"This takes about {_expected(minutes, part):.0f} minutes on two idle cores.")
    truths: list[Truth] = []
    with fresh_folder(out, schema=SCHEMA) as scratch:
        shell = Transcript(folder=scratch, aside=as_json)
        shell.show("init", "lake")
        if Part.FIELD in parts:
            recording = field_steps(shell, seed, minutes * 60, truths)
            if part == Part.ALL:
                weighing_step(shell, recording, truths)
        if Part.LOOP in parts:
            loop_step(shell, seed, truths)
        write_index(scratch, shell.cards, truths, seconds=time.monotonic() - began)
    if as_json:
        document("demo", {"page": str(out / "index.html")})
    else:
        say(f"\nOpen {out / 'index.html'}")


def _expected(minutes: float, part: str) -> float:
    """Minutes that it takes on two idle cores, as measured."""
    field, weighing, loop = 1.0 + 0.5 * minutes, 1.5, 2.5
    return {Part.ALL: field + weighing + loop, Part.FIELD: field, Part.LOOP: loop}[Part(part)]
