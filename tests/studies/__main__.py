"""The one door to the studies: `python -m tests.studies NAME …`, from the root of a checkout."""

from __future__ import annotations

import os
import sys

import click

from flagdata.cli import LazyGroup, main, show_traceback

# group → what it is about, and its studies: "module:attribute" of a click command, or a module that is run by itself
GROUPS: dict[str, tuple[str, dict[str, tuple[str, str]]]] = {
    "grades": (
        "how good the product is",
        {
            "challenge": ("tests.studies.challenge.command:challenge", "Grade close-loop on blind data sets."),
            "dependence": ("tests.studies.dependence:main", "Measure how alike windows of one film err, for a card."),
        },
    ),
    "ships": (
        "what comes with the package, made anew",
        {
            "shipping": ("tests.studies.shipping:main", "Make a model of the trained networks of a lake."),
            "gate": ("tests.studies.gate:main", "Calibrate the gate of a model on the films of a lake."),
            "masks": ("tests.studies.masks.command:main", "Train the network of the cloth's mask."),
            "example": ("tests.studies.example:main", "Make the example film, its log and its truth."),
        },
    ),
    "runs": (
        "folders of tests with a command line of their own, to which all that follows is passed",
        {
            "validation": ("tests.validation", "Slow evidence, kept in docs/results."),
            "benchmarks": ("tests.benchmarks", "Speed, with accuracy beside it and a peer in the same run."),
            "failing": ("tests.failing.campaign", "Every call of every writing command fails in turn."),
            "failing-buckets": ("tests.failing.buckets", "Commands on a lake in a bucket that are killed."),
            "hostile": ("tests.hostile", "Hostile inputs of one kind, many times over."),
        },
    ),
}


class Studies(LazyGroup):
    """A group whose studies are imported, or whose folders of tests are started, when they are run."""

    groups = GROUPS
    noun = "study"

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Find the click command of a study, or make one that hands everything to a module."""
        module, about = self.verbs.get(cmd_name, (":", ""))
        return super().get_command(ctx, cmd_name) if ":" in module else _handed_on(cmd_name, module, about)


def _handed_on(name: str, module: str, about: str) -> click.Command:
    """Make a command that becomes `python -m MODULE`, with all words that follow it."""

    @click.command(name, help=about, add_help_option=False, context_settings={"ignore_unknown_options": True})
    @click.argument("words", nargs=-1, type=click.UNPROCESSED)
    def command(words: tuple[str, ...]) -> None:
        os.execv(sys.executable, [sys.executable, "-m", module, *words])

    return command


@click.group(cls=Studies, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--debug", is_flag=True, envvar="FLAGDATA_DEBUG", help="Show the traceback of an error.")
@click.pass_context
def studies(context: click.Context, debug: bool) -> None:
    """Grade the product, and make what it ships."""
    context.call_on_close(lambda: show_traceback() if debug else None)


if __name__ == "__main__":
    main(command=studies, name="python -m tests.studies")
