"""Verdicts on experiments of a flag that MuJoCo simulated: nulls, in which nothing undeclared acts,
and effects.

Truths are another code's, with its own elements, integrators and wind force, on cloths that differ
from the declared one (see `mujoco`). Everything is judged through the public interface, from the
recipe and marker tables that a user would bring, against one bank of nulls by flagdata's own
simulator, which serves all experiments.

Environment variables: FLAGDATA_FOREIGN_NULLS (how many nulls), FLAGDATA_FOREIGN_EFFECTS (how many
of each effect), FLAGDATA_FOREIGN_ACTED (which effects, separated by commas), FLAGDATA_FOREIGN_KINDS
(kinds of numerics in the bank), FLAGDATA_FOREIGN_WEIGHED (the relative uncertainty that each cloth
is weighed with; its own area weight is then what is declared), FLAGDATA_FOREIGN_FOLDER (where bank,
recordings and verdicts are kept; a run that was stopped goes on there).
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import torch

from flagdata.answer import Quantity
from flagdata.core.rng import child_seed
from flagdata.errors import InputError, NotFoundError
from measure.closing import close_loop
from measure.forecasting import Segments
from measure.loop import LoopOptions
from measure.nulls import bank as banks
from measure.trajectories import Observed, load, read
from measure.verdict import NOT_REJECTED, Conclusion
from tests.studies.challenge.classes import class_of
from tests.studies.shares import Share
from tests.studies.validation.environments import MUJOCO
from tests.studies.validation.mujoco.experiments import (
    NOISE,
    NOMINAL,
    NOTHING,
    SPEEDS,
    UNDECLARED,
    Truth,
    draw,
    write,
)

_NULLS, _EFFECTS, _KINDS = 20, 1, 40
_COVERED = ("area_weight", "bending", "damping")


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Verdicts and what they are worth; what is missing where MuJoCo is."""
    try:
        python = MUJOCO.find()
    except NotFoundError as error:
        return {"missing": f"{error.what}: {error.fix}"}
    torch.set_num_threads(1)
    named = [(f"null-{k:03d}", NOTHING) for k in range(_number("NULLS", _NULLS))]
    acted = os.environ.get("FLAGDATA_FOREIGN_ACTED", ",".join(UNDECLARED))
    for name in filter(None, acted.split(",")):
        named += [
            (f"{name}-{k:03d}", UNDECLARED[name]) for k in range(_number("EFFECTS", _EFFECTS))
        ]
    truths = [draw(name, undeclared, seed=seed) for name, undeclared in named]
    with TemporaryDirectory(prefix="flagdata-foreign-") as temporary:
        folder = Path(os.environ.get("FLAGDATA_FOREIGN_FOLDER", temporary))
        rows = [_row(truth, folder, python, seed) for truth in truths]
    found = {**summary(rows), "kinds": _number("KINDS", _KINDS), "experiments": rows}
    (out / "validate-foreign.md").write_text(page(found), encoding="utf-8")
    return found


def _number(name: str, usual: int) -> int:
    return int(os.environ.get(f"FLAGDATA_FOREIGN_{name}", usual))


def _row(truth: Truth, folder: Path, python: Path, seed: int) -> dict[str, Any]:
    """An experiment simulated, judged and graded; as it was kept, if it was."""
    weighed = os.environ.get("FLAGDATA_FOREIGN_WEIGHED", "")
    kept = folder / truth.name / f"row{weighed and '-weighed-'}{weighed}.json"
    if not kept.is_file():
        recipe = folder / truth.name / "experiment.toml"
        if not recipe.is_file():
            write(truth, recipe.parent, python=python, seed=seed)
        observed = read(load(recipe))
        # A cloth whose own weight is declared is another design: its verdict simulates nulls itself.
        bank = None if weighed else _bank(folder / "bank", observed, seed)
        row = _graded(
            truth, _weighed(observed, truth, float(weighed)) if weighed else observed, bank, seed
        )
        kept.write_text(json.dumps(row), encoding="utf-8")
    return json.loads(kept.read_text(encoding="utf-8"))


def _weighed(observed: Observed, truth: Truth, uncertainty: float) -> Observed:
    """With the cloth's own area weight declared, known to a relative uncertainty, in place of the
    nominal one."""
    specimen = observed.experiment.specimen
    known = replace(
        specimen,
        material=specimen.material.scaled(area_weight=truth.factors["area_weight"]),
        area_weight_uncertainty=uncertainty,
    )
    return replace(observed, experiment=replace(observed.experiment, specimen=known))


def _bank(folder: Path, observed: Observed, seed: int) -> Path:
    """Nulls of the declared cloth, its markers and winds, by many kinds of numerics; simulated
    once."""
    experiment = observed.experiment
    first, segments = experiment.recordings[0], Segments.of(experiment.recordings)
    batches = [
        banks.prior_batch(
            experiment.specimen,
            markers=first.markers,
            rate=1 / segments.period,
            noise=NOISE,
            duration=segments.cut.lasting(banks.segments_of_each(len(segments))),
            speeds=banks.around(*SPEEDS),
            seed=child_seed(seed, "foreign", "null", index),
        )
        for index in range(_number("KINDS", _KINDS))
    ]
    banks.build(folder, batches)
    return folder


def _graded(truth: Truth, observed: Observed, bank: Path | None, seed: int) -> dict[str, Any]:
    undeclared = truth.undeclared
    row: dict[str, Any] = {
        "name": truth.name,
        "acted": undeclared.title,
        "effect": undeclared.effect,
        "strength": undeclared.strength,
        "factors": dict(truth.factors),
        "damping": truth.damping,
        "speeds": list(truth.speeds),
        "method": f"{truth.method.integrator}, {1e3 * truth.method.step:g} ms",
        "diagonals": truth.diagonals.value,
        "findings": [found.kind for found in observed.findings],
    }
    try:
        verdict = close_loop(observed.experiment, LoopOptions(seed=seed, bank=bank))
    except InputError as error:
        return {**row, "refused": str(error), "grade": "refused"}
    of = {parameter.name: parameter.after or parameter.before for parameter in verdict.parameters}
    declared = observed.experiment.specimen.material.area_weight / NOMINAL.area_weight
    true = {
        "area_weight": truth.factors["area_weight"] / declared,
        "bending": truth.factors["bending"],
        "damping": truth.damping,
    }
    row |= {
        "said": verdict.conclusion.value,
        "named": list(verdict.named),
        "words": verdict.words,
        "statistic": verdict.test.statistic,
        "p": verdict.test.p_value.point,
        "p_interval": [verdict.test.p_value.low, verdict.test.p_value.high],
        "level": verdict.test.level,
        "parameters": {name: _interval(of[name], true[name]) for name in _COVERED},
        "E_red": [comparison.share for comparison in verdict.comparisons],
        "seconds": round(verdict.seconds),
        "grade": grade(truth, verdict.conclusion, verdict.named),
        "criteria": verdict.provenance["criteria"]["hash"],
    }
    ours = [
        c for c in verdict.ranking if c.effect == undeclared.effect and c.effect in verdict.named
    ]
    if ours:
        row["strength_found"] = _interval(ours[0].strength, undeclared.strength)
    return row


def grade(truth: Truth, said: Conclusion, named: Sequence[str]) -> str:
    """right: the effect alone, or none where none acts; class: another of its class; among: one of
    several; undecided: nothing is decided; wrong."""
    effect, outside = (
        truth.undeclared.effect,
        truth.undeclared is not NOTHING and truth.undeclared.damping is None,
    )
    if said is Conclusion.UNDECIDED:
        return "undecided"
    if not effect:
        right = {Conclusion.OUTSIDE, Conclusion.PARTLY} if outside else {Conclusion.SUFFICIENT}
        return "right" if said in right else "wrong"
    if effect in named:
        return {
            Conclusion.EFFECT: "right",
            Conclusion.ONE_OF: "among",
            Conclusion.PARTLY: "partly",
        }.get(said, "wrong")
    return "class" if class_of(effect) in {class_of(name) for name in named} else "wrong"


def _interval(found: Quantity, true: float) -> dict[str, Any]:
    return {
        "true": true,
        "value": found.value,
        "low": found.low,
        "high": found.high,
        "unit": found.unit,
        "level": found.level,
        "covers": bool(found.low <= true <= found.high),
    }


def summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Shares with Clopper–Pearson bounds of 90 %, so that each bound is one-sided at 95 %."""
    judged = [row for row in rows if "said" in row]
    nulls = [row for row in judged if row["acted"] == NOTHING.title]
    acting = [row for row in judged if row["acted"] != NOTHING.title]
    intervals = [row["parameters"] for row in judged]
    return {
        "refused": len(rows) - len(judged),
        "false_rejections": Share.of(row["p"] <= row["level"] for row in nulls).as_dict(),
        "p_of_nulls": sorted(row["p"] for row in nulls),
        "right": Share.of(row["grade"] == "right" for row in acting).as_dict(),
        "right_or_among": Share.of(row["grade"] in ("right", "among") for row in acting).as_dict(),
        "missed": Share.of(missed(row) for row in acting).as_dict(),
        "undecided": Share.of(row["grade"] == "undecided" for row in judged).as_dict(),
        "wrong": Share.of(row["grade"] == "wrong" and not missed(row) for row in acting).as_dict(),
        "covered": {
            name: Share.of(own[name]["covers"] for own in intervals).as_dict() for name in _COVERED
        },
        "covered_of_nulls": {
            name: Share.of(row["parameters"][name]["covers"] for row in nulls).as_dict()
            for name in _COVERED
        },
    }


def missed(row: Mapping[str, Any]) -> bool:
    """Whether something acted and the base model is not rejected."""
    return row["grade"] in ("wrong", "undecided") and row["said"] in [
        own.value for own in NOT_REJECTED
    ]


def page(found: Mapping[str, Any]) -> str:
    lines = [
        "# Verdicts on experiments that MuJoCo simulated",
        "",
        "| share | value | of | 90 % bounds |",
        "|---|---|---|---|",
        *(
            _share(title, found[key])
            for title, key in (
                ("nulls that were rejected", "false_rejections"),
                ("effects named rightly", "right"),
                ("effects named rightly, or among several", "right_or_among"),
                ("effects not detected", "missed"),
                ("effects misnamed", "wrong"),
                ("verdicts that are not decided", "undecided"),
            )
        ),
        *(
            _share(f"90 % intervals of {name} that cover", found["covered"][name])
            for name in _COVERED
        ),
        "",
        f"{found['refused']} were refused. The bank holds {found['kinds']} kinds of numerics.",
        "",
        (
            "| experiment | acted | cloth: area weight, stretching, bending; damping | method | said | "
            "p | grade |"
        ),
        "|---|---|---|---|---|---|---|",
        *(_line(row) for row in found["experiments"]),
    ]
    return "\n".join(lines) + "\n"


def _share(title: str, share: Mapping[str, Any]) -> str:
    value = "–" if share["value"] is None else f"{share['value']:.2f}"
    return (
        f"| {title} | {value} | {share['hits']} of {share['count']} | "
        f"{share['low']:.2f}–{share['high']:.2f} |"
    )


def _line(row: Mapping[str, Any]) -> str:
    cloth = (
        ", ".join(f"× {value:.2f}" for value in row["factors"].values())
        + f"; {1e3 * row['damping']:.1f} ms"
    )
    if "refused" in row:
        return (
            f"| {row['name']} | {row['acted']} | {cloth} | {row['method']} | refused: "
            f"{row['refused']} | – | – |"
        )
    said = f"{row['said']} {' or '.join(row['named'])}".strip()
    return (
        f"| {row['name']} | {row['acted']} | {cloth} | {row['method']} | {said} | {row['p']:.2g} | "
        f"{row['grade']} |"
    )
