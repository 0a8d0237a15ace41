"""Refinement against its peers on held-out simulated clips, at equal evaluations and at equal
seconds.

Reads a lake with a simulated data set: FLAGDATA_REFINE_LAKE names its folder, FLAGDATA_REFINE_AT
the version ("v1"), FLAGDATA_REFINE_TARGETS how many targets (2), FLAGDATA_REFINE_EVALUATIONS how
many evaluations each method has (50), FLAGDATA_REFINE_PEERS which optimisers (all, separated by
commas), FLAGDATA_REFINE_MODEL a model's folder (the shipped one), FLAGDATA_REFINE_CACHE a folder
for evaluations and films, so that an interrupted run goes on. Without a lake it is left out. With
FLAGDATA_REFINE_LAKE=changed the targets are flags of another mesh, integrator and step than any
that was learned from, with textures that none had; half of them are rendered by Cycles (in the
environment that FLAGDATA_BLENDER names). With FLAGDATA_REFINE_LAKE=arcsim the targets are runs of
the reference simulator (../shared/data/arcsim), filmed by our
rasteriser: six runs, of two views each for 12 targets. FLAGDATA_REFINE_HANDMADE names a lake with
flagsim-wide that gradient boosting on hand-made features learns from, at FLAGDATA_REFINE_AT, with
the features kept beside it; without it that peer is left out. Writes `refinement.md` beside the
JSON.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from flagdata.core.arrays import FloatArray
from flagdata.core.console import progress
from flagdata.core.rng import child_seed, stream
from flagdata.dataset import Source
from measure.refine import (
    AREA_WEIGHT_COLUMN,
    WIND_COLUMN,
    DrawnView,
    Evaluator,
    Refinement,
    Settings,
    Space,
    Target,
    Trace,
    refine,
    refinement_start,
    squared_embedding_distance,
)
from measure.refine.evaluator import STAGES
from measure.refine.refine_command import RENDERS, scenes_of, space_of
from measure.refine.space import DIMENSION
from measure.refine.target import as_stated, of_recording
from models.trained import estimator as models
from models.trained.estimator import Estimator
from models.training import DataSpec, FitFilm
from sim.assets import Assets
from sim.render import named_prior
from tests.evidence import REFERENCE
from tests.studies.validation.peers.registry import PEERS, minimise
from tests.studies.validation.transfer import (
    REFERENCE_RUNS,
    by_cycles,
    filmed,
    finer_mesh,
    implicit,
    other_textures,
    reference_clips,
    unseen,
)
from tests.studies.yardsticks.feature_baselines import TARGETS, Fitted, fit_baselines

_OF = {
    "arcsim": "the reference simulator's runs, filmed by our rasteriser by cameras unknown to it",
    "changed": "flags of another mesh, integrator, step and texture than any learned from, half of "
    "them by Cycles",
}
"""What the targets are, where they are of no lake."""
LEVEL = 0.9
ARCSIM, CHANGED = _OF
_RESAMPLES = 2000
_OWN, _REGRESSION = "refine", "regression alone"


@dataclass(frozen=True, kw_only=True)
class Score:
    """One method on one target.

    Attributes:
        method: its name; with " at equal seconds" where it had as long as the project's own.
        wind_error, density_error: absolute [m/s, kg/m²].
        wind_inside, density_inside: whether the interval contains the truth; None for methods
            without intervals.
        evaluations: clips that were simulated.
        seconds: from start to end, with the optimiser's own.
    """

    method: str
    wind_error: float
    density_error: float
    wind_inside: bool | None
    density_inside: bool | None
    evaluations: int
    seconds: float


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """All methods on all targets; the sheet."""
    lake = os.environ.get("FLAGDATA_REFINE_LAKE")
    if lake is None:
        return {
            "left_out": "FLAGDATA_REFINE_LAKE names no lake with a simulated data set, such as "
            "flagsim-wide"
        }
    torch.set_num_threads(1)
    chosen = os.environ.get("FLAGDATA_REFINE_PEERS")
    peers = list(PEERS) if chosen is None else [name for name in chosen.split(",") if name]
    count = int(os.environ.get("FLAGDATA_REFINE_TARGETS", "2"))
    budget = int(os.environ.get("FLAGDATA_REFINE_EVALUATIONS", "50"))
    folder = os.environ.get("FLAGDATA_REFINE_CACHE")
    cache = out / "refinement-cache" if folder is None else Path(folder)
    own_model = os.environ.get("FLAGDATA_REFINE_MODEL")
    estimator = models.load_shipped() if own_model is None else models.load(Path(own_model))
    scenes = scenes_of(estimator)
    space = space_of(estimator)
    at = os.environ.get("FLAGDATA_REFINE_AT", "v1")
    handmade = _handmade(at, seed)
    scores: list[Score] = []
    stages: dict[str, list[float]] = {}
    own: list[Refinement] = []
    if lake == ARCSIM:
        plain = _arcsim(count, frames=estimator.front_end.frames, seed=seed)
    elif lake == CHANGED:
        plain = _changed(
            count, space, frames=estimator.front_end.frames, seed=seed, folder=cache / "films"
        )
    else:
        plain = _targets(Path(lake), space, at=at, count=count, seed=seed)
    for number, as_filmed in enumerate(plain):
        target = _conditioned(as_filmed, rate=estimator.front_end.rate)
        found = refine(
            target,
            estimator,
            scenes,
            space=space,
            cache=cache,
            settings=Settings(
                budget=budget, level=LEVEL, seed=child_seed(seed, "refine", number), to_floor=False
            ),
        )
        own.append(found)
        scores += [_regression(target, estimator, space, seed), _of_own(target, found)]
        if handmade is not None:
            scores.append(_boosting(as_filmed, handmade))
        for stage, spent in found.seconds.items():
            stages.setdefault(stage, []).append(spent / found.evaluations)
        for peer in peers:
            trace = _peer(
                peer,
                found.evaluators[0],
                target,
                budget=budget,
                seed=child_seed(seed, peer, number),
            )
            scores += [
                _of_trace(target, trace, found, peer, evaluations=budget),
                _of_trace(
                    target, trace, found, f"{peer} at equal seconds", seconds=_seconds(found)
                ),
            ]
    rows = _rows(scores, seed=seed)
    result = {
        "lake": Path(lake).name,
        "at": at,
        "targets": [found.targets[0].name for found in own],
        "model": estimator.name,
        "budget": budget,
        "level": LEVEL,
        "density_range": space.area_weight.high - space.area_weight.low,
        "methods": rows,
        "scores": [vars(score).copy() for score in scores],
        "seconds_per_evaluation": {
            stage: float(np.median(values)) for stage, values in stages.items()
        },
        "floor_reached": [found.reached for found in own],
    }
    (out / "refinement.md").write_text(_sheet(result), encoding="utf-8")
    return result


def _conditioned(plain: Target, *, rate: float) -> Target:
    """The target as `flagdata measure` gives it to a refinement.

    Args:
        rate: of its frames [Hz].
    """
    return replace(plain, clip=FitFilm.of(plain.clip, np.arange(len(plain.clip)) / rate).frames)


def _targets(lake: Path, space: Space, *, at: str, count: int, seed: int) -> list[Target]:
    """Clips of the test side, each of another simulation, as they were filmed."""
    source = Source.open(lake)
    pairs = source.pairs("side = 'test'", at=at)
    otherwise = DrawnView(prior=named_prior(RENDERS), assets=Assets())
    order = stream(seed, "refinement", "targets").permutation(len(pairs)).tolist()
    taken: set[int] = set()
    found: list[Target] = []
    for index in order:
        flag = int(pairs.table.seed[index])
        if len(found) == count or flag in taken:
            continue
        taken.add(flag)
        recording = source.lake.artifact(str(pairs.table.recording[index]), at=at)
        found.append(
            of_recording(recording, pairs[index].clip[0].numpy(), otherwise=otherwise, space=space)
        )
    return found


def _changed(count: int, space: Space, *, frames: int, seed: int, folder: Path) -> list[Target]:
    """Flags of another mesh, integrator, step and texture, the second half rendered by Cycles;
    films of `frames`."""
    otherwise = DrawnView(prior=named_prior(RENDERS), assets=Assets())
    found: list[Target] = []
    for renderer, flags in (("raster", count - count // 2), ("cycles", count // 2)):
        if not flags:
            continue
        recipe = other_textures(implicit(finer_mesh(unseen(flags, child_seed(seed, renderer)))))
        recipe = by_cycles(recipe) if renderer == "cycles" else recipe
        time = replace(recipe.simulation.time, frames=frames)
        recipe = replace(recipe, simulation=replace(recipe.simulation, time=time))
        found += [
            as_stated(f"{renderer} {number}", film, stated, otherwise=otherwise, space=space)
            for number, (film, stated) in enumerate(filmed(recipe, folder=folder))
        ]
    return found


def _arcsim(count: int, *, frames: int, seed: int) -> list[Target]:
    """Runs of the reference simulator, of as many views as there must be; the estimator does not
    get their cameras."""
    otherwise = DrawnView(prior=named_prior(RENDERS), assets=Assets())
    clips = reference_clips(REFERENCE / "arcsim", seed, frames, views=-(-count // REFERENCE_RUNS))
    return [
        Target(
            name=name,
            clip=film[:frames],
            view=otherwise,
            truth={"wind_speed": wind, "area_weight": density},
        )
        for name, (film, wind, density) in list(clips)[:count]
    ]


def _peer(method: str, evaluator: Evaluator, target: Target, *, budget: int, seed: int) -> Trace:
    """An optimiser of the paper's objective: the squared distance of embeddings, one clip an
    evaluation."""
    wanted = evaluator.embed(target.clip[None])[0]

    def evaluate(points: FloatArray) -> tuple[FloatArray, FloatArray]:
        made = evaluator.evaluate(points, 1)
        seconds = np.array([sum(entry.seconds[stage] for stage in STAGES) for entry in made])
        return np.array(
            [float(squared_embedding_distance(entry.embedding, wanted)[0]) for entry in made]
        ), seconds

    return minimise(method, evaluate, dimension=DIMENSION, budget=budget, seed=seed)


def _regression(target: Target, estimator: Estimator, space: Space, seed: int) -> Score:
    begun = time.perf_counter()
    draws = refinement_start.amortised_draws(
        estimator, target.clip, space, aspect=1.5, seed=seed, draws=models.DRAWS
    )
    seconds = time.perf_counter() - begun
    low, middle, high = np.quantile(draws, [(1 - LEVEL) / 2, 0.5, (1 + LEVEL) / 2], axis=0)
    wind, density = target.truth["wind_speed"], target.truth["area_weight"]
    return Score(
        method=_REGRESSION,
        wind_error=abs(middle[0] - wind),
        density_error=abs(middle[1] - density),
        wind_inside=bool(low[0] <= wind <= high[0]),
        density_inside=bool(low[1] <= density <= high[1]),
        evaluations=0,
        seconds=seconds,
    )


def _handmade(at: str, seed: int) -> Fitted | None:
    lake = os.environ.get("FLAGDATA_REFINE_HANDMADE")
    if lake is None:
        return None
    spec = DataSpec(datasets=("flagsim-wide",))
    train = Source.open(lake).pairs(spec.rows, at=at, split="train")
    return fit_baselines(train, cache=Path(f"{lake}.inputs"), workers=1, seed=seed, bars=progress)


def _boosting(target: Target, models: Fitted) -> Score:
    """Of the clip as it was filmed, as the clips are that boosting learned from."""
    begun = time.perf_counter()
    quantiles = models.quantiles(target.clip)
    seconds = time.perf_counter() - begun
    level = models.boosting.levels
    low, middle, high = (quantiles[level.index(p)] for p in (0.05, 0.5, 0.95))
    wind, density = (TARGETS.index(name) for name in ("wind_speed", "area_weight"))
    true = target.truth
    return Score(
        method="boosting on hand-made features",
        wind_error=abs(middle[wind] - true["wind_speed"]),
        density_error=abs(middle[density] - true["area_weight"]),
        wind_inside=bool(low[wind] <= true["wind_speed"] <= high[wind]),
        density_inside=bool(low[density] <= true["area_weight"] <= high[density]),
        evaluations=0,
        seconds=seconds,
    )


def _seconds(found: Refinement) -> float:
    return sum(found.seconds.values())


def _of_own(target: Target, found: Refinement) -> Score:
    """Errors of the posterior's medians, also where `found` gives a bound instead: no hard target
    is left out."""
    wind, density = (entry.span for entry in found.intervals[:2])
    truth = target.truth["wind_speed"], target.truth["area_weight"]
    values = found.evaluators[0].simulator.space.values(found.posterior.points)
    middle = np.median(found.posterior.winds[:, 0]), np.median(values[:, AREA_WEIGHT_COLUMN])
    return Score(
        method=_OWN,
        wind_error=float(abs(middle[0] - truth[0])),
        density_error=float(abs(middle[1] - truth[1])),
        wind_inside=wind.low <= truth[0] <= wind.high,
        density_inside=density.low <= truth[1] <= density.high,
        evaluations=found.evaluations,
        seconds=_seconds(found),
    )


def _of_trace(
    target: Target,
    trace: Trace,
    found: Refinement,
    method: str,
    *,
    evaluations: int | None = None,
    seconds: float | None = None,
) -> Score:
    """The nearest point within a budget: what the paper reports."""
    place = trace.incumbent(evaluations=evaluations, seconds=seconds)
    value = found.evaluators[0].simulator.space.values(trace.points[[place]])[0]
    count = len(trace) if seconds is None else max(1, int((trace.seconds <= seconds).sum()))
    return Score(
        method=method,
        wind_error=abs(value[WIND_COLUMN] - target.truth["wind_speed"]),
        density_error=abs(value[AREA_WEIGHT_COLUMN] - target.truth["area_weight"]),
        wind_inside=None,
        density_inside=None,
        evaluations=count,
        seconds=float(trace.seconds[count - 1]),
    )


def _rows(scores: Sequence[Score], *, seed: int) -> list[dict[str, Any]]:
    """A row a method, medians with 90 % bootstrap intervals over targets."""
    rows = []
    for method in dict.fromkeys(score.method for score in scores):
        own = [score for score in scores if score.method == method]
        row: dict[str, Any] = {"method": method, "targets": len(own)}
        for name in ("wind_error", "density_error"):
            row[name] = _resampled(
                np.array([getattr(s, name) for s in own]), np.median, seed, method, name
            )
        for name in ("wind_inside", "density_inside"):
            values = [getattr(s, name) for s in own]
            row[name] = (
                None
                if None in values
                else _resampled(np.array(values, float), np.mean, seed, method, name)
            )
        row["evaluations"] = float(np.median([s.evaluations for s in own]))
        row["seconds"] = float(np.median([s.seconds for s in own]))
        rows.append(row)
    return rows


def _resampled(values: FloatArray, of: Callable[..., Any], seed: int, *names: str) -> list[float]:
    """Statistic, low and high (percentile bootstrap; Efron and Tibshirani 1993)."""
    rng = stream(seed, "refinement", "bootstrap", *names)
    drawn = of(values[rng.integers(len(values), size=(_RESAMPLES, len(values)))], axis=1)
    return [float(of(values)), *np.quantile(drawn, [0.05, 0.95]).tolist()]


def _sheet(result: dict[str, Any]) -> str:
    about = (
        f"{len(result['targets'])} clips of {_OF.get(result['lake'], _of_lake(result))}, model "
        f"`{result['model']}`, {result['budget']} simulated clips for each method; medians with 90 "
        "% bootstrap "
        f"intervals over targets, coverage of {result['level']:.0%} intervals. Peers report their "
        "nearest evaluation "
        "and have no interval."
    )
    header = (
        "| method | wind error [m/s] | area-weight error [% of range] | wind inside | area weight "
        "inside | "
        "evaluations | seconds |"
    )
    lines = ["# Refinement and its peers", "", about, "", header, "|---|---|---|---|---|---|---|"]
    for row in result["methods"]:
        share = [100 * value / result["density_range"] for value in row["density_error"]]
        lines.append(
            f"| {row['method']} | {_span(row['wind_error'], 2)} | {_span(share, 0)} | "
            f"{_span(row['wind_inside'], 2)} | "
            f"{_span(row['density_inside'], 2)} | {row['evaluations']:.0f} | {row['seconds']:.1f} |"
        )
    stages = ", ".join(
        f"{stage} {spent:.2f} s" for stage, spent in result["seconds_per_evaluation"].items()
    )
    lines += ["", f"Time of an evaluation of `{_OWN}`: {stages}.", ""]
    return "\n".join(lines)


def _of_lake(result: dict[str, Any]) -> str:
    return f"the test side of `{result['lake']}` ({result['at']})"


def _span(values: list[float] | None, digits: int) -> str:
    if values is None:
        return "—"
    return f"{values[0]:.{digits}f} [{values[1]:.{digits}f}, {values[2]:.{digits}f}]"
