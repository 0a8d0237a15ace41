"""`flagdata propose`: recordings that the library does not explain in; an effect file, kept or rejected, out."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import click

from flagdata.console import LakePlace, LocalPath, document, echo_lines, json_option, say
from flagdata.storage import Place
from measure.closing.command_line import null_options, nulls_given, refuse, stage_bars

if TYPE_CHECKING:
    from measure.propose.outcome import Outcome


@click.command()
@click.argument("recipe_path", metavar="RECIPE.toml", type=LocalPath())
@click.option("--effect", metavar="FILE.py:Class", help="Test this effect on the recordings and seek no other.")
@click.option(
    "--known", multiple=True, metavar="EFFECT.STRENGTH", help="Effect that the model has already; may be repeated."
)
@null_options(level="Significance level of the test of every term; 0.05 by default.")
@click.option(
    "--lake",
    "lake_path",
    type=LakePlace(),
    envvar="FLAGDATA_LAKE",
    help="Lake that artifacts are read from; also FLAGDATA_LAKE.",
)
@click.option(
    "--out",
    type=LocalPath(),
    default=Path("out/close-loop"),
    show_default=True,
    help="Folder in which proposal/ is written: the effect file, its tests and proposals.json.",
)
@json_option
def propose(
    recipe_path: Path,
    effect: str | None,
    known: tuple[str, ...],
    nulls: int | None,
    bank: Path | None,
    level: float | None,
    seed: int,
    workers: int | None,
    lake_path: Place | None,
    out: Path,
    as_json: bool,
) -> None:
    """Propose an effect that the library lacks, test it on recordings it was not made from, keep or reject it.

    RECIPE.toml is one of `flagdata close-loop --recipe` that names its recordings. Terms are sought in a part of them;
    up to three become an effect, written as a module with its contract tests; the rest of the recordings decide: errors
    must fall, and below those of as many terms of another direction. proposal/proposals.json records what was tried.
    Run it where close-loop says "none of the library"; where it says "partly explained", name what it found with
    --known. --effect tests such a file on other recordings, beside the terms as controls.

    \b
      flagdata propose flag.toml
      flagdata propose flag.toml --known lift.coefficient
      flagdata propose other.toml --effect out/close-loop/proposal/proposed_1f2e3d.py:UpwardLower
    """
    from flagdata.lake import Lake
    from measure.nulls.plan import NullOptions
    from measure.nulls.workload import of_recordings
    from measure.observe import recipe as recipes
    from measure.propose import candidates, effect_file, proposal_log
    from measure.propose.propose import propose as seek
    from measure.propose.terms import dictionary
    from measure.propose.words import words

    folder = out / "proposal"
    proposal_log.check(folder / "proposals.json")
    if effect is None:
        effect_file.check(folder)
    recipe = recipes.load(recipe_path)
    said = nulls_given(recipe, level=level, nulls=nulls, bank=bank)
    options = NullOptions(seed=seed, bank=bank, workers=workers or len(os.sched_getaffinity(0)), **said)
    tried, controls = (dictionary(), ()) if effect is None else (candidates.from_file(effect), dictionary())
    observed = recipes.read(recipe, None if lake_path is None else Lake.open(lake_path))
    refuse(observed.findings)
    recordings, cloth = observed.experiment.recordings, observed.experiment.specimen
    say(of_recordings(recordings, cloth.mesh.vertex_count, options, workers=options.workers))
    outcome = seek(
        observed.experiment,
        tried,
        known=[candidates.weighed(name) for name in known],
        controls=controls,
        options=options,
        stage=stage_bars(),
    )
    spec = effect or ""
    if effect is None and outcome.strengths:
        spec = effect_file.write(outcome, folder).spec
    proposal_log.add(folder / "proposals.json", outcome, effect=spec)
    _report(outcome, spec, folder, as_json=as_json, text=words(outcome))


def _report(outcome: Outcome, spec: str, folder: Path, *, as_json: bool, text: str) -> None:
    if as_json:
        document("proposal", {"effect": spec, **outcome.as_dict()})
    else:
        echo_lines(text)
    if spec:
        say(f"effect {spec}")
    say(f"wrote {folder / 'proposals.json'}")
