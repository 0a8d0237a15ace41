"""The study of a held cloth: calibrated on some programmes, held-out errors on others, repeats against each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from flagdata.rng import stream
from measure.cases.held.calibrate import Linear, at_bounds, calibrated, linear
from measure.cases.held.model import Cloth, Parameters, errors, predicted, rigid
from measure.cases.held.reading import Floats, Swing, read_all
from measure.cases.held.repeats import features, shuffled, tail_probability
from measure.shares import Share
from sim.material import Material

LEVEL = 0.05
"""Level at which each pair of repeats is tested."""
MOVED = 0.06
"""By which one of a pair's stamps are moved for the control [s]: less than a frame of the camera."""
SHUFFLES = 200
"""How often the repeats' segments are shuffled, to find how many pairs are told apart by chance."""
_START = 0.3  # s of lag that the calibration starts from


@dataclass(frozen=True, kw_only=True)
class Error:
    """Root mean square distance of nodes [m], with the least and the largest of single recordings."""

    value: float
    least: float
    largest: float
    recordings: int


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Two repeats of one programme: p of no difference, and p with the second one's stamps moved by `MOVED`."""

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
        parameters: calibrated.
        bounds: those at a bound.
        of_fitted, of_held_out: model → error, before and after.
        parts: of the held-out errors after: what is the same all the time at a node, what a frame's nodes share
            beside it, and the rest, root mean squares [m].
        median: of the held-out errors after [m].
        extents: width and height in motion, tracked and predicted [m], held out.
        pairs: of repeats.
        p_pairs: chance of so many pairs at `LEVEL`, or more, if nothing told repeats apart.
    """

    fitted: tuple[str, ...]
    held_out: tuple[str, ...]
    size: tuple[float, float]
    parameters: Parameters
    bounds: tuple[str, ...]
    of_fitted: Mapping[str, Error]
    of_held_out: Mapping[str, Error]
    parts: Mapping[str, float]
    median: float
    extents: Mapping[str, tuple[float, float]]
    pairs: tuple[Pair, ...]
    p_pairs: float

    @property
    def apart(self) -> Share:
        """Pairs of repeats that are told apart at `LEVEL`; they share recordings, so that the bounds are too narrow."""
        return Share.of(pair.p <= LEVEL for pair in self.pairs)

    @property
    def apart_moved(self) -> Share:
        """The same of the control."""
        return Share.of(pair.p_moved <= LEVEL for pair in self.pairs)


def study(folder: Path, material: Material, *, fitted: Sequence[str], held_out: Sequence[str], seed: int) -> HeldCloth:
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
    found = calibrated(cloth, known, Parameters(lag=_START))
    models = {
        "nominal, stamps at their word": Parameters(), "nominal, with the lag": Parameters(lag=found.lag),
        "calibrated": found,
    }  # fmt: skip
    of_known, left = _left(cloth, known, found), _left(cloth, unseen, found)
    usual = np.nanmean(np.concatenate(of_known), axis=0)
    corrected = "calibrated, less the nodes' mean errors on the fitted programmes"
    pairs, chance = _pairs(cloth, swings, found, seed)
    return HeldCloth(
        fitted=tuple(fitted), held_out=tuple(held_out), size=(cloth.width, cloth.height), parameters=found,
        bounds=at_bounds(found), parts=_parts(left), pairs=pairs, p_pairs=chance, extents=_extents(unseen, left),
        of_fitted=_compared(cloth, known, models, found.lag) | {corrected: _error([e - usual for e in of_known])},
        of_held_out=_compared(cloth, unseen, models, found.lag) | {corrected: _error([e - usual for e in left])},
        median=float(np.nanmedian(np.concatenate([np.linalg.norm(e, axis=2).ravel() for e in left]))),
    )  # fmt: skip


def _left(cloth: Cloth, swings: Sequence[Swing], at: Parameters) -> list[Floats]:
    """(frame, node, 3) errors on each recording [m]."""
    runs = predicted(cloth, swings, [at] * len(swings))
    return [errors(swing, run, at.lag) for swing, run in zip(swings, runs, strict=True)]


def _compared(cloth: Cloth, swings: Sequence[Swing], models: Mapping[str, Parameters], lag: float) -> dict[str, Error]:
    """Error by model; a board that hangs from the tool stands for no model at all."""
    made = {"a rigid board, with the lag": _error([rigid(cloth, swing, lag) for swing in swings])}
    for name, own in models.items():
        made[name] = _error(_left(cloth, swings, own))
    return made


def _error(of: Sequence[Floats]) -> Error:
    squares = [np.nanmean((error**2).sum(axis=2)) for error in of]
    each = np.sqrt(squares)
    return Error(
        value=float(np.sqrt(np.mean(squares))), least=float(each.min()), largest=float(each.max()), recordings=len(of)
    )


def _parts(left: Sequence[Floats]) -> dict[str, float]:
    steady, shared, rest = [], [], []
    for error in left:
        mean = np.nanmean(error, axis=0)
        whole = error[~np.isnan(error).all(axis=(1, 2))] - mean
        frame = np.nanmean(whole, axis=1, keepdims=True)
        steady.append((mean**2).sum(axis=1).mean())
        shared.append((frame**2).sum(axis=2).mean())
        rest.append(np.nanmean(((whole - frame) ** 2).sum(axis=2)))
    parts = {"the same all the time at a node": steady, "shared by a frame's nodes": shared, "the rest": rest}
    return {name: float(np.sqrt(np.mean(values))) for name, values in parts.items()}


def _extents(swings: Sequence[Swing], left: Sequence[Floats]) -> dict[str, tuple[float, float]]:
    """Distances of the upper corners, and of the ends of the nodes' columns, over frames in which the tool moves."""
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
    cloth: Cloth, swings: Mapping[str, Sequence[Swing]], at: Parameters, seed: int
) -> tuple[tuple[Pair, ...], float]:
    """All pairs of repeats, and the chance of as many told apart if the repeats' segments may change places."""
    every = [swing for own in swings.values() for swing in own]
    beside = dict(zip((swing.name for swing in every), linear(cloth, every, at), strict=True))
    known = {swing.name: features(swing, beside[swing.name], at.lag) for swing in every}
    moved = {swing.name: features(swing, _later(beside[swing.name]), at.lag) for swing in every}
    scale = np.concatenate(list(known.values())).std(axis=0)
    pairs = tuple(
        Pair(
            first=a.name, second=b.name, p=tail_probability(known[a.name], known[b.name], scale),
            p_moved=tail_probability(known[a.name], moved[b.name], scale),
        )
        for own in swings.values()
        for a, b in combinations(own, 2)
    )  # fmt: skip
    count, rng = sum(pair.p <= LEVEL for pair in pairs), stream(seed, "held", "shuffles")
    as_many = 0
    for _ in range(SHUFFLES):
        mixed = [shuffled([known[swing.name] for swing in own], rng) for own in swings.values()]
        found = sum(tail_probability(a, b, scale) <= LEVEL for own in mixed for a, b in combinations(own, 2))
        as_many += found >= count
    return pairs, (1 + as_many) / (1 + SHUFFLES)


def _later(beside: Linear) -> Linear:
    """Errors as they would be if the camera lagged by `MOVED` more, by the sensitivity to the lag."""
    return replace(beside, error=beside.error + MOVED * beside.change[-1])
