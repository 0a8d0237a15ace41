"""`flagdata demo`: the main job end to end on data made on the spot, by the same commands a user types."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
import time
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

import click

from flagdata.console import LocalPath, progress, say
from flagdata.errors import FlagdataError

SHORTEST = 3.0
"""Length of the shortest video [min]: camera and log must share two minutes, and the log has a gap and a reading that
sticks."""
SCHEMA = "flagdata.demo/1"
"""Of its folder's manifest."""


class Part(StrEnum):
    """What is shown."""

    ALL = "all"
    FIELD = "field"
    """A camera and an anemometer, put on one clock."""
    LOOP = "loop"
    """A tracked flag, and what the model of it lacks."""


@dataclass(kw_only=True)
class Transcript:
    """Runs verbs of the command line in a folder and keeps what was typed and printed."""

    folder: Path
    entries: list[tuple[str, str]] = field(default_factory=list)

    def run(self, *arguments: str) -> str:
        """Run `flagdata ARGUMENTS` in the folder; its stdout. What it says on stderr passes through.

        Raises:
            FlagdataError: when it does not exit with 0.
        """
        typed = shlex.join(("flagdata", *arguments))
        say(f"\n$ {typed}")
        done = subprocess.run(
            [sys.executable, "-m", "flagdata.cli", *arguments],
            cwd=self.folder,
            stdout=subprocess.PIPE,
            text=True,
            check=False,
        )
        if done.returncode:
            raise FlagdataError(
                f"`{typed}` ended with {done.returncode}", where="the demonstration", fix="see its message above"
            )
        printed = done.stdout.replace(
            f"{self.folder.absolute()}{os.sep}", ""
        )  # a folder that is named when it is whole
        self.entries.append((typed, printed))
        return printed

    def show(self, *arguments: str) -> str:
        """`run`, and its stdout printed for the person who watches."""
        printed = self.run(*arguments)
        click.echo(printed, nl=False)
        return printed

    def read(self, *arguments: str) -> dict[str, Any]:
        """`run` with --json, decoded; left out of the transcript, which is for people."""
        printed = json.loads(self.run(*arguments, "--json"))
        self.entries.pop()
        return printed


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
    default=10.0,
    show_default=True,
    help="Length of the video it makes.",
)
@click.option(
    "--part",
    type=click.Choice([p.value for p in Part]),
    default=Part.ALL.value,
    show_default=True,
    help="What to show.",
)
def demo(out: Path, seed: int, minutes: float, part: str) -> None:
    """Make a small field recording and a tracked flag, and take them through everything, to pages to open.

    The folder appears with the last of its files; its manifest.json lists them all. Running the demonstration again
    removes exactly what is listed there and is as it was written.
    """
    from flagdata.outputs import fresh_folder

    with fresh_folder(out, schema=SCHEMA) as scratch:
        shell = Transcript(folder=scratch)
        shell.show("init", "lake")
        pages: list[Path] = []
        if part != Part.LOOP:
            pages.append(_field(shell, seed, minutes))
        if part != Part.FIELD:
            pages.append(_loop(shell, seed))
    say("\nOpen " + " and ".join(str(out / page.relative_to(scratch)) for page in pages))


def _field(shell: Transcript, seed: int, minutes: float) -> Path:
    """From a video and a log to pairs; the page."""
    from measure.demo.field import FieldRecipe, make_field
    from measure.demo.page import write_page

    began, out = time.monotonic(), shell.folder
    recipe = FieldRecipe(seed=seed, duration=minutes * 60)
    say(f"A flag is filmed for {minutes:g} minutes; an anemometer runs beside it on a clock of its own.")
    with progress(round(recipe.duration * recipe.frame_rate), label="filming", unit="frame") as advance:
        made = make_field(recipe, out, advance=advance)
    shell.show("ingest", "flag.mp4", "--crop", "auto", "--session", "demo", "--lake", "lake")
    shell.show(
        "ingest", "anemometer.csv", "--sensor", "cup-logger.toml", "--zone", "+02:00", "--session", "demo",
        "--lake", "lake",
    )  # fmt: skip
    artifacts = {row["kind"]: row["artifact"] for row in shell.read("ls", "--lake", "lake")["artifacts"]}
    shell.show(
        "align", artifacts["camera"][:10], artifacts["wind"][:10], "--by", "estimate", "--plot", "alignment.png",
        "--lake", "lake",
    )  # fmt: skip
    shell.show("tag", "demo", "--lake", "lake")
    shell.show("ls", "--lake", "lake")
    shell.show("query", "--where", "kind = 'clip' and wind between 4 and 6", "--limit", "5", "--at", "demo",
               "--lake", "lake")  # fmt: skip
    shell.show("verify", "--lake", "lake")
    return write_page(out, made=made, at="demo", transcript=shell.entries, seconds=time.monotonic() - began)


def _loop(shell: Transcript, seed: int) -> Path:
    """From tracked markers to what the model of the cloth lacks; the report before and after."""
    from measure.demo.tracked import TrackedRecipe, make_tracks

    recipe = TrackedRecipe(seed=seed)
    winds = " and ".join(f"{speed:g}" for speed in recipe.speeds)
    say(f"\nMarkers of a flag are tracked in winds of {winds} m/s; something acts on it that no file declares.")
    frames = round((recipe.settle + recipe.duration) * recipe.rate)
    with progress(frames, label="tracking", unit="frame") as advance:
        made = make_tracks(recipe, shell.folder, advance=advance)
    shell.show("close-loop", "--recipe", made.recipe.name, "--lake", "lake", "--out", "loop")
    models = [row["name"] for row in shell.read("ls", "--kind", "model", "--lake", "lake")["artifacts"]]
    with_effects = [name for name in models if not name.endswith("-base")]
    shell.show("simulate", (with_effects or models)[0], "--lake", "lake")
    unit = "" if made.unit == "1" else f" {made.unit}"
    say(f"\nWhat acted was {made.effect}, {made.parameter} {made.strength:g}{unit}.")
    return shell.folder / "loop" / "report.html"
