"""Observables of a film as a table: a row a window, with the log's wind where there is one."""

from __future__ import annotations

import io
import json
import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.dataset.truth import TruthSeries, over_ground
from flagdata.lake.mesh_sequences import write_plain
from flagdata.record.signals import WindSeries
from flagdata.timebase import NANOSECONDS
from measure.observables.not_shown import REASONS
from measure.observables.observable import Observable, WindowReading
from measure.observables.observables_by_name import OBSERVABLES
from measure.observables.watching import Watched

if TYPE_CHECKING:
    import pyarrow as pa

UNSEEN = "no-silhouette"
"""Reason of all observables of a window in which no cloth was found."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ObservableTable:
    """Readings of a film.

    Attributes:
        film: its name.
        length, height: of the flag that the scale is from [m].
        seconds: length of a window.
        time: (w,) middles of the windows [s from the film's first frame].
        readings: observable → (w,) readings.
        wind: (w,) of the log, the mean over the window [m/s]; NaN where it was silent. None without
            a log.
    """

    SCHEMA: ClassVar = "flagdata.observables/1"
    JSON_NAMES: ClassVar = (
        "schema=SCHEMA",
        "film",
        "flag",
        "window=seconds",
        "windows",
        "wind",
        "observables",
    )

    film: str
    length: float
    height: float
    seconds: float
    time: FloatArray
    readings: Mapping[str, tuple[WindowReading, ...]]
    wind: FloatArray | None = None

    def values(self, name: str) -> FloatArray:
        """Returns an observable's values (w,), NaN where a window does not show it."""
        return np.array([reading.value for reading in self.readings[name]])

    def unseen(self, name: str) -> Counter[str]:
        """Counts windows without a value by their reason."""
        return Counter(
            reading.reason for reading in self.readings[name] if reading.reason is not None
        )

    @property
    def empty(self) -> bool:
        """Whether no window has a value."""
        return not any(np.isfinite(self.values(name)).any() for name in self.readings)

    def arrow(self) -> pa.Table:
        """Returns `time`, `wind` and, for each observable, its value, `NAME-sigma` and
        `NAME-reason`; units and meanings are in the fields' metadata."""
        import pyarrow as pa

        columns: list[pa.Array] = [pa.array(self.time)]
        fields = [
            pa.field(
                "time", pa.float64(), metadata={"unit": "s", "meaning": "middle of the window"}
            )
        ]
        if self.wind is not None:
            columns.append(pa.array(self.wind, from_pandas=True))
            fields.append(
                pa.field(
                    "wind", pa.float64(), metadata={"unit": "m/s", "meaning": "the log's mean"}
                )
            )
        for name, readings in self.readings.items():
            observable: Observable = OBSERVABLES[name]
            columns.append(pa.array(self.values(name), from_pandas=True))
            fields.append(
                pa.field(
                    name, pa.float64(), metadata={k: str(v) for k, v in _about(observable).items()}
                )
            )
            columns.append(pa.array(np.full(len(self.time), observable.sigma)))
            fields.append(
                pa.field(f"{name}-sigma", pa.float64(), metadata={"unit": observable.unit})
            )
            columns.append(pa.array([reading.reason for reading in readings], type=pa.string()))
            fields.append(pa.field(f"{name}-reason", pa.string()))
        schema = pa.schema(fields, metadata={"flagdata": json.dumps(self.head())})
        return pa.Table.from_arrays(columns, schema=schema)

    def parquet(self) -> bytes:
        """Returns a Parquet file of the table, which `flagdata calibrate` reads where there is a
        wind."""
        import pyarrow.parquet as pq

        sink = io.BytesIO()
        pq.write_table(self.arrow(), sink, compression="zstd")
        return sink.getvalue()

    def write_zarr(self, folder: Path) -> None:
        """Writes a new Zarr group: `time`, `wind` and each observable over `time`, units and sigmas
        as attributes."""
        import zarr

        group = zarr.open_group(folder, mode="w-", zarr_format=3)
        group.update_attributes(
            {
                "flagdata_observables": self.head(),
                "reasons": {name: dict(self.unseen(name)) for name in self.readings},
            }
        )
        write_plain(group, "time", self.time, ("time",))
        if self.wind is not None:
            write_plain(group, "wind", self.wind, ("time",))
        for name in self.readings:
            write_plain(group, name, self.values(name), ("time",))
            group[name].attrs.update(_about(OBSERVABLES[name]))

    def head(self) -> dict[str, Any]:
        """Describes what the table is of: JSON values."""
        return {
            "schema": self.SCHEMA,
            "film": self.film,
            "flag": [self.length, self.height],
            "window": self.seconds,
        }

    @property
    def flag(self) -> tuple[float, float]:
        """Length and height [m]."""
        return self.length, self.height

    @property
    def windows(self) -> int:
        """How many there are."""
        return len(self.time)

    @property
    def observables(self) -> dict[str, dict[str, Any]]:
        """Of each observable its mean, its standard error and the windows that show it."""
        return {name: self._summary(name) for name in self.readings}

    def _summary(self, name: str) -> dict[str, Any]:
        values = self.values(name)
        values_seen = values[np.isfinite(values)]
        observable: Observable = OBSERVABLES[name]
        return {
            "unit": observable.unit,
            "windows": len(values_seen),
            "mean": float(values_seen.mean()) if len(values_seen) else None,
            "deviation": float(values_seen.std(ddof=1)) if len(values_seen) > 1 else None,
            "sigma": observable.sigma,
            "unseen": dict(self.unseen(name)),
        }

    def lines(self) -> list[str]:
        """Describes each observable in a line, for people."""
        lines = []
        for name in self.readings:
            summary, about = self._summary(name), OBSERVABLES[name]
            unit = "" if about.unit == "1" else f" {about.unit}"
            missing = "".join(
                f"; {count} × {REASONS[kind]}" for kind, count in summary["unseen"].items()
            )
            if summary["mean"] is None:
                lines.append(f"{name:17} not shown{missing}")
                continue
            spread = (
                ""
                if summary["deviation"] is None
                else f", deviation between windows {summary['deviation']:.3f}"
            )
            lines.append(
                f"{name:17} {summary['mean']:8.3f}{unit}{spread}, n = {summary['windows']} "
                f"windows{missing}"
            )
        return lines


def table_of(
    watched: Watched,
    *,
    film: str,
    length: float,
    height: float,
    start: int | None = None,
    wind: WindSeries | None = None,
) -> ObservableTable:
    """Computes all observables of all windows.

    Args:
        start: instant of the film's first frame [UTC ns]; None where it is unknown: then the table
            has no wind.
        wind: of the log.
    """
    nothing = WindowReading(value=math.nan, reason=UNSEEN)
    readings = {
        name: tuple(
            nothing if window is None else OBSERVABLES[name].of_film(window)
            for window in watched.windows
        )
        for name in OBSERVABLES
    }
    logged = None
    if start is not None and wind is not None and over_ground(wind) is not None:
        truth = TruthSeries.of(wind)
        ends = [
            start + round((begin + watched.seconds) * NANOSECONDS)
            for begin in watched.starts.tolist()
        ]
        logged = np.array(
            [truth.before(end, window=max(watched.seconds, truth.period)).wind for end in ends]
        )
    return ObservableTable(
        film=film,
        length=length,
        height=height,
        seconds=watched.seconds,
        time=watched.starts + watched.seconds / 2,
        readings=readings,
        wind=logged,
    )


def _about(observable: Observable) -> dict[str, Any]:
    return {
        "unit": observable.unit,
        "meaning": observable.meaning,
        "sigma": observable.sigma,
        "blind": observable.blind,
    }
