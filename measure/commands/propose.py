"""`flagdata propose`: recordings that the library does not explain in; an effect file, kept or
rejected, out."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from flagdata.api.measuring_verbs import Proposing
from flagdata.core.console import echo_lines, say
from flagdata.verbs.verb_options import Result, verb
from measure.closing.null_options import nulls_given, refuse, stage_bars


@verb(Proposing, example='flagdata.propose("flag.toml", known=("lift.coefficient",))')
def propose(chosen: Proposing) -> Iterator[Result]:
    """Propose an effect that the library lacks, test it on recordings it was not made from, keep or
    reject it.

    RECIPE.toml is one of `flagdata close-loop` that names its recordings. Terms are sought in a
    part of them; up to three become an effect, written as a module with its contract tests; the
    rest of the recordings decide: errors must fall, and fall further than with as many unrelated
    terms. proposal/proposals.json records what was tried. Run it where close-loop says "none of
    the library"; where it says "partly explained", name what it found with --known. --effect tests
    such a file on other recordings, beside the terms as controls.

    \b
      flagdata propose flag.toml
      flagdata propose flag.toml --known lift.coefficient
      flagdata propose other.toml --effect out/close-loop/proposal/proposed_1f2e3d.py:UpwardLower
    """
    from flagdata.dataset.lake_source import lake_of
    from measure.nulls.null_plan import NullOptions
    from measure.nulls.null_workload import of_recordings
    from measure.propose import candidates, effect_file, proposal_log
    from measure.propose.proposal_answer import answer_of
    from measure.propose.term_search import propose as seek
    from measure.propose.terms import dictionary
    from measure.trajectories import experiment_recipe as recipes

    folder = Path(chosen.out) / "proposal"
    proposal_log.check(folder / "proposals.json")
    if chosen.effect is None:
        effect_file.check(folder)
    recipe = recipes.load(Path(chosen.recipe))
    null_options = nulls_given(recipe, chosen, level=chosen.level)
    options = NullOptions(
        seed=chosen.seed,
        bank=chosen.bank,
        workers=chosen.processes,
        scheduler=chosen.scheduler,
        **null_options,
    )
    tried, controls = (
        (dictionary(), ())
        if chosen.effect is None
        else (candidates.from_file(chosen.effect), dictionary())
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
    answer = answer_of(outcome, subject=Path(chosen.recipe).stem, effect=spec)
    yield Result("proposal", answer.document, answer=answer)
    echo_lines(answer.words)
    if spec:
        say(f"effect {spec}")
    say(f"wrote {folder / 'proposals.json'}")
