"""The one door to the studies: `python -m tests.studies NAME …`, from the root of a checkout."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import click

from flagdata.cli import LazyGroup, main, show_traceback

# group → what it is about, and its studies: "module:attribute" of a click command, a module that
# has a command line of its own, or, in the groups of evidence, one with `run(*, seed, out)`
GROUPS: dict[str, tuple[str, dict[str, tuple[str, str]]]] = {
    "grades": (
        "how good the product is",
        {
            "challenge": (
                "tests.studies.challenge.command:challenge",
                "Grade close-loop on blind data sets.",
            ),
            "dependence": (
                "tests.studies.dependence:main",
                "Measure how alike windows of one film err, for a card.",
            ),
            "series-errors": (
                "tests.studies.series_errors:main",
                "Measure how a series of windows errs, for a card.",
            ),
            "yardsticks": (
                "tests.studies.yardsticks.command:yardsticks",
                "Judge networks beside a paper's yardsticks.",
            ),
            "validate": (
                "tests.studies.validation",
                "Run all slow evidence, one study after another.",
            ),
            "bench": ("tests.studies.benchmarks", "Run all benchmarks, one after another."),
        },
    ),
    "ships": (
        "what comes with the package, made anew",
        {
            "shipping": (
                "tests.studies.shipping:main",
                "Make a model of the trained networks of a lake.",
            ),
            "gate": (
                "tests.studies.gate:main",
                "Calibrate the gate of a model on the films of a lake.",
            ),
            "masks": ("tests.studies.masks.command:main", "Train the network of the cloth's mask."),
            "example": (
                "tests.studies.example:main",
                "Make the example film, its log and its truth.",
            ),
        },
    ),
    "evidence": (
        "slow, kept as validate-NAME.json",
        {
            "anemometer": (
                "tests.studies.validation.anemometer",
                "The flag as an anemometer: another day and flag.",
            ),
            "arcsim": ("tests.studies.validation.arcsim", "Beside ArcSim's runs of the same flag."),
            "arcsim-jittered": (
                "tests.studies.validation.arcsim_jittered",
                "Effects in ArcSim's runs, named or not.",
            ),
            "card-flag": (
                "tests.studies.validation.card_flag",
                "A camera and an anemometer that disagree.",
            ),
            "carried-cloth": (
                "tests.studies.validation.carried_cloth",
                "A verdict on a cloth that a robot swings.",
            ),
            "clock-recovery": (
                "tests.studies.validation.clock_recovery",
                "Hidden clock offsets and their intervals.",
            ),
            "cluster": (
                "tests.studies.validation.cluster",
                "A data set built by workers that are killed.",
            ),
            "datasets": (
                "tests.studies.validation.datasets",
                "A data set built, and built again after kills.",
            ),
            "directed": (
                "tests.studies.validation.directed",
                "What the test along the effects sees in sets of one design.",
            ),
            "drapes": (
                "tests.studies.validation.drapes",
                "Measured drapes of five fabrics, and their faces.",
            ),
            "films": (
                "tests.studies.validation.films",
                "What measure answers on ArcSim's films by VTK.",
            ),
            "flags": (
                "tests.studies.validation.flags",
                "Shapes and motion against wind, damping, method.",
            ),
            "flips": (
                "tests.studies.validation.flips",
                "Single bits that flip in what flagdata keeps.",
            ),
            "flutter": (
                "tests.studies.validation.flutter",
                "Where a sheet in a stream begins to flutter.",
            ),
            "foreign": (
                "tests.studies.validation.foreign",
                "Verdicts on MuJoCo's flags, nulls and effects.",
            ),
            "gate-clips": (
                "tests.studies.validation.gate",
                "How often the gate refuses 60 strange clips.",
            ),
            "gate-films": (
                "tests.studies.validation.gate_films",
                "What measure says of 78 films with a defect.",
            ),
            "hanging-cloth": (
                "tests.studies.validation.hanging_cloth",
                "Area weight of hanging cloths.",
            ),
            "hanging-weight": (
                "tests.studies.validation.hanging_weight",
                "Whether a film tells a cloth's weight.",
            ),
            "heavy-cloth": (
                "tests.studies.validation.heavy_cloth",
                "A flag of heavy cloth in ten looks.",
            ),
            "hostile": (
                "tests.studies.validation.hostile",
                "Hostile recipes, models, inputs, files and lakes.",
            ),
            "kinds": (
                "tests.studies.validation.kinds",
                "Two flags, and films upside down or on their side.",
            ),
            "lake-in-a-bucket": (
                "tests.studies.validation.lake_in_a_bucket",
                "The lake's tests, in a bucket.",
            ),
            "looks": (
                "tests.studies.validation.looks",
                "What lasts of the errors of films' observables.",
            ),
            "loop-on-films": (
                "tests.studies.validation.loop_on_films",
                "Verdicts on films of other numerics.",
            ),
            "measure-windows": (
                "tests.studies.validation.measure_windows",
                "Coverage of windows and films.",
            ),
            "no-flag": (
                "tests.studies.validation.no_flag",
                "Films of ten kinds without a flag on a pole.",
            ),
            "numerics": (
                "tests.studies.validation.numerics",
                "What meshes and steps do to a calibration.",
            ),
            "object-storage": (
                "tests.studies.validation.object_storage",
                "A bucket under kills and faults.",
            ),
            "observables": (
                "tests.studies.validation.observables",
                "What observables of films are off by.",
            ),
            "paper-flag": (
                "tests.studies.validation.paper_flag.validate",
                "The paper flag in the tunnel.",
            ),
            "power": ("tests.studies.validation.power", "Which observable shows which effect."),
            "real-flag": (
                "tests.studies.validation.real_flag",
                "A real flag, of which nobody knows the wind.",
            ),
            "real-flags": (
                "tests.studies.validation.real_flags.validate",
                "Published measurements of real flags.",
            ),
            "refinement": ("tests.studies.validation.refinement", "Refinement beside its peers."),
            "remeshing": (
                "tests.studies.validation.remeshing",
                "The paper's flag remeshed, beside ArcSim.",
            ),
            "renderers": (
                "tests.studies.validation.renderers",
                "Whether Cycles and the rasteriser agree.",
            ),
            "robot-cloth": (
                "tests.studies.validation.robot_cloth",
                "Cloth that a robot carries, beside tracks.",
            ),
            "stressors": (
                "tests.studies.validation.stressors",
                "Null experiments as a field brings them.",
            ),
            "ten-looks": (
                "tests.studies.validation.ten_looks",
                "One flag's motion filmed in ten looks.",
            ),
            "transfer": (
                "tests.studies.validation.transfer",
                "Estimates on clips that differ from training.",
            ),
            "weighed": ("tests.studies.validation.weighed", "The cloth of twenty flags weighed."),
            "weighed-briefly": (
                "tests.studies.validation.weighed_briefly",
                "The same from half a minute.",
            ),
            "wind-series": (
                "tests.studies.validation.wind_series",
                "Winds of gusty films by window, and gusts.",
            ),
            "verification": (
                "tests.studies.validation.verification",
                "Curves of theory and observed orders.",
            ),
        },
    ),
    "speed": (
        "with accuracy and a peer beside it, kept as bench-NAME.json",
        {
            "catalog": ("tests.studies.benchmarks.bench_catalog", "A catalog of a million rows."),
            "effects": (
                "tests.studies.benchmarks.bench_effects",
                "What each effect on the cloth costs.",
            ),
            "first-batch": (
                "tests.studies.benchmarks.bench_first_batch",
                "From a large lake to its first batch.",
            ),
            "lake": (
                "tests.studies.benchmarks.bench_lake",
                "Commits, catalog reads and mesh sequences.",
            ),
            "logs": (
                "tests.studies.benchmarks.bench_logs",
                "A day of a 20 Hz sonic, and a small log.",
            ),
            "measure": (
                "tests.studies.benchmarks.bench_measure",
                "What an answer costs, by stage.",
            ),
            "models": ("tests.studies.benchmarks.bench_models", "What a clip costs in a network."),
            "newcomer": (
                "tests.studies.benchmarks.bench_newcomer",
                "From a clean clone to a first answer.",
            ),
            "pairs": ("tests.studies.benchmarks.bench_pairs", "Clips a second out of a lake."),
            "peers": ("tests.studies.benchmarks.bench_peers", "The same clips by other programs."),
            "records": (
                "tests.studies.benchmarks.bench_records",
                "Random clips out of one record.",
            ),
            "render": ("tests.studies.benchmarks.bench_render", "The renderers on one core."),
            "sim": ("tests.studies.benchmarks.bench_sim", "The simulator on one core."),
            "sim-cost": (
                "tests.studies.benchmarks.bench_sim_cost",
                "What its time and memory grow with.",
            ),
            "start": (
                "tests.studies.benchmarks.bench_start",
                "What the program takes before its work.",
            ),
            "storage": (
                "tests.studies.benchmarks.bench_storage",
                "Records in a bucket: bytes and requests.",
            ),
            "verdict": ("tests.studies.benchmarks.bench_verdict", "What a verdict costs."),
        },
    ),
    "graphics": (
        "as speed, on an NVIDIA processor; bench leaves it out",
        {
            "sim-gpu": (
                "tests.studies.benchmarks.bench_sim_gpu",
                "The Warp kernel beside the compiled one.",
            )
        },
    ),
    "runs": (
        "with a command line of their own, to which all that follows is passed",
        {
            "environments": (
                "tests.studies.validation.environments",
                "Make an environment of another program.",
            ),
            "vtk-films": (
                "tests.studies.validation.vtk_films.making",
                "Make the films of the list that are missing.",
            ),
            "published-flags": (
                "tests.studies.validation.real_flags",
                "Predict published numbers of flags.",
            ),
            "log-transcripts": (
                "tests.studies.validation.log_transcripts",
                "Ingest ten logs as a new user does.",
            ),
            "logs-oracle": (
                "tests.studies.validation.logs_oracle",
                "Compare readings of logs with a commit's.",
            ),
            "messages": (
                "tests.studies.validation.messages",
                "Draw messages and help texts to be read.",
            ),
            "failing": (
                "tests.studies.failing.campaign",
                "Every call of every writing command fails in turn.",
            ),
            "failing-buckets": (
                "tests.studies.failing.buckets",
                "Commands on a lake in a bucket that are killed.",
            ),
            "power-cut": (
                "tests.studies.failing.power_cut",
                "Power cuts beside every verb that writes.",
            ),
            "state-machine": (
                "tests.studies.failing.sequences",
                "Lakes beside a plain model, with kills.",
            ),
            "flips-drawn": (
                "tests.studies.hostile.flips",
                "Flip as many single bits as are asked for.",
            ),
        },
    ),
}
KINDS = {"evidence": "validate", "speed": "bench", "graphics": "bench"}
"""The first part of the files' names, of groups whose modules have a function `run`."""
ALL = {"validate": "evidence", "bench": "speed"}
"""Studies that run all of a group."""
FILES = {"gate-clips": "gate"}
"""Names in files of studies whose own name is another's."""


class Studies(LazyGroup):
    """A group whose studies are imported, or started, when they are run."""

    groups = GROUPS
    noun = "study"

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Find the click command of a study, or make one of its module."""
        module, about = self.verbs.get(cmd_name, (":", ""))
        if ":" in module:
            return super().get_command(ctx, cmd_name)
        if cmd_name in ALL:
            group = ALL[cmd_name]
            return _evidence(
                cmd_name,
                {study: of for study, (of, _) in GROUPS[group][1].items()},
                KINDS[group],
                about,
            )
        (group,) = (group for group, (_, studies) in GROUPS.items() if cmd_name in studies)
        if group in KINDS:
            return _evidence(cmd_name, {cmd_name: module}, KINDS[group], about)
        return _handed_on(cmd_name, module, about)


def _evidence(name: str, modules: dict[str, str], kind: str, about: str) -> click.Command:
    """Make a command that runs modules in turn and keeps what each returns as KIND-NAME.json."""

    @click.command(name, help=about)
    @click.option(
        "--out",
        type=click.Path(file_okay=False, path_type=Path),
        required=True,
        help="Folder of results.",
    )
    @click.option(
        "--seed", type=int, default=1, show_default=True, help="Seed of all that is drawn."
    )
    def command(out: Path, seed: int) -> None:
        from tests.evidence import keep

        for study, module in modules.items():
            keep(FILES.get(study, study), module, kind=kind, seed=seed, out=out)

    return command


def _handed_on(name: str, module: str, about: str) -> click.Command:
    """Make a command that becomes `python -m MODULE`, with all words that follow it."""

    @click.command(
        name, help=about, add_help_option=False, context_settings={"ignore_unknown_options": True}
    )
    @click.argument("words", nargs=-1, type=click.UNPROCESSED)
    def command(words: tuple[str, ...]) -> None:
        os.execv(sys.executable, [sys.executable, "-m", module, *words])

    return command


@click.group(cls=Studies, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--debug", is_flag=True, envvar="FLAGDATA_DEBUG", help="Show the traceback of an error."
)
@click.pass_context
def studies(context: click.Context, debug: bool) -> None:
    """Grade the product, and make what it ships."""
    context.call_on_close(lambda: show_traceback() if debug else None)


if __name__ == "__main__":
    main(command=studies, name="python -m tests.studies")
