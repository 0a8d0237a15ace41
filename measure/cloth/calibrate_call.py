"""Recordings and options of a calibration as they are given: arrays, tables or names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from flagdata.api.measuring_verbs import OfFlag
from flagdata.core.files.caches import user_cache
from flagdata.core.provenance import array_hash
from flagdata.core.stated import Stated
from flagdata.errors import InputError, UnknownNameError
from flagdata.lake import Lake
from flagdata.verbs.shared_options import ATTACHMENTS
from measure.cloth.design import FAR, CalibrationOptions
from measure.cloth.flag_prior import AZIMUTH, ELEVATION, Uncertain, fabric, stated_angle
from measure.cloth.flag_recordings import Opened, Sources, open_recording
from measure.cloth.flag_simulation import Flag
from measure.cloth.observed_recording import Observed, cut
from measure.cloth.tables_of_observables import TIME, Columns, known_columns, of_columns
from measure.film.film_source import FilmReading
from measure.film.similarity import FlagSize

Arrays = Mapping[str, ArrayLike]
Number = float | tuple[float, float] | str | Stated


def options_of(
    chosen: OfFlag, size: FlagSize, *, simulations: int, level: float, seed: int
) -> CalibrationOptions:
    """Returns how a flag of such a size is calibrated.

    Args:
        simulations: for each recording.
        level: of the intervals.
        seed: of all draws.

    Raises:
        UsageError, UnknownNameError: angles or a material that no flag has.
    """

    def angle(name: str, value: Number | None, usual: Uncertain) -> Uncertain:
        return usual if value is None else stated_angle(usual, Stated.of(value), where=f"--{name}")

    return CalibrationOptions(
        flag=Flag(
            length=size.length, height=size.height, attachment=_attachment(chosen.attachment)
        ),
        azimuth=angle("azimuth", chosen.azimuth_deg, AZIMUTH),
        elevation=angle("elevation", chosen.elevation_deg, ELEVATION),
        distance=FAR if chosen.distance is None else chosen.distance,
        simulations=simulations,
        level=level,
        seed=seed,
        material=None if chosen.material is None else fabric(chosen.material, where="--material"),
    )


def folder_of(chosen: OfFlag) -> Path:
    """Returns the folder in which simulations are kept."""
    return user_cache() / "calibrate" if chosen.cache is None else Path(chosen.cache)


def sources_of(
    recordings: Sequence[Arrays | Path | str],
    chosen: OfFlag,
    size: FlagSize,
    lake: Lake | None,
    *,
    at: str,
) -> Sources:
    """Opens recordings: tables that are given as arrays, paths of tables, and recordings of a lake.

    Raises:
        FlagdataError: see `Sources`.
    """
    first, last = chosen.start or 0.0, chosen.end
    offset = None if chosen.clock_offset is None else Stated.of(chosen.clock_offset)
    reading = FilmReading.of(chosen, size)

    def name(numbered: tuple[int, Arrays | Path | str]) -> str:
        number, source = numbered
        return f"recording {number}" if isinstance(source, Mapping) else str(source)

    def opening(numbered: tuple[int, Arrays | Path | str]) -> Opened:
        _, source = numbered
        if isinstance(source, Mapping):
            rows = of_arrays(source, name=name(numbered))
            cuts = tuple(cut(row, first, last) if row.place is None else row for row in rows)
            return Opened(name=name(numbered), parent=None, rows=cuts)
        part = {"first": first, "last": last, "log": chosen.log, "offset": offset}
        return open_recording(str(source), size, reading, lake=lake, at=at, **part)

    return Sources.of(list(enumerate(recordings, start=1)), opening, name=name)


def of_arrays(columns: Arrays, *, name: str) -> tuple[Observed, ...]:
    """Returns the recordings of a table that is given as arrays, in the units of the table of
    observables.

    Raises:
        InputError: a column that is not known, columns of different lengths, or as
            `measure.cloth.tables_of_observables.of_table`.
    """
    values = {
        key.replace("_", "-"): np.asarray(column, dtype=np.float64)
        for key, column in columns.items()
    }
    lengths = {column.shape for column in values.values()}
    if len(lengths) != 1 or len(next(iter(lengths), ())) != 1:
        raise InputError(
            f"columns of shapes {sorted(lengths)}", where=name, fix="give (n,) for each, of one n"
        )
    known_columns(tuple(values), where=name)
    if TIME in values:
        values[TIME] = values[TIME] - values[TIME][0]
    rows = next(iter(lengths))[0]
    table = Columns(where=name, values=values, lines=tuple(range(1, rows + 1)))
    names = sorted(values)
    identity = array_hash({"columns": names}, [values[key] for key in names])
    return of_columns(table, name=name, identity=identity, wind_log=None)


def _attachment(name: str | None) -> str:
    """Returns how a filmed flag is held, by both corners of its hoist unless it is stated.

    Raises:
        UnknownNameError: films have no such attachment.
    """
    if name not in (None, *ATTACHMENTS):
        raise UnknownNameError.of("attachment", name, ATTACHMENTS, where="--attachment")
    return name or ATTACHMENTS[0]
