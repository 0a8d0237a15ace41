"""Composition root of the command line: verbs as lazy "module:attribute" strings, so that --help imports nothing."""

from __future__ import annotations

import sys
import traceback
from importlib import import_module

import click

from flagdata.console import document, fail, foreseen
from flagdata.errors import UnknownNameError, UsageError

# verb → (where its click command is, one line of help shown without importing it)
VERBS: dict[str, tuple[str, str]] = {
    "init": ("flagdata.commands.lake:init", "Create an empty lake."),
    "ingest": ("flagdata.commands.ingest:ingest", "Bring camera files, anemometer logs and mesh sequences in."),
    "align": ("flagdata.commands.align:align", "Put a camera and an anemometer, or two anemometers, on one clock."),
    "declare": ("flagdata.commands.declare:declare", "State the constant wind of a film, as of a wind tunnel."),
    "declare-cloths": (
        "flagdata.commands.declare_cloths:declare_cloths",
        "Ingest films of measured cloths, by a table.",
    ),
    "realign": ("flagdata.commands.align:realign", "Rewrite a recording with another clock model."),
    "simulate": ("sim.commands:simulate", "Simulate cloth in the wind: mesh sequences from a recipe or a scene."),
    "build": ("sim.datasets.command:build", "Build a data set: sequences, their films, ground truth and a card."),
    "train": ("models.training.command:train", "Train a network on the clips of a lake, and commit it."),
    "evaluate": ("models.evaluation.command:evaluate", "Evaluate trained networks on test clips, in one table."),
    "measure": ("measure.estimate.command:measure", "Measure wind and cloth from a film, with intervals, or refuse."),
    "observe": ("measure.observables.command:observe", "Read droop, extension, speed and frequency off a film."),
    "calibrate": ("measure.calibrate.command:calibrate", "Weigh a filmed flag's cloth with the log of the wind."),
    "close-loop": ("measure.closing.command:close_loop", "Find what the model of a cloth lacks, and add it."),
    "propose": ("measure.propose.command:propose", "Propose an effect that the library lacks, and test it."),
    "ls": ("flagdata.commands.lake:ls", "List artifacts."),
    "show": ("flagdata.commands.lake:show", "Show one artifact, its parents and its report."),
    "lineage": ("flagdata.commands.looking:lineage", "Show what an artifact was made from, and what from it."),
    "view": ("flagdata.commands.looking:view", "Look at a lake in the browser: artifacts, films beside winds, SQL."),
    "log": ("flagdata.commands.lake:log", "List commits."),
    "tag": ("flagdata.commands.lake:tag", "Name a version for good, list or delete tags."),
    "branch": ("flagdata.commands.lake:branch", "Begin, list or delete branches."),
    "merge": ("flagdata.commands.lake:merge", "Commit on main what a branch changed."),
    "diff": ("flagdata.commands.lake:diff", "Rows and objects added and removed between two versions."),
    "label": ("flagdata.commands.label:label", "Put columns of your own on artifacts."),
    "withdraw": ("flagdata.commands.lake:withdraw", "Hide artifacts from a branch; tags still show them."),
    "query": ("flagdata.commands.query:query", "Select rows of the catalog by filter or SQL."),
    "export": (
        "flagdata.commands.export:export",
        "Write WebDataset, Parquet, LeRobot, Zarr, MP4 + CSV, MCAP, CSV of the wind or OBJ folders.",
    ),
    "push": ("flagdata.commands.transfer:push", "Move versions to another lake."),
    "pull": ("flagdata.commands.transfer:pull", "Bring versions of another lake in."),
    "clone": ("flagdata.commands.transfer:clone", "Make a lake with all versions of another."),
    "verify": ("flagdata.commands.upkeep:verify", "Re-hash every object."),
    "doctor": ("flagdata.commands.upkeep:doctor", "Find and explain what is wrong with a lake, or a data set."),
    "du": ("flagdata.commands.looking:du", "Show what takes space, by kind and by version."),
    "gc": ("flagdata.commands.upkeep:gc", "Delete unreferenced files."),
    "expire": ("flagdata.commands.upkeep:expire", "Let old versions expire, with a trace."),
    "recover": ("flagdata.commands.upkeep:recover", "Salvage a record that was cut off."),
    "challenge": ("measure.challenge.command:challenge", "Benchmark close-loop on blind data sets."),
    "blender-setup": ("sim.blender.command:blender_setup", "Make the environment that Blender renders in."),
    "demo": ("measure.demo.command:demo", "Make a synthetic recording and run every step on it."),
}

_HELP = "see the command's --help"


class LazyGroup(click.Group):
    """A group whose commands are imported when they are run."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in VERBS:
            return None
        module, _, attribute = VERBS[cmd_name][0].partition(":")
        return getattr(import_module(module), attribute)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and not args[0].startswith("-") and args[0] not in VERBS:
            raise UnknownNameError.of("command", args[0], VERBS)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(verb, about) for verb, (_, about) in VERBS.items()])


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--debug", is_flag=True, envvar="FLAGDATA_DEBUG", help="Show the traceback of an error; also FLAGDATA_DEBUG."
)
@click.version_option(package_name="flagdata")
@click.pass_context
def root(context: click.Context, debug: bool) -> None:
    """Measure the physics of cloth in the wind from video and anemometer logs."""
    context.call_on_close(lambda: _show_traceback() if debug else None)


def _show_traceback() -> None:
    """Show the traceback of the error that ends the command, if one does."""
    if sys.exc_info()[0] not in (None, SystemExit, click.exceptions.Exit):
        traceback.print_exc()


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 1 failed, 2 usage, 3 a gate not met."""
    given = sys.argv[1:] if arguments is None else arguments
    try:
        outcome = root.main(args=given, prog_name="flagdata", standalone_mode=False)
    except click.ClickException as error:
        if "--json" in given:
            document("error", {"kind": UsageError.kind, "what": error.format_message(), "where": None, "fix": _HELP})
        error.show()
        sys.exit(error.exit_code)
    except (click.Abort, KeyboardInterrupt) as error:
        if isinstance(error.__cause__, EOFError):  # of a file, which click takes for the end of the user's input
            sys.exit(fail(foreseen(error.__cause__), as_json="--json" in given))
        click.echo("flagdata: interrupted", err=True)
        sys.exit(1)
    except Exception as error:  # noqa: BLE001  all errors are reported in one form
        sys.exit(fail(foreseen(error), as_json="--json" in given))
    sys.exit(outcome if isinstance(outcome, int) else 0)  # an int is what a command gave to Context.exit


if __name__ == "__main__":
    main()
