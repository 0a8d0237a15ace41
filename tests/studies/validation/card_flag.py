"""The card flag in the tunnel: a camera and an anemometer that disagree about one wind, and which
part is whose.

A card of 20 × 8 cm in a wind tunnel; a camera's computer tracks points near its free edge at 29 Hz
and writes, on its own clock, the root mean square over 30 frames of how far they move between
frames [px], the peak of their spectrum and an estimate of the wind, half a metre a second for each
pixel; a laptop writes an anemometer's readings at 203 Hz. The wind rises once, from 0 to about 9
m/s in 4 s.

What was fixed before the judged part was opened (only what lies before `OPENED` had been looked
at):

- fitted are rows whose spans end before `OPENED`, judged those whose spans begin after it;
- a row is left out where, within its 30 frames, points were found anew or fewer than five were
  left, or a frame is missing: one jump of the tracker stays in its root mean square for all of
  them;
- the value at rest is the median of the rows before `CALM`; the clock is that of the pairs of
  stamps, known to one frame; dead zone, zero and the flag's law are fitted by
  `tests.studies.instruments`. On the opened part a dead zone held at the log's first step, 0.38
  m/s, and with it a lag of the anemometer were tried and left out: in wind the fit without each
  block erred by 2.3 and 2.8 m/s;
- the error is the root mean square of flag less anemometer, with 90 % intervals over blocks of a
  second.

Expected of the judged part: (1) the tracker's own estimate errs by 4 to 8 m/s, the fitted flag by
less than 2.5; (2) 80 % or more of its rows lie in their intervals of 90 %; (3) the tracker's
frequency lies above 12 Hz of its axis in 80 % or more of the rows: the flutter stays beside half of
the frame rate, where the camera does not show on which side; (4) over spans of 2.5 s the root mean
square scatters by less than over its own second, as a beat of flutter and frames does and a change
of amplitude does not.

After it was opened, only the search was mended, by the likelihood of the fitted rows: as it was
registered, and once more with the law's scale at the mean motion, it ended before the optimum, and
the fitted flag erred by 2.39 and 2.91 m/s in the judged part. The figures are of the search that
ends at one place from all starts.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from flagdata.align import pair_clocks
from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.core.clock_model import NINETY
from flagdata.core.rng import stream
from flagdata.core.stated import Stated
from flagdata.timebase import NANOSECONDS, parse
from models.evaluation import Resamples, estimate
from models.evaluation.bootstrap import ratio
from tests.evidence import ABSENT, REFERENCE
from tests.studies.figure_bytes import png
from tests.studies.instruments.disagreement import (
    Disagreement,
    Readings,
    Rows,
    fit,
    jackknife,
    without,
)

FOLDER = REFERENCE / "wind" / "flag-camera-tunnel"
ORIGIN = parse("2025-12-09T16:15:45", default=UTC)
OPENED = 16.5
"""s after `ORIGIN` up to which the data had been looked at when all this was written."""
CALM = 6.5
"""s before which the fan is off and the tracker undisturbed."""
FRAMES = 30
"""Frames of the tracker's root mean square."""
TRACKER = 0.5
"""m/s of its estimate for each pixel."""
EVERY = 0.25
BLOCK = 1.0
LONG = 2.5
EFFECTS = ("clock-offset", "anemometer-dead-zone", "anemometer-offset")
FEWEST_POINTS = 5
_GAP = 0.1


@dataclass(frozen=True, kw_only=True, eq=False)
class Tracked:
    """What both computers wrote, times in seconds after `ORIGIN`.

    Attributes:
        stamps, motion, frequency, estimate: (n,) of the camera's computer [s, px, Hz, m/s].
        sound: (n,) whether none of a row's frames is missing, lost or of points that were found
            anew.
        clock: what the laptop's clock is ahead of the camera's computer's.
        log: of the anemometer on the laptop's clock.
        rate: frames a second [Hz].
    """

    stamps: FloatArray
    motion: FloatArray
    frequency: FloatArray
    estimate: FloatArray
    sound: BoolArray
    clock: Stated
    log: Readings
    rate: float

    @property
    def span(self) -> float:
        """Of a root mean square [s]."""
        return FRAMES / self.rate


def tracked(folder: Path, *, until: float = np.inf) -> Tracked:
    """Both files, up to `until` seconds on the laptop's clock."""
    lines = [(at, raw.split(",")) for at, raw in _lines(folder / "pi_log.csv") if at < until]
    rows = np.array([[at, *map(float, raw)] for at, raw in lines if len(raw) == 7])
    host, stamps, points = rows[:, 0], rows[:, 1] - ORIGIN / NANOSECONDS, rows[:, 6]
    instants = [np.round(own * NANOSECONDS).astype(np.int64) for own in (stamps, host)]
    (segment,) = pair_clocks(instants[0], instants[1]).model.segments
    steps = np.diff(stamps)
    lost = np.concatenate([[True], (steps > _GAP) | (np.diff(points) > 0)]) | (
        points < FEWEST_POINTS
    )
    recent = np.convolve(lost, np.ones(FRAMES), mode="full")[: len(lost)] > 0.5
    log = np.array([[at, float(raw)] for at, raw in _lines(folder / "gt_log.csv") if at < until])
    frame = float(np.median(steps))
    return Tracked(
        stamps=stamps,
        motion=rows[:, 2],
        frequency=rows[:, 3],
        estimate=rows[:, 5],
        sound=~recent,
        clock=Stated(low=segment.offset, high=segment.offset, sigma=frame),
        rate=1 / frame,
        log=Readings(times=log[:, 0], speed=log[:, 1]),
    )


def _lines(path: Path) -> Iterable[tuple[float, str]]:
    """Seconds after `ORIGIN` on the laptop's clock, and what stands beside them."""
    with path.open(newline="") as file:
        for stamp, raw in list(csv.reader(file))[1:]:
            yield (parse(stamp, default=UTC) - ORIGIN) / NANOSECONDS, raw


def rows_of(found: Tracked, *, rest: float | None = None) -> tuple[Rows, IntArray]:
    """Rows every quarter of a second, and the places of their frames."""
    wanted = np.arange(found.stamps[0], found.stamps[-1], EVERY)
    places = np.unique(np.searchsorted(found.stamps, wanted))
    places = places[found.sound[places]]
    middles = found.stamps[places] - found.span / 2
    if rest is None:
        rest = float(np.median(found.motion[places][found.stamps[places] < CALM]))
    return Rows(times=middles, span=found.span, values=found.motion[places], rest=rest), places


def fitted(
    found: Tracked, rows: Rows, *, seed: int
) -> tuple[Disagreement, dict[str, Any], FloatArray]:
    """The law and effects of the rows that were opened, a table of them, and errors by the fit
    without each block."""
    use = rows.times + rows.span / 2 < OPENED
    known = {"clock-offset": found.clock}
    answer = fit(rows, found.log, EFFECTS, use=use, known=known, seed=seed)
    sigmas, errors = jackknife(
        rows,
        found.log,
        EFFECTS,
        answer,
        use=use,
        known=known,
        blocks=(rows.times // BLOCK).astype(np.int64),
    )
    values = {"scale": answer.law.scale, "exponent": answer.law.exponent, **answer.chain.strengths}
    table: dict[str, Any] = {name: [value, sigmas[name]] for name, value in values.items()}
    return answer, {**table, "reference": answer.law.reference, "share": answer.share}, errors


def stages(
    found: Tracked, rows: Rows, places: IntArray, answer: Disagreement
) -> dict[str, FloatArray]:
    """Errors (n,) of each row as one thing after the other is put right [m/s]."""
    log, at = found.log, found.stamps[places]
    own, clock = found.estimate[places], found.clock.low
    instant = 2 / 203.0
    zero = answer.chain.strengths["anemometer-offset"]
    dead = without(answer, "anemometer-dead-zone")
    return {
        "as logged": own - log.means(at, instant),
        "clock of the pairs": own - log.means(at + clock, instant),
        "tracker's second": own - log.means(rows.times + clock, rows.span),
        "anemometer's zero": own + zero - log.means(rows.times + clock, rows.span),
        "flag's law": dead.errors(rows, log),
        "anemometer's dead zone": answer.errors(rows, log),
    }


def root_mean_square(
    errors: FloatArray, rows: Rows, use: BoolArray, *, seed: int
) -> dict[str, Any]:
    """With its interval over blocks of a second."""
    use = use & np.isfinite(errors)
    if not use.any():
        return {"rows": 0}
    blocks = (rows.times[use] // BLOCK).astype(np.int64)
    resamples = Resamples.of(blocks, generator=stream(seed, "card-flag", "bootstrap"))
    sums = resamples.sums(np.stack([np.square(errors[use]), np.ones(int(use.sum()))], axis=1))
    found = estimate(
        np.sqrt(ratio(sums[:, 0], sums[:, 1])),
        name="rmse",
        unit="m/s",
        clips=int(use.sum()),
        groups=resamples.groups,
    )
    return {
        "rmse": found.value,
        "interval": found.quantity.span.ends(),
        "rows": found.clips,
        "blocks": found.groups,
        "bias": float(errors[use].mean()),
    }


def long_rows(found: Tracked, rows: Rows) -> Rows:
    """Quadratic means over spans of `LONG` of what is in the rows, where they cover one."""
    reach = (LONG - rows.span) / 2
    middles, values = [], []
    for middle in rows.times.tolist():
        near = np.abs(rows.times - middle) <= reach + 1e-9
        if near.sum() >= 2 * reach / EVERY - 1:
            middles.append(middle)
            values.append(float(np.sqrt(np.square(rows.values[near]).mean())))
    return Rows(times=np.array(middles), span=LONG, values=np.array(values), rest=rows.rest)


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Errors as one thing after another is put right, on what was fitted and on what was not."""
    if not FOLDER.is_dir():
        return ABSENT
    judge = os.environ.get("FLAGDATA_CARD_FLAG", "judge") == "judge"
    found = tracked(FOLDER, until=np.inf if judge else OPENED)
    rows, places = rows_of(found)
    answer, table, left = fitted(found, rows, seed=seed)
    opened = rows.times + rows.span / 2 < OPENED
    judged = rows.times - rows.span / 2 > OPENED
    blowing = found.log.means(rows.times + found.clock.low, rows.span) > 1.0
    errors = stages(found, rows, places, answer)
    long = long_rows(found, rows)
    parts = {
        "fitted": opened,
        "fitted, calm": opened & ~blowing,
        "fitted, in wind": opened & blowing,
    }
    parts |= {"judged": judged} if judge else {}
    sheet: dict[str, Any] = {
        "clock": [found.clock.low, found.clock.sigma],
        "frame_rate": found.rate,
        "rest": rows.rest,
        "fit": table,
        "rows": len(rows.times),
        "stages": {
            name: {part: root_mean_square(own, rows, use, seed=seed) for part, use in parts.items()}
            for name, own in errors.items()
        },
        "left_out": {
            name: root_mean_square(left, rows, use, seed=seed)
            for name, use in parts.items()
            if name != "judged"
        },
        "without": {
            name: {
                part: root_mean_square(
                    without(answer, name).errors(rows, found.log), rows, use, seed=seed
                )
                for part, use in parts.items()
            }
            for name in EFFECTS
        },
    }
    steady = blowing & (found.log.means(rows.times + found.clock.low, rows.span) > 8.0)
    for part, use in (("fitted", opened), *((("judged", judged),) if judge else ())):
        own = use & steady
        inside = [bool((np.abs(rows.times[use] - at) < 1e-9).any()) for at in long.times]
        wide = np.array(inside) & (found.log.means(long.times + found.clock.low, LONG) > 8.0)
        sheet[f"flutter_{part}"] = {
            "rows": int(own.sum()),
            "above_12_hz": float((found.frequency[places][own] > 12.0).mean())
            if own.any()
            else None,
            "frequencies": np.quantile(found.frequency[places][own], [0.0, 0.5, 1.0]).tolist()
            if own.any()
            else None,
            "scatter_of_a_second": float(np.log(rows.values[own]).std()) if own.any() else None,
            "scatter_of_2.5_s": float(np.log(long.values[wide]).std()) if wide.any() else None,
            "long_rows": int(wide.sum()),
        }
    final = errors["anemometer's dead zone"]
    own = {"fitted": long.times + LONG / 2 < OPENED, "judged": long.times - LONG / 2 > OPENED}
    sheet["over_2.5_s"] = {
        part: root_mean_square(answer.errors(long, found.log), long, use, seed=seed)
        for part, use in own.items()
    }
    sheet["in_intervals_of_90"] = {
        part: float((np.abs(final[use]) <= NINETY * answer.deviation(rows)[use]).mean())
        for part, use in parts.items()
    }
    out.joinpath("validate-card-flag.png").write_bytes(png(_picture(found, rows, places, answer)))
    return sheet


def _picture(found: Tracked, rows: Rows, places: IntArray, answer: Disagreement) -> Figure:
    figure = Figure(figsize=(9.0, 6.0), layout="constrained")
    wind, motion = figure.subplots(2, 1, sharex=True)
    at = found.log.times - found.clock.low
    wind.plot(at, found.log.speed, color="#2b6f8f", label="anemometer, as logged")
    wind.plot(
        found.stamps, found.estimate, color="#999999", linewidth=1, label="tracker's own estimate"
    )
    predicted = answer.errors(rows, found.log) + found.log.means(
        rows.times + answer.chain.clock, rows.span
    )
    half = NINETY * answer.deviation(rows)
    wind.errorbar(
        rows.times,
        predicted,
        yerr=half,
        fmt=".",
        color="#c4622d",
        linewidth=0.7,
        label="flag as that anemometer reads it",
    )
    wind.set_ylabel("wind [m/s]")
    wind.legend(loc="upper left", fontsize=8)
    motion.plot(
        found.stamps, found.motion, color="#2b6f8f", label="root mean square over 30 frames [px]"
    )
    motion.plot(
        found.stamps[places], found.motion[places], ".", color="#c4622d", label="rows that count"
    )
    motion.plot(
        found.stamps,
        found.frequency,
        color="#999999",
        linewidth=1,
        label="tracker's frequency [Hz]",
    )
    motion.set_xlim(0.0, float(found.stamps[-1]) + 0.5)
    motion.set_xlabel("time on the camera's computer [s]")
    motion.legend(loc="upper left", fontsize=8)
    for axes in (wind, motion):
        axes.axvspan(OPENED, float(found.stamps[-1]), color="#eeeeee")
    return figure
