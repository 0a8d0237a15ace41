"""`flagdata propose`: recordings that the library does not explain in; an effect file, kept or rejected, out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from flagdata.console import LocalPath, document, echo_lines, say
from flagdata.options import AsJson, argument, command, option, options
from flagdata.shared_options import NamedLake
from measure.closing.command_line import ByNulls, nulls_given, refuse, stage_bars

if TYPE_CHECKING:
    from measure.propose.outcome import ProposalOutcome


@options
class Proposing(AsJson, ByNulls, NamedLake):
    """How an effect is sought and tested."""

    recipe: Path = argument("The recipe of the experiment.", "RECIPE.toml", type=LocalPath())
    effect: str | None = option(
        "Test this effect on the recordings and seek no other.", default=None, metavar="FILE.py:Class"
    )
    known: tuple[str, ...] = option(
        "Effect that the model has already; may be repeated.", default=(), metavar="EFFECT.STRENGTH"
    )
    out: Path = option(
        "Folder in which proposal/ is written: the effect file, its tests and proposals.json.",
        default=Path("out/close-loop"),
        type=LocalPath(),
    )


@command(Proposing)
def propose(chosen: Proposing) -> None:
    """Propose an effect that the library lacks, test it on recordings it was not made from, keep or reject it.

    RECIPE.toml is one of `flagdata close-loop` that names its recordings. Terms are sought in a part of them;
    up to three become an effect, written as a module with its contract tests; the rest of the recordings decide: errors
    must fall, and below those of as many terms of another direction. proposal/proposals.json records what was tried.
    Run it where close-loop says "none of the library"; where it says "partly explained", name what it found with
    --known. --effect tests such a file on other recordings, beside the terms as controls.

    \b
      flagdata propose flag.toml
      flagdata propose flag.toml --known lift.coefficient
      flagdata propose other.toml --effect out/close-loop/proposal/proposed_1f2e3d.py:UpwardLower
    """
    from flagdata.dataset.source import lake_of
    from measure.nulls.plan import NullOptions
    from measure.nulls.workload import of_recordings
    from measure.observe import recipe as recipes
    from measure.propose import candidates, effect_file, proposal_log
    from measure.propose.propose import propose as seek
    from measure.propose.terms import dictionary
    from measure.propose.words import words

    folder = chosen.out / "proposal"
    proposal_log.check(folder / "proposals.json")
    if chosen.effect is None:
        effect_file.check(folder)
    recipe = recipes.load(chosen.recipe)
    null_options = nulls_given(recipe, chosen, level=chosen.level)
    options = NullOptions(seed=chosen.seed, bank=chosen.bank, workers=chosen.processes, **null_options)
    tried, controls = (
        (dictionary(), ()) if chosen.effect is None else (candidates.from_file(chosen.effect), dictionary())
    )
    observed = recipes.read(recipe, lake_of(chosen.lake))
    refuse(observed.findings)
    recordings, cloth = observed.experiment.recordings, observed.experiment.specimen
    say(of_recordings(recordings, cloth.mesh.vertex_count, options, workers=options.workers))
    outcome = seek(
        observed.experiment,
        tried,
        acting_columns=[candidates.library_column(name) for name in chosen.known],
        controls=controls,
        options=options,
        stage=stage_bars(),
    )
    spec = chosen.effect or ""
    if chosen.effect is None and outcome.strengths:
        spec = effect_file.write(outcome, folder).spec
    proposal_log.add(folder / "proposals.json", outcome, effect=spec)
    _report(outcome, spec, folder, as_json=chosen.as_json, text=words(outcome))


def _report(outcome: ProposalOutcome, spec: str, folder: Path, *, as_json: bool, text: str) -> None:
    if as_json:
        document("proposal", {"effect": spec, **outcome.as_dict()})
    else:
        echo_lines(text)
    if spec:
        say(f"effect {spec}")
    say(f"wrote {folder / 'proposals.json'}")
