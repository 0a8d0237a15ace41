"""Calibration from Python: `flagdata.calibrate`, with recordings as arrays, tables or names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from flagdata.caches import user_cache
from flagdata.calibrated import Calibrated, Weighed
from flagdata.errors import InputError
from flagdata.ingest.camera import CropBox
from flagdata.lake import Lake
from flagdata.provenance import array_hash
from flagdata.stated import Stated
from measure.calibrate.calibrate import Calibration, Options, calibrate
from measure.calibrate.columns import TIME, Columns, known_columns
from measure.calibrate.design import FAR
from measure.calibrate.fabric import fabric
from measure.calibrate.filmed import Opened, Sources, opened
from measure.calibrate.known import known
from measure.calibrate.observed import Observed, cut
from measure.calibrate.prior import AZIMUTH, ELEVATION
from measure.calibrate.simulation import Flag
from measure.calibrate.tables import of_columns
from measure.film.similarity import FlagSize
from measure.film.source import Reading

Arrays = Mapping[str, ArrayLike]
Number = float | tuple[float, float] | str | Stated


def calibrated(
    recordings: Sequence[Arrays | Path | str],
    *,
    flag_size: tuple[float, float],
    attachment: str,
    azimuth_deg: Number | None,
    elevation_deg: Number | None,
    distance: float | None,
    start: float,
    end: float | None,
    crop: tuple[int, int, int, int] | None,
    flag: int | None,
    material: str | None,
    log: str | None,
    offset: Number | None,
    simulations: int,
    level: float,
    seed: int,
    workers: int,
    lake: Lake | None,
    at: str | None,
    cache: Path | None,
) -> Calibrated:
    """What `flagdata.calibrate` does; see there for what it takes.

    Raises:
        FlagdataError: see `flagdata.calibrate`.
    """
    if not recordings:
        raise InputError("no recordings", where="recordings", fix="give at least one")
    size = FlagSize(length=flag_size[0], height=flag_size[1])
    box = None if crop is None else CropBox(x=crop[0], y=crop[1], width=crop[2], height=crop[3])
    reading = Reading(crop=box, flag=flag, aspect=size.aspect)
    options = Options(
        flag=Flag(length=size.length, height=size.height, attachment=attachment),
        azimuth=AZIMUTH if azimuth_deg is None else known(AZIMUTH, Stated.of(azimuth_deg), where="azimuth_deg"),
        elevation=(
            ELEVATION if elevation_deg is None else known(ELEVATION, Stated.of(elevation_deg), where="elevation_deg")
        ),
        distance=FAR if distance is None else distance,
        simulations=simulations,
        level=level,
        seed=seed,
        material=None if material is None else fabric(material, where="material"),
    )

    def name(numbered: tuple[int, Arrays | Path | str]) -> str:
        number, one = numbered
        return f"recording {number}" if isinstance(one, Mapping) else str(one)

    def opening(numbered: tuple[int, Arrays | Path | str]) -> Opened:
        _, one = numbered
        if isinstance(one, Mapping):
            rows = of_arrays(one, name=name(numbered))
            cuts = tuple(cut(each, start, end) if each.place is None else each for each in rows)
            return Opened(name=name(numbered), parent=None, rows=cuts)
        return opened(
            str(one),
            size,
            reading,
            lake=lake,
            at=at or "main",
            first=start,
            last=end,
            log=log,
            offset=None if offset is None else Stated.of(offset),
        )

    gathered = Sources.of(list(enumerate(recordings, start=1)), opening, name=name).read(size)
    found = calibrate(
        gathered.recordings,
        options,
        folder=cache or user_cache() / "calibrate",
        workers=workers,
        left_out=gathered.left_out,
    )
    return _answer(found)


def of_arrays(columns: Arrays, *, name: str) -> tuple[Observed, ...]:
    """The recordings of a table that is given as arrays, in the units of the table of observables.

    Raises:
        InputError: a column that is not known, columns of different lengths, or as `measure.calibrate.tables.of_table`.
    """
    values = {key.replace("_", "-"): np.asarray(column, dtype=np.float64) for key, column in columns.items()}
    lengths = {column.shape for column in values.values()}
    if len(lengths) != 1 or len(next(iter(lengths), ())) != 1:
        raise InputError(f"columns of shapes {sorted(lengths)}", where=name, fix="give (n,) for each, of one n")
    known_columns(tuple(values), where=name)
    if TIME in values:
        values[TIME] = values[TIME] - values[TIME][0]
    rows = next(iter(lengths))[0]
    table = Columns(where=name, values=values, lines=tuple(range(1, rows + 1)))
    names = sorted(values)
    identity = array_hash({"columns": names}, [values[key] for key in names])
    return of_columns(table, name=name, identity=identity, beside=None)


def _answer(found: Calibration) -> Calibrated:
    quantities = {
        one.name: Weighed(
            unit=one.unit,
            value=one.value,
            sigma=one.sigma,
            interval=one.interval,
            assumed=one.assumed,
            bound=one.span.worded(lambda value: f"{value:.4g}", f" {one.unit}") if one.bounded else None,
            level=one.span.level,
        )
        for one in found.cloth
    }
    return Calibrated(
        sentence=found.sentence,
        level=found.options.level,
        quantities=quantities,
        draws={name: found.draws.cloth[name] for name in quantities},
        withheld=found.withheld,
        stated=found.stated,
        findings=found.findings,
        document=found.as_dict(),
    )
