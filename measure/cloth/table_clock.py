"""A table of observables and a log of the wind beside it on one clock: by a given offset, or
estimated.

Estimated as two logs of one wind are (`flagdata.align.logs`): the observable of the table that
rises with the wind takes the place of the second log, of unknown gain. It follows the wind by the
flag's response.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from flagdata.align.declared import given
from flagdata.align.lag import LagSearch
from flagdata.align.logs import clock_between
from flagdata.core.arrays import FloatArray
from flagdata.core.clock_model import ClockModel
from flagdata.core.rng import stream
from flagdata.core.schema import Kind
from flagdata.core.stated import Stated
from flagdata.errors import InputError, RefusedError, UsageError
from flagdata.lake import Lake
from flagdata.record import Record
from flagdata.record.signals import Sensor, WindSeries
from measure.cloth.tables_of_observables import Beside, Columns, instants, rows_of
from measure.film.similarity import FlagSize

_FOLLOWS = (
    "outline-speed",
    "middle-speed",
    "extension",
    "amplitude-across",
    "amplitude-up",
    "droop",
    "frequency",
)
"""Observables that follow the wind, those that do so most closely first; the droop falls with
it."""


def join_log(
    path: Path,
    size: FlagSize,
    *,
    lake: Lake,
    log: str,
    at: str,
    offset: Stated | None = None,
    progress: Callable[[int], object] | None = None,
) -> tuple[Beside, str]:
    """Joins the log of a lake to a table, with its artifact's id.

    Args:
        log: a wind artifact by its id, a unique prefix or its name.
        at: branch, tag or version of the lake.
        offset: seconds added to the table's clock to reach the log's; None to estimate it.
        progress: called with 1 for each part compared.

    Raises:
        UsageError: an artifact that is no wind, or an offset without an uncertainty.
        InputError: a table without times or observables, a log without samples.
        RefusedError: no offset can be estimated.
    """
    table = rows_of(path, size)
    artifact = lake.artifact(log, at=at, kinds=(Kind.WIND,))
    if artifact.kind is not Kind.WIND or artifact.object is None:
        raise UsageError(
            f"{artifact.name!r} is a {artifact.kind}, not a wind",
            where="--log",
            fix="name a wind artifact: flagdata ls",
        )
    series = Record.open(lake.object_path(str(artifact.object))).wind()
    if series is None:
        raise InputError(
            "the wind artifact holds no samples", where=artifact.id, fix="ingest the log anew"
        )
    names = (artifact.name or artifact.id[:12], path.stem)
    if offset is not None:
        clock = declared_clock(table, offset, names=names)
    else:
        clock = estimated_clock(table, series, names=names, seed=artifact.id, progress=progress)
    return Beside(series=series, clock=clock), artifact.id


def declared_clock(table: Columns, offset: Stated, *, names: tuple[str, str]) -> ClockModel:
    """Returns the table's clock on the log's, by an offset that is given.

    Args:
        names: of the log and the table.

    Raises:
        UsageError: an offset without a standard uncertainty.
    """
    if offset.low < offset.high or not offset.sigma > 0:
        raise UsageError(
            f"the offset {offset.text} s has no uncertainty",
            where="--clock-offset",
            fix="state how well it is known, as in 0.3±0.1",
        )
    times = instants(table)
    return given(
        names[1],
        names[0],
        start=int(times[0]),
        end=int(times[-1]) + 1,
        offset=offset.low,
        sigma=offset.sigma,
    )


def estimated_clock(
    table: Columns,
    series: WindSeries,
    *,
    names: tuple[str, str],
    seed: str,
    search: LagSearch | None = None,
    progress: Callable[[int], object] | None = None,
) -> ClockModel:
    """Estimates the table's clock on the log's, by what follows the wind in it.

    Args:
        names: of the log and the table.
        seed: names the stream of the surrogate winds.
        search: how far, and the flag's response.

    Raises:
        InputError: no observable that follows the wind.
        RefusedError: no offset can be estimated, with the reason.
    """
    search = search or LagSearch()
    values = follows(table)
    finite = np.isfinite(values)
    motion = WindSeries(
        time=instants(table)[finite],
        channels={"wind_speed": values[finite]},
        flags=np.zeros(int(finite.sum()), dtype=np.uint16),
        # A row's time is the middle of its span: nothing precedes it.
        sensor=Sensor(name=names[1], averaging=0.0, distance_constant=0.0),
    )
    try:
        model, _, _ = clock_between(
            series,
            motion,
            names=names,
            search=search,
            generator=stream(0, "calibrate", "beside", seed),
            progress=progress,
        )
    except RefusedError as error:
        raise RefusedError(
            error.what,
            where=error.where,
            fix="check that the table and the log are of one wind, or state what is added to the "
            "table's clock to "
            "reach the log's: --clock-offset 0.3±0.1",
        ) from error
    segments = tuple(
        replace(
            segment,
            offset=segment.offset + search.response,
            sigma_offset=math.hypot(segment.sigma_offset, search.response_sigma),
        )
        for segment in model.segments
    )
    return replace(model, segments=segments)


def follows(table: Columns) -> FloatArray:
    """Returns (n,) of the column that follows the wind most closely, from 0 up.

    Raises:
        InputError: none does.
    """
    for name in _FOLLOWS:
        if name in table and np.isfinite(table[name]).any():
            series = math.pi / 2 - table[name] if name == "droop" else table[name]
            return np.asarray(series - min(0.0, float(np.nanmin(series))), dtype=np.float64)
    raise InputError(
        f"there is no observable that follows the wind: {', '.join(_FOLLOWS)}",
        where=table.where,
        fix="state the offset of the clocks: --clock-offset 0.3±0.1",
    )
