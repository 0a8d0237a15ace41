"""Composition root of the command line: verbs as lazy "module:attribute" strings, so that --help
imports nothing."""

from __future__ import annotations

import io
import logging
import sys
import traceback
from importlib import import_module

import click
from click.shell_completion import CompletionItem

from flagdata.core.console import Aside, document, echo_lines, fail, foreseen, print_help, say
from flagdata.errors import UnknownNameError, UsageError

# group → what it is about, and its verbs: where the click command is, one line of help shown
# without importing it
GROUPS: dict[str, tuple[str, dict[str, tuple[str, str]]]] = {
    "field": (
        "recordings from the field",
        {
            "ingest": (
                "flagdata.commands.ingest:ingest",
                "Bring camera files, anemometer logs and mesh sequences in.",
            ),
            "align": (
                "flagdata.commands.align:align",
                "Put a camera and an anemometer, or two anemometers, on one clock.",
            ),
            "realign": (
                "flagdata.commands.align:realign",
                "Rewrite a recording with another clock model.",
            ),
            "declare": (
                "flagdata.commands.declare:declare",
                "State the constant wind of a film, as of a wind tunnel.",
            ),
            "declare-cloths": (
                "flagdata.commands.declare_cloths:declare_cloths",
                "Ingest films of measured cloths, by a table.",
            ),
            "recover": ("flagdata.commands.upkeep:recover", "Salvage a record that was cut off."),
        },
    ),
    "look": (
        "what a lake holds",
        {
            "ls": ("flagdata.commands.list_artifacts:ls", "List artifacts."),
            "show": (
                "flagdata.commands.list_artifacts:show",
                "Show one artifact, its parents and its report.",
            ),
            "lineage": (
                "flagdata.commands.looking:lineage",
                "Show what an artifact was made from, and what from it.",
            ),
            "view": (
                "flagdata.commands.looking:view",
                "Look at a lake in the browser: artifacts, films beside winds, SQL.",
            ),
            "query": (
                "flagdata.commands.query:query",
                "Select rows of the catalog by filter or SQL.",
            ),
            "log": ("flagdata.commands.lake_versions:log", "List commits."),
            "diff": (
                "flagdata.commands.lake_versions:diff",
                "Rows and objects added and removed between two versions.",
            ),
            "du": (
                "flagdata.commands.looking:du",
                "Show what takes space, by kind and by version.",
            ),
            "catalog": (
                "flagdata.commands.catalog_names:catalog",
                "List the scenes, sensors, effects, materials, data sets and models by name.",
            ),
        },
    ),
    "physics": (
        "wind and cloth from recordings, and simulation",
        {
            "measure": (
                "measure.commands.measure:measure",
                "Measure wind and cloth from a film, with intervals, or refuse.",
            ),
            "observe": (
                "measure.commands.observe:observe",
                "Read droop, extension, speed and frequency off a film.",
            ),
            "calibrate": (
                "measure.commands.calibrate:calibrate",
                "Weigh a filmed flag's cloth with the log of the wind.",
            ),
            "close-loop": (
                "measure.commands.close_loop:close_loop",
                "Find what the model of a cloth lacks, and add it.",
            ),
            "propose": (
                "measure.commands.propose:propose",
                "Propose an effect that the library lacks, and test it.",
            ),
            "simulate": (
                "sim.run.simulate_command:simulate",
                "Simulate cloth in the wind: mesh sequences from a recipe or a scene.",
            ),
        },
    ),
    "learn": (
        "data sets and networks",
        {
            "build": (
                "sim.datasets.build_command:build",
                "Build a data set: sequences, their films, ground truth and a card.",
            ),
            "train": (
                "models.training.train_command:train",
                "Train a network on the clips of a lake, and commit it.",
            ),
            "evaluate": (
                "models.evaluation.evaluate_command:evaluate",
                "Evaluate trained networks on test clips, in one table.",
            ),
        },
    ),
    "lake": (
        "versions, copies and upkeep",
        {
            "init": ("flagdata.commands.lake_versions:init", "Create an empty lake."),
            "tag": (
                "flagdata.commands.lake_versions:tag",
                "Name a version for good, list or delete tags.",
            ),
            "branch": ("flagdata.commands.lake_versions:branch", "Begin, list or delete branches."),
            "merge": (
                "flagdata.commands.lake_versions:merge",
                "Commit on main what a branch changed.",
            ),
            "label": ("flagdata.commands.label:label", "Put columns of your own on artifacts."),
            "withdraw": (
                "flagdata.commands.lake_versions:withdraw",
                "Hide artifacts from a branch; tags still show them.",
            ),
            "export": (
                "flagdata.commands.export:export",
                (
                    "Write WebDataset, Parquet, LeRobot, Zarr, MP4 + CSV, MCAP, CSV of the wind or "
                    "OBJ folders."
                ),
            ),
            "push": ("flagdata.commands.transfer:push", "Move versions to another lake."),
            "pull": ("flagdata.commands.transfer:pull", "Bring versions of another lake in."),
            "clone": (
                "flagdata.commands.transfer:clone",
                "Make a lake with all versions of another.",
            ),
            "verify": ("flagdata.commands.upkeep:verify", "Re-hash every object."),
            "doctor": (
                "flagdata.commands.upkeep:doctor",
                "Find and explain what is wrong with a lake, or a data set.",
            ),
            "heal": (
                "flagdata.commands.upkeep:heal",
                "Take what is damaged or missing from a clone or a backup.",
            ),
            "gc": ("flagdata.commands.upkeep:gc", "Delete unreferenced files."),
            "expire": ("flagdata.commands.upkeep:expire", "Let old versions expire, with a trace."),
        },
    ),
    "project": (
        "this installation",
        {
            "demo": (
                "measure.demo.demo_command:demo",
                "Make a synthetic recording and run every step on it.",
            ),
            "blender-setup": (
                "sim.blender.blender_setup:blender_setup",
                "Make the environment that Blender renders in.",
            ),
            "completion": (
                "flagdata.commands.completion:completion",
                "Print the completion of commands for a shell.",
            ),
            "help": ("flagdata.commands.help:help_", "Show the help of flagdata, or of a command."),
        },
    ),
}

VERBS: dict[str, tuple[str, str]] = {
    verb: entry for _, verbs in GROUPS.values() for verb, entry in verbs.items()
}

# kind of name that has no recipe → what answers `flagdata catalog KIND NAME`
ANSWERED: dict[str, str] = {"effects": "measure.report.effect_answer:answer_effect"}
# what `flagdata catalog` lists → (where the names are, what takes one)
NAMES: dict[str, tuple[str, str]] = {
    "scenes": ("sim.run.simulation_toml:SCENES", "simulate RECIPE"),
    "materials": (
        "sim.cloth.material:MATERIALS",
        "close-loop --material, measure --material, [material] of a recipe",
    ),
    "effects": ("sim.effects:EFFECTS", "[effects] of a recipe"),
    "sensor-effects": ("sim.effects:SENSOR_EFFECTS", "[sensor] of a recipe"),
    "sensors": (
        "flagdata.ingest.anemometer.sensor_recipe:SENSORS",
        "ingest --sensor, close-loop --sensor",
    ),
    "log-formats": ("flagdata.ingest.anemometer.formats.log_formats:FORMATS", "ingest --as"),
    "datasets": ("sim.datasets.dataset_toml:DATASETS", "build RECIPE"),
    "renders": ("sim.render.render_prior:PRIORS", "[render] prior of a data set's recipe"),
    "training": ("models.training.training_recipe:TRAININGS", "train RECIPE"),
    "models": ("models.trained.estimator:SHIPPED", "measure --model, calibrate --model"),
    "exports": ("flagdata.export.export_plan:FORMATS", "export FORMAT"),
}

_HELP = "see the command's --help"


class LazyGroup(click.Group):
    """A group whose commands are imported when they are run.

    Attributes:
        groups: its commands, as `GROUPS` has those of flagdata.
        verbs: the same without groups.
        noun: what one is called in error messages.
    """

    groups = GROUPS
    verbs = VERBS
    noun = "command"

    def __init_subclass__(cls) -> None:
        cls.verbs = {
            verb: entry for _, verbs in cls.groups.values() for verb, entry in verbs.items()
        }

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.verbs)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in self.verbs:
            return None
        module, _, attribute = self.verbs[cmd_name][0].partition(":")
        verb = getattr(import_module(module), attribute)
        return verb if isinstance(verb, click.Command) else verb.command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and not args[0].startswith("-") and args[0] not in self.verbs:
            raise UnknownNameError.of(self.noun, args[0], self.verbs)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        for group, (title, verbs) in self.groups.items():
            with formatter.section(f"{group.capitalize()} ({title})"):
                formatter.write_dl([(verb, about) for verb, (_, about) in verbs.items()])

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        verbs = [
            CompletionItem(verb, help=about)
            for verb, (_, about) in self.verbs.items()
            if verb.startswith(incomplete)
        ]
        return [*verbs, *click.Command.shell_complete(self, ctx, incomplete)]


@click.group(
    cls=LazyGroup,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.option(
    "--debug",
    is_flag=True,
    envvar="FLAGDATA_DEBUG",
    help="Show the traceback of an error; also FLAGDATA_DEBUG.",
)
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Print one JSON document, as --json after the command does.",
)
@click.version_option(package_name="flagdata")
@click.pass_context
def root(context: click.Context, debug: bool, as_json: bool) -> None:
    """Measure the physics of cloth in the wind from video and anemometer logs."""
    context.call_on_close(lambda: show_traceback() if debug else None)
    if context.invoked_subcommand is None:
        print_help(context, as_json=as_json)
    elif as_json:
        context.default_map = {context.invoked_subcommand: {"as_json": True}}


def show_traceback() -> None:
    """Show the traceback of the error that ends the command, if one does."""
    if sys.exc_info()[0] not in (None, SystemExit, click.exceptions.Exit):
        echo_lines(traceback.format_exc(), aside=True)


def main(
    arguments: list[str] | None = None, *, command: click.Group = root, name: str = "flagdata"
) -> None:
    """Run a command line and exit: 0 done, 1 failed, 2 usage, 3 refused: the data fail a quality
    check."""
    words = sys.argv[1:] if arguments is None else arguments
    log = logging.getLogger("flagdata")
    if not any(isinstance(handler, Aside) for handler in log.handlers):
        log.addHandler(Aside())
    try:
        outcome = command.main(args=words, prog_name=name, standalone_mode=False)
    except click.ClickException as error:
        if "--json" in words:
            document(
                "error",
                {
                    "kind": UsageError.kind,
                    "what": error.format_message(),
                    "where": None,
                    "fix": _HELP,
                },
            )
        usage = io.StringIO()
        error.show(usage)
        echo_lines(usage.getvalue(), aside=True)
        sys.exit(error.exit_code)
    except (click.Abort, KeyboardInterrupt) as error:
        if isinstance(
            error.__cause__, EOFError
        ):  # of a file, which click takes for the end of the user's input
            sys.exit(fail(foreseen(error.__cause__), as_json="--json" in words))
        say("flagdata: interrupted")
        sys.exit(1)
    except Exception as error:  # noqa: BLE001  all errors are reported in one form
        sys.exit(fail(foreseen(error), as_json="--json" in words))
    sys.exit(
        outcome if isinstance(outcome, int) else 0
    )  # an int is what a command gave to Context.exit


if __name__ == "__main__":
    main()
