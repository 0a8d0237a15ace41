"""`flagdata demo`: the main job end to end on data made on the spot, by the same commands a user
types."""

from __future__ import annotations

import time
from enum import StrEnum
from pathlib import Path

import click

from flagdata.core.console import LocalPath, document, say
from flagdata.errors import UsageError
from flagdata.verbs.verb_options import AsJson, command, option, options
from measure.demo.demo_cards import demonstration_answer
from measure.demo.transcript import Transcript

SCHEMA = "flagdata.demo/1"
"""Of its folder's manifest."""


class Story(StrEnum):
    """What is shown."""

    SHORT = "short"
    """A film and a log, put on one clock, and the wind that is read off the film."""
    FULL = "full"
    """The same, then the cloth weighed, and what its model lacks found, from that film."""
    MARKERS = "markers"
    """A tracked flag, and what the model of it lacks."""


MINUTES = {Story.SHORT: 3, Story.FULL: 10, Story.MARKERS: 5}
"""That each takes at most on two idle cores."""


@options
class Showing(AsJson):
    """What is shown, and where the pages go."""

    out: Path = option(
        "Folder for the pages and the data. What an earlier demonstration wrote there is replaced, "
        "unless it was "
        "changed or anything else lies beside it.",
        default=Path("out/demo"),
        type=LocalPath(),
    )
    seed: int = option("Seed of all that is random.", default=2026, type=click.IntRange(min=0))
    full: bool = option(
        "Then weigh the cloth and find what its model lacks, from the same film; 10 minutes at "
        "most.",
        default=False,
    )
    markers: bool = option(
        "Instead find what the model of another flag lacks, from tracked markers; 5 minutes at "
        "most.",
        default=False,
    )

    def __post_init__(self) -> None:
        if self.full and self.markers:
            raise UsageError(
                "--full cannot be combined with --markers",
                fix="show one after the other, each in a folder of its own",
            )

    @property
    def story(self) -> Story:
        """The demonstration that is shown."""
        return Story.MARKERS if self.markers else Story.FULL if self.full else Story.SHORT


@command(Showing)
def demo(chosen: Showing) -> None:
    """Film a simulated flag beside an anemometer, on which something acts that no file states, and
    take the two files through the steps of a recording of one's own, to pages to open.

    The folder appears with the last of its files; its manifest.json lists them all. Running the
    demonstration again removes exactly what is listed there and is as it was written.
    """
    from flagdata.core.files.outputs import fresh_folder

    # FOLD
    from measure.demo.story import field_steps, loop_step, markers_step, weighing_step

    out, seed, story = chosen.out, chosen.seed, chosen.story
    began = time.monotonic()
    say(f"This takes up to {MINUTES[story]} minutes on two idle cores.")
    with fresh_folder(out, schema=SCHEMA) as scratch:
        shell = Transcript(folder=scratch, aside=chosen.as_json)
        shell.show("init", "lake")
        if story is Story.MARKERS:
            markers_step(shell, seed)
        else:
            recording = field_steps(shell, seed)
            if story is Story.FULL:
                weighing_step(shell, recording)
                loop_step(shell, recording)
        answer = demonstration_answer(shell.cards, seconds=time.monotonic() - began)
        (scratch / "index.html").write_text(answer.page, encoding="utf-8")
    if chosen.as_json:
        document("demo", {"page": str(out / "index.html")})
    else:
        say("")
        say(f"Open {out / 'index.html'}")
