"""Statistics that are drawn, in which it is known what acts: null banks, and experiments judged by
them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from measure.forecasting import PRIOR, THETA, EffectColumn, columns, names, on_markers
from measure.inference import Evidence, NullModel, Nulls
from measure.loop import GUST_COLUMN, LibraryJudgement, judge
from measure.nulls import GUSTS, NullBank, Reference
from measure.probes import REDUCED, Course, Statistics

KINDS, CLOTHS, WINDS, SEGMENTS = 50, 1, 4, 4
COUNT = len(names())
SHED = REDUCED[40]
CLEAR = 6.0
"""Response of a segment to an expected strength, in standard deviations of its errors."""


def expected(column: int) -> float:
    """The strength of a column that is expected where it acts."""
    if column < len(THETA):
        return float(PRIOR[column])
    own = columns()[column - len(THETA)]
    if not isinstance(own, EffectColumn):
        return 0.5
    weighed = {one.name: one.expected for one in on_markers()}
    return weighed.get(own.name, max(end - own.described.null for end in own.described.prior))


EXPECTED = np.array([expected(column) for column in range(COUNT)])


def drawn(
    rng: np.random.Generator, delta: FloatArray, numerics: FloatArray, speeds: FloatArray
) -> Statistics:
    """r = shift of the numerics + R δ + ε of recordings, with coefficients (segment, column) and ε ~ N(0, 1)."""
    recording = np.repeat(np.arange(len(speeds)), SEGMENTS)
    mixed = rng.normal(size=(len(recording), COUNT, COUNT)) + CLEAR * np.eye(COUNT)
    response = mixed / np.abs(EXPECTED)
    r = (
        np.einsum("sij,sj->si", response, delta)
        + numerics[recording]
        + rng.normal(size=(len(recording), COUNT))
    )
    return Statistics(
        recording=recording,
        r=r,
        response=response,
        error=np.ones(len(r)),
        marker_error=np.ones((len(r), 1)),
        lines=rng.exponential(size=(len(r), len(REDUCED), 3)),
    )


def blown(rng: np.random.Generator, segments: int, parts: FloatArray | float = 0.0) -> Course:
    """What noise makes of the wind's course, and a wind of parts (segment, window, part)."""
    size = 100.0
    score = size * np.broadcast_to(parts, (segments, 10, 3)) + size**0.5 * rng.normal(
        size=(segments, 10, 3)
    )
    return Course(score=score, curvature=np.broadcast_to(size * np.eye(3), (*score.shape, 3)))


def pulses(strength: float, *, turned: float = 0.0) -> FloatArray:
    """(segment, window, part) of three recordings: a wind that is weaker for one window of every
    nine."""
    weaker = np.where(np.arange(3 * SEGMENTS * 10) % 9 < 3, -strength, 0.0).reshape(-1, 10, 1)
    return weaker * np.array([1.0, turned, 0.0])


def slow(strength: float) -> FloatArray:
    """The same of a wind that changes from one segment to another, and turns as well."""
    return strength * stream(5, "slow").normal(size=(3 * SEGMENTS, 1, 3)) * np.ones((1, 10, 1))


def made(
    seed: int, *, moments: bool = False, courses: bool = False, settled: bool = False
) -> NullBank:
    """A bank of nulls, with moments about the pole or without, with courses of the wind, with
    settled quantities."""
    rng = np.random.default_rng(seed)
    recordings = KINDS * CLOTHS * WINDS
    cloths = np.repeat(
        rng.normal(size=(KINDS * CLOTHS, len(THETA))) * PRIOR, WINDS * SEGMENTS, axis=0
    )
    delta = np.zeros((len(cloths), COUNT))  # statistics are taken at each one's own calibration
    shifts = np.repeat(rng.normal(size=(KINDS * CLOTHS, COUNT)), WINDS, axis=0)
    speeds = rng.uniform(3, 8, recordings)
    own = drawn(rng, delta, shifts, speeds)
    if moments:
        own = replace(own, turning=replace(drawn(rng, delta, shifts[::-1], speeds), lines=None))
    if courses:
        own = replace(own, course=blown(rng, len(own.r)))
    if settled:
        own = replace(own, settled=0.1 * rng.normal(size=(recordings, 2))[own.recording])
    nulls = Nulls(
        statistics=own,
        speeds=speeds[own.recording],
        calibration=cloths,
        noise=np.zeros(len(cloths)),
        period=np.full(len(cloths), 0.04),
        cloth=np.full(len(cloths), "made"),
        numerics=np.repeat(np.arange(KINDS), CLOTHS * WINDS * SEGMENTS),
    )
    return NullBank(nulls=nulls, columns=names(), duration=2.0, words="made")


Acting = Mapping[str, float | tuple[float, float, float]]


def strengths(acting: Acting) -> FloatArray:
    """(segment, column) of three recordings, from shares of what is expected, of all or of each."""
    delta = np.zeros((3 * SEGMENTS, COUNT))
    for name, share in acting.items():
        each = np.repeat(np.broadcast_to(share, 3), SEGMENTS)
        delta[:, names().index(name)] = each * EXPECTED[names().index(name)]
    return delta


def seen(
    null: NullModel,
    acting: Acting,
    *,
    gusts: float = 0.0,
    line: float = 0.0,
    seed: int = 2,
    moments: Acting | None = None,
    course: FloatArray | None = None,
) -> Evidence:
    """Of three recordings with strengths in units of what is expected, a pressure that fluctuates
    by `gusts`, and `line` of power more at `SHED`, across the wind; beside them moments of other
    strengths, and a course of the wind."""
    rng = np.random.default_rng(seed)
    delta = strengths(acting)
    delta[:, names().index(GUSTS)] += gusts * rng.normal(size=len(delta))
    speeds = np.array([3.5, 5.0, 7.0])
    own = drawn(rng, delta, np.tile(rng.normal(size=COUNT), (3, 1)), speeds)
    assert own.lines is not None
    own.lines[:, np.searchsorted(REDUCED, SHED), 1] += line
    if moments is not None:
        turned = drawn(rng, strengths(moments), np.tile(rng.normal(size=COUNT), (3, 1)), speeds)
        own = replace(own, turning=replace(turned, lines=None))
    if course is not None:
        own = replace(own, course=blown(rng, len(own.r), course))
    return Evidence.of(own, speeds[own.recording], null)


def judged(
    null: NullModel,
    reference: Reference,
    acting: Acting,
    *,
    gusts: float = 0.0,
    line: float = 0.0,
    seed: int = 2,
) -> LibraryJudgement:
    return judge(seen(null, acting, gusts=gusts, line=line, seed=seed), reference, level=0.02)


def named(judgement: LibraryJudgement) -> list[str]:
    return ["gusts" if column == GUST_COLUMN else names()[column] for column in judgement.named]
