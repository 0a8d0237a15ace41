"""`python -m tests.studies challenge make | bank | run | score`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from flagdata.core.console import LakePlace, LocalPath, document, echo, echo_lines, progress, say
from flagdata.errors import UsageError

if TYPE_CHECKING:
    from flagdata.storage import Place
    from tests.studies.challenge.filing import Filing

_FOLDER = click.argument("folder", metavar="DIR", type=LocalPath())
json_option = click.option("--json", "as_json", is_flag=True, help="One JSON document on stdout.")
_ONLY = click.option(
    "--only", multiple=True, metavar="SET", help="Take this set only; may be repeated."
)


@click.group()
def challenge() -> None:
    """Benchmark close-loop on recordings whose true effect is hidden.

    Keys are opened by `score` alone, and only of sets whose verdict is filed. Until then
    `challenge.json` holds a hash of each.

    \b
      python -m tests.studies challenge make out/challenge --seed 7 --sets 60 --workers 2
      python -m tests.studies challenge make out/films --recipe films --seed 7 --sets 40 --workers 2
      python -m tests.studies challenge bank out/bank --sets out/challenge --seed 8 --workers 2
      python -m tests.studies challenge run out/challenge --bank out/bank --workers 2
      python -m tests.studies challenge score out/challenge --out docs/results
    """


@challenge.command()
@_FOLDER
@click.option(
    "--recipe",
    default="standard",
    show_default=True,
    help="Recipe: a name of the catalog, or a .toml file.",
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    required=True,
    help="Seed of everything that is drawn; keep it secret.",
)
@click.option(
    "--sets",
    "count",
    type=click.IntRange(min=1),
    default=60,
    show_default=True,
    help="Number of sets.",
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    help="Number of processes that simulate.",
)
@json_option
def make(folder: Path, recipe: str, seed: int, count: int, workers: int, as_json: bool) -> None:
    """Draw keys, simulate, and write sealed data sets into a new folder; one that was stopped goes
    on."""
    from flagdata.core.workload import announce_work
    from tests.studies.challenge.make import make as make_challenge
    from tests.studies.challenge.make import workload
    from tests.studies.challenge.recipe import load

    loaded = load(recipe)
    say(announce_work(f"simulating {count} sets", workload(loaded, count), workers=workers))
    with progress(count, label=loaded.title, unit="set") as advance:
        made = make_challenge(
            folder, loaded, seed=seed, count=count, workers=workers, progress=advance
        )
    if as_json:
        document("challenge-made", {"folder": str(made.path), "sets": made.manifest()["sets"]})
    else:
        echo(str(made.path))


@challenge.command()
@_FOLDER
@click.option(
    "--sets",
    type=LocalPath(),
    metavar="DIR",
    help="Folder of a challenge: nulls of each design among its sets, each in a folder of its own.",
)
@click.option(
    "--recipe",
    type=LocalPath(),
    metavar="FILE.toml",
    help="In place of --sets a recipe of close-loop: nulls of its cloth, markers, noise, rate and "
    "winds.",
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    required=True,
    help="Seed of everything that is drawn; it must differ from that of the challenge.",
)
@click.option(
    "--lake",
    "lake_path",
    type=LakePlace(),
    envvar="FLAGDATA_LAKE",
    help="Lake that a recipe of close-loop reads artifacts from; also FLAGDATA_LAKE.",
)
@click.option(
    "--kinds",
    type=click.IntRange(min=4),
    default=48,
    show_default=True,
    help="Number of kinds for each design: meshes, methods and cloths.",
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    help="Number of processes that simulate.",
)
@click.option(
    "--scheduler",
    help="Dask scheduler whose workers simulate, tcp://HOST:PORT; without it, this machine.",
)
@json_option
def bank(
    folder: Path,
    sets: Path | None,
    recipe: Path | None,
    seed: int,
    lake_path: Place | None,
    kinds: int,
    workers: int,
    scheduler: str | None,
    as_json: bool,
) -> None:
    """Simulate nulls that all sets of a design share, by what participants know; a build that was
    stopped goes on."""
    from flagdata.lake import Lake
    from measure.nulls import bank as banks
    from measure.nulls.null_workload import of_batches
    from tests.studies.challenge.folder import ChallengeFolder
    from tests.studies.challenge.nulls import claim, nulls_of_recordings, nulls_of_sets

    if sets is not None and recipe is None:
        made = nulls_of_sets(folder, ChallengeFolder(sets), seed=seed, kinds=kinds)
    elif recipe is not None and sets is None:
        lake = None if lake_path is None else Lake.open(lake_path)
        made = [nulls_of_recordings(folder, recipe, seed=seed, kinds=kinds, lake=lake)]
    else:
        raise UsageError(
            "nulls are of one design",
            where="challenge bank",
            fix="give either --sets, the folder of a challenge, or --recipe, a recipe of close-loop",
        )
    for design in made:
        claim(design, seed=seed)
    say(of_batches([batch for design in made for batch in design.batches], workers=workers))
    work = sum(batch.effort for design in made for batch in design.batches)
    with progress(work, label="null recordings", unit="vertex-second") as advance:
        for design in made:
            banks.build(
                design.folder,
                design.batches,
                workers=workers,
                scheduler=scheduler,
                progress=advance,
            )
    if as_json:
        document(
            "challenge-bank",
            {
                "folder": str(folder),
                "kinds": kinds,
                "designs": [design.folder.name for design in made],
                "recordings": kinds * banks.WINDS * len(made),
            },
        )
    else:
        echo(str(folder))


@challenge.command()
@_FOLDER
@_ONLY
@click.option(
    "--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Seed of the fitter."
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    help="Number of sets that are judged at a time; of films, processes that simulate the first "
    "one too.",
)
@click.option(
    "--bank",
    type=LocalPath(),
    help="Folder with the simulated nulls of each design; of films, where their simulations are "
    "kept.",
)
@json_option
def run(
    folder: Path, only: tuple[str, ...], seed: int, workers: int, bank: Path | None, as_json: bool
) -> None:
    """Judge the sets that have no verdict yet, and file the verdicts with their hashes."""
    from flagdata.core.files.caches import user_cache
    from measure.cloth import announce_simulations
    from measure.cloth.close_films import workload
    from measure.loop import LoopOptions
    from measure.nulls import of_recordings
    from tests.studies.challenge.filing import filed
    from tests.studies.challenge.fitter import ClosingTheLoop, ClosingTheLoopOnFilms
    from tests.studies.challenge.folder import ChallengeFolder
    from tests.studies.challenge.run import run as run_challenge
    from tests.studies.challenge.run import run_films

    target = ChallengeFolder(folder)
    waiting = [name for name in target.chosen(only) if not filed(target, name)]
    films = ClosingTheLoopOnFilms(folder=bank or user_cache() / "calibrate", workers=workers)
    if target.filmed:
        for name in waiting[:1]:
            given = target.films(name)
            lasting = [float(log.times[-1]) for _, log in given.recordings.values()]
            say(announce_simulations(workload(lasting, films.options(given)), workers=workers))
    elif waiting:
        first = target.experiment(waiting[0])
        options = LoopOptions(bank=bank)
        say(
            of_recordings(
                first.recordings,
                first.specimen.mesh.vertex_count,
                options,
                sets=len(waiting),
                workers=workers,
            )
        )
    with progress(len(waiting), label="judging", unit="set") as advance:

        def report(filing: Filing) -> None:
            advance(1)
            # What it says stays in the file: who watches a run should not learn to read it.
            say(
                f"{filing.name} filed after {filing.seconds:.0f} "
                f"s{' (refused)' if filing.verdict is None else ''}"
            )

        if target.filmed:
            filings = run_films(target, films, seed=seed, only=only, progress=report)
        else:
            bound = ClosingTheLoop(bank=bank)
            filings = run_challenge(
                target, bound, seed=seed, only=only, workers=workers, progress=report
            )
    if as_json:
        rows = [{"set": f.name, "seconds": f.seconds, "refusal": f.refusal} for f in filings]
        document("challenge-run", {"folder": str(folder), "filed": rows})
    else:
        for filing in sorted(filings, key=lambda f: f.name):
            echo(str(target.verdict(filing.name)))


@challenge.command()
@_FOLDER
@_ONLY
@click.option(
    "--out",
    type=LocalPath(),
    help="Folder to which the sheet is also written, as .json, .md and .png.",
)
@click.option(
    "--history",
    type=LocalPath(),
    metavar="FILE.csv",
    help="File of all graded challenges, to which this one is added under its folder's name.",
)
@click.option(
    "--against",
    type=click.Choice(["true-model", "floor"]),
    help="Error against which E_red is measured: that of the true model, which is computed, or the "
    "verdict's floor. By "
    "default the true model's, and of films the floor.",
)
@json_option
@click.pass_context
def score(
    context: click.Context,
    folder: Path,
    only: tuple[str, ...],
    out: Path | None,
    history: Path | None,
    against: str | None,
    as_json: bool,
) -> None:
    """Open the keys and grade; ends with 3 where a gate is not met.

    From then on no verdict can be filed on these sets.
    """
    from tests.studies.challenge import history as histories
    from tests.studies.challenge import sheet as sheets
    from tests.studies.challenge.folder import ChallengeFolder
    from tests.studies.challenge.score import score as score_challenge
    from tests.studies.challenge.true_model import true_model_errors

    target, name = ChallengeFolder(folder), folder.resolve().name
    if out is not None:
        sheets.check(out)
    before = (
        [] if history is None else histories.without(history, name)
    )  # refused before any key is opened
    if target.filmed and against == "true-model":
        raise UsageError(
            "no true model's error is computed of films", where="--against", fix="give floor"
        )
    reference = None if target.filmed or against == "floor" else true_model_errors
    with progress(len(target.chosen(only)), label="grading", unit="set") as advance:
        sheet = score_challenge(target, only=only, reference=reference, progress=advance)
    if out is not None:
        for path in sheets.write(sheet, out):
            say(f"wrote {path}")
    if history is not None:
        histories.write(history, [*before, histories.row(name, sheets.as_dict(sheet))])
    if as_json:
        document("score", sheets.as_dict(sheet))
    else:
        echo_lines(sheets.markdown(sheet))
    if not all(gate.met for gate in sheet.gates):
        context.exit(3)
