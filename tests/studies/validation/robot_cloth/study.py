"""The study of a held cloth: calibrated on some programmes, what the model lacks added, errors on
others before and after, repeats against each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.console import progress
from flagdata.core.rng import stream
from sim.cloth.material import Material
from tests.studies.shares import Share
from tests.studies.validation.robot_cloth.attribution import (
    Late,
    Round,
    late,
    left_errors,
    lower,
    sought,
)
from tests.studies.validation.robot_cloth.calibrate import (
    Fit,
    Linear,
    at_bounds,
    calibrated,
    linear,
)
from tests.studies.validation.robot_cloth.model import Cloth, Parameters, rigid
from tests.studies.validation.robot_cloth.reading import Swing, read_all
from tests.studies.validation.robot_cloth.repeats import features, shuffled, tail_probability
from tests.studies.validation.robot_cloth.tracker import LATENCY

LEVEL = 0.05
"""Level at which each pair of repeats is tested."""
MOVED = 0.06
"""By which one of a pair's stamps are moved for the control [s]: less than a frame of the
camera."""
SHUFFLES = 200
"""How often the repeats' segments are shuffled, to find how many pairs differ by chance."""
_START = 0.3  # s of lag that the calibration starts from


@dataclass(frozen=True, kw_only=True)
class Error:
    """Root mean square distance of nodes [m], with the least and the largest of single
    recordings."""

    value: float
    least: float
    largest: float
    recordings: int


@dataclass(frozen=True, kw_only=True)
class Reduction:
    """Error of the lower halves of the held-out programmes, before and after what was added.

    Attributes:
        model: what was added up to here, from the first effect on.
        lower: root mean square distance of the lower half's nodes [m].
        gain: mean square error taken off since the model before, paired over recordings [m²].
        error: its standard error.
    """

    model: str
    lower: float
    gain: float
    error: float


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Two repeats of one programme: p of no difference, and p with the second one's stamps moved by
    `MOVED`."""

    first: str
    second: str
    p: float
    p_moved: float


@dataclass(frozen=True, kw_only=True)
class HeldCloth:
    """What was found.

    Attributes:
        fitted, held_out: programmes.
        size: width and height of the square of nodes at rest [m].
        parameters: calibrated, without what was added.
        bounds: those at a bound.
        rounds: how what the model lacks was chosen, on the fitted programmes alone.
        completed: calibrated with all that was added.
        camera: (3, 3) the map A of it, as rows; zero where it was not added.
        reductions: on the held-out programmes, as one effect after another is added; the first is
            the calibrated model.
        late: what separates latencies from another freedom of each frame; None where they were not
            added.
        of_fitted, of_held_out: model → error, before and after.
        parts: of the held-out errors with all that was added: what is the same all the time at a
            node, what a frame's nodes share beside it, and the rest, root mean squares [m].
        median: of the held-out errors of the calibrated model [m].
        extents: width and height in motion, tracked and predicted [m], held out.
        pairs: of repeats.
        p_pairs: chance of so many pairs at `LEVEL`, or more, if repeats did not differ.
    """

    fitted: tuple[str, ...]
    held_out: tuple[str, ...]
    size: tuple[float, float]
    parameters: Parameters
    bounds: tuple[str, ...]
    rounds: tuple[Round, ...]
    completed: Parameters
    camera: tuple[tuple[float, ...], ...]
    reductions: tuple[Reduction, ...]
    late: Late | None
    of_fitted: Mapping[str, Error]
    of_held_out: Mapping[str, Error]
    parts: Mapping[str, float]
    median: float
    extents: Mapping[str, tuple[float, float]]
    pairs: tuple[Pair, ...]
    p_pairs: float

    @property
    def apart(self) -> Share:
        """Pairs of repeats that differ at `LEVEL`; they share recordings, so that the bounds are
        too narrow."""
        return Share.of(pair.p <= LEVEL for pair in self.pairs)

    @property
    def apart_moved(self) -> Share:
        """The same of the control."""
        return Share.of(pair.p_moved <= LEVEL for pair in self.pairs)


def study(
    folder: Path, material: Material, *, fitted: Sequence[str], held_out: Sequence[str], seed: int
) -> HeldCloth:
    """Calibrate on the repeats of some programmes, predict those of others, and compare repeats.

    Args:
        seed: of the shuffled repeats.

    Raises:
        FlagdataError: recordings that cannot be read.
    """
    swings = read_all(folder, (*fitted, *held_out))
    known = [swing for programme in fitted for swing in swings[programme]]
    unseen = [swing for programme in held_out for swing in swings[programme]]
    cloth = Cloth.seen(known, material)
    base = calibrated(cloth, known, Fit.start(known, Parameters(lag=_START)))
    with progress(None, "what the model lacks", "candidate") as advance:
        rounds = sought(cloth, {name: swings[name] for name in fitted}, base, advance=advance)
    fits = _completed(cloth, known, base, [entry.added for entry in rounds if entry.added])
    found, last = base.parameters, list(fits.values())[-1]
    models = {
        "nominal, stamps at their word": Parameters(),
        "nominal, with the lag": Parameters(lag=found.lag),
    }
    plain = {name: Fit.start(known, own) for name, own in models.items()} | {"calibrated": base}
    if last is not base:
        plain["with all that was added"] = last
    after = left_errors(cloth, unseen, base)
    pairs, chance = _pairs(cloth, swings, base, seed)
    return HeldCloth(
        fitted=tuple(fitted),
        held_out=tuple(held_out),
        size=(cloth.width, cloth.height),
        parameters=found,
        bounds=at_bounds(found),
        rounds=tuple(rounds),
        completed=last.parameters,
        camera=tuple(tuple(row) for row in last.tracker.camera.tolist()),
        reductions=_reductions(cloth, unseen, fits),
        late=_late(cloth, unseen, known, fits, seed),
        parts=_parts(left_errors(cloth, unseen, last)),
        pairs=pairs,
        p_pairs=chance,
        extents=_extents(unseen, after),
        of_fitted=_compared(cloth, known, plain, found.lag),
        of_held_out=_compared(cloth, unseen, plain, found.lag),
        median=float(
            np.nanmedian(np.concatenate([np.linalg.norm(e, axis=2).ravel() for e in after]))
        ),
    )


def _completed(
    cloth: Cloth, known: Sequence[Swing], base: Fit, added: Sequence[str]
) -> dict[str, Fit]:
    """The calibrated model, and those with one effect after another, each by all that is known."""
    fits = {"calibrated": base}
    for name in added:
        fits[f"+ {name}"] = calibrated(cloth, known, list(fits.values())[-1].with_effect(name))
    return fits


def _reductions(
    cloth: Cloth, unseen: Sequence[Swing], fits: Mapping[str, Fit]
) -> tuple[Reduction, ...]:
    made: list[Reduction] = []
    before: FloatArray | None = None
    for name, fit in fits.items():
        squares = lower(left_errors(cloth, unseen, fit))
        gained = (squares if before is None else before) - squares
        made.append(
            Reduction(
                model=name,
                lower=float(np.sqrt(squares.mean())),
                gain=float(gained.mean()),
                error=float(gained.std(ddof=1) / np.sqrt(len(gained))),
            )
        )
        before = squares
    return tuple(made)


def _late(
    cloth: Cloth,
    unseen: Sequence[Swing],
    known: Sequence[Swing],
    fits: Mapping[str, Fit],
    seed: int,
) -> Late | None:
    """Of the model with all that was added, against the same fitted without latencies."""
    last = list(fits.values())[-1]
    if LATENCY not in last.sought:
        return None
    without = next(iter(fits.values()))
    for name in (*last.sought, *last.parameters.strengths):
        without = without if name == LATENCY else without.with_effect(name)
    return late(cloth, unseen, last, without=calibrated(cloth, known, without), seed=seed)


def _compared(
    cloth: Cloth, swings: Sequence[Swing], models: Mapping[str, Fit], lag: float
) -> dict[str, Error]:
    """Error by model; a board that hangs from the tool stands for no model at all."""
    made = {"a rigid board, with the lag": _error([rigid(cloth, swing, lag) for swing in swings])}
    return made | {name: _error(left_errors(cloth, swings, fit)) for name, fit in models.items()}


def _error(of: Sequence[FloatArray]) -> Error:
    squares = [np.nanmean((error**2).sum(axis=2)) for error in of]
    each = np.sqrt(squares)
    return Error(
        value=float(np.sqrt(np.mean(squares))),
        least=float(each.min()),
        largest=float(each.max()),
        recordings=len(of),
    )


def _parts(left: Sequence[FloatArray]) -> dict[str, float]:
    steady, shared, rest = [], [], []
    for error in left:
        mean = np.nanmean(error, axis=0)
        whole = error[~np.isnan(error).all(axis=(1, 2))] - mean
        frame = np.nanmean(whole, axis=1, keepdims=True)
        steady.append((mean**2).sum(axis=1).mean())
        shared.append((frame**2).sum(axis=2).mean())
        rest.append(np.nanmean(((whole - frame) ** 2).sum(axis=2)))
    parts = {
        "the same all the time at a node": steady,
        "shared by a frame's nodes": shared,
        "the rest": rest,
    }
    return {name: float(np.sqrt(np.mean(values))) for name, values in parts.items()}


def _extents(swings: Sequence[Swing], left: Sequence[FloatArray]) -> dict[str, tuple[float, float]]:
    """Distances of the upper corners, and of the ends of the nodes' columns, over frames in which
    the tool moves."""
    tracked, modelled = [], []
    for swing, error in zip(swings, left, strict=True):
        moving = np.linalg.norm(np.gradient(swing.tool, axis=0), axis=1) > 1e-3
        within = np.interp(swing.times, swing.tool_times, moving.astype(float)) > 0.5
        for into, places in ((tracked, swing.positions), (modelled, swing.positions - error)):
            grid = places[within].reshape(-1, swing.side, swing.side, 3)
            wide = np.linalg.norm(grid[:, -1, 0] - grid[:, 0, 0], axis=1)
            high = np.linalg.norm(grid[:, :, 0] - grid[:, :, -1], axis=2)
            into.append((np.nanmean(wide), np.nanmean(high)))
    return {
        name: (float(values[:, 0].mean()), float(values[:, 1].mean()))
        for name, values in (("tracked", np.array(tracked)), ("predicted", np.array(modelled)))
    }


def _pairs(
    cloth: Cloth, swings: Mapping[str, Sequence[Swing]], fit: Fit, seed: int
) -> tuple[tuple[Pair, ...], float]:
    """All pairs of repeats, and the chance that as many differ if the repeats' segments may change
    places."""
    every = [swing for own in swings.values() for swing in own]
    beside = dict(zip((swing.name for swing in every), linear(cloth, every, fit)[0], strict=True))
    lag = fit.parameters.lag
    known = {swing.name: features(swing, beside[swing.name], lag) for swing in every}
    moved = {swing.name: features(swing, _later(beside[swing.name]), lag) for swing in every}
    scale = np.concatenate(list(known.values())).std(axis=0)
    pairs = tuple(
        Pair(
            first=a.name,
            second=b.name,
            p=tail_probability(known[a.name], known[b.name], scale),
            p_moved=tail_probability(known[a.name], moved[b.name], scale),
        )
        for own in swings.values()
        for a, b in combinations(own, 2)
    )
    count, rng = sum(pair.p <= LEVEL for pair in pairs), stream(seed, "held", "shuffles")
    as_many = 0
    for _ in range(SHUFFLES):
        mixed = [shuffled([known[swing.name] for swing in own], rng) for own in swings.values()]
        found = sum(
            tail_probability(a, b, scale) <= LEVEL for own in mixed for a, b in combinations(own, 2)
        )
        as_many += found >= count
    return pairs, (1 + as_many) / (1 + SHUFFLES)


def _later(beside: Linear) -> Linear:
    """Errors as they would be if the camera lagged by `MOVED` more, by the sensitivity to the
    lag."""
    return replace(beside, error=beside.error + MOVED * beside.change[-1])
