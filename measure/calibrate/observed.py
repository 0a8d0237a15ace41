"""What is calibrated on: the observables of a film's windows and the log of the wind beside it."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from flagdata.errors import InputError
from flagdata.files import check_input
from flagdata.findings import Finding, Severity
from flagdata.provenance import file_hash
from measure.calibrate.prior import Floats
from measure.calibrate.simulation import OBSERVED
from measure.calibrate.summary import LEAST_WINDOWS, SHOWN, Projection, shown
from measure.calibrate.wind import STEADY, Log
from measure.observables import OBSERVABLES
from measure.observables.observable import WINDOW

LONGEST = 120.0
"""s of a film that are simulated: two minutes cost minutes."""
_TABLE_LIMIT = 1 << 26  # B
_TIME, _SPEED = "time", "wind"


@dataclass(frozen=True, kw_only=True, eq=False)
class Observed:
    """A recording.

    Attributes:
        name: what people call it.
        source: identity of what it was read from.
        readings: (window, observable) of windows of `WINDOW` seconds that follow one another, in the order of
            `simulation.OBSERVED`; NaN where a window does not show one.
        sigma: (observable,) what readings of a film are off by, the same in all its windows; 0 for geometry.
        log: of the wind, its times since the first window begins.
        first: where the first window begins in the film or table [s].
        findings: what was noticed.

    Raises:
        InputError: shapes that disagree, too few windows, or no observable in enough of them.
    """

    name: str
    source: str
    readings: Floats
    log: Log
    first: float = 0.0
    sigma: Floats = field(default_factory=lambda: np.zeros(len(OBSERVED)))
    findings: tuple[Finding, ...] = ()

    def __post_init__(self) -> None:
        count = len(OBSERVED)
        if self.readings.ndim != 2 or self.readings.shape[1] != count or self.sigma.shape != (count,):
            raise InputError(
                f"readings of shape {self.readings.shape}", where=self.name, fix=f"give (window, {count}) of {OBSERVED}"
            )
        if len(self.readings) < LEAST_WINDOWS:
            raise InputError(
                f"{len(self.readings) * WINDOW:g} s of film with a log beside them", where=self.name,
                fix=f"give {LEAST_WINDOWS * WINDOW:g} s or more; two minutes are better",
            )  # fmt: skip
        if not shown(self.readings).any():
            raise InputError(
                f"no flag is found: no observable is shown by {SHOWN:.0%} of the windows", where=self.name,
                fix="look at the film with flagdata observe --picture, and choose the flag with --crop or --flag",
            )  # fmt: skip

    @property
    def duration(self) -> float:
        """[s]."""
        return len(self.readings) * WINDOW

    @property
    def speed(self) -> Floats:
        """(window,) mean of the logged wind [m/s]."""
        starts = np.arange(len(self.readings)) * WINDOW
        return self.log.mean_speed(starts, starts + WINDOW)

    @property
    def steady(self) -> bool:
        """Whether the wind is constant."""
        speed = self.speed
        return float(speed.std()) < STEADY * float(speed.mean())

    @property
    def projection(self) -> Projection:
        """From its windows to its summary."""
        return Projection(speed=self.speed, changes=not self.steady)

    @property
    def summary(self) -> Floats:
        """(summary,)."""
        return self.projection.of(self.readings).ravel()

    def noticed(self) -> tuple[Finding, ...]:
        """What was found on it, with what its wind leaves open."""
        if not self.steady:
            return self.findings
        what = (
            f"the wind hardly changes ({self.speed.mean():.1f} m/s, its windows within {self.speed.std():.2f} m/s): "
            "air density, drag coefficient, the anemometer's gain and the weight act alike, and the weight rests on "
            "what is assumed of the others"
        )
        fix = "add recordings in other winds: flagdata calibrate takes several of one flag"
        return (*self.findings, Finding(kind="constant-wind", severity=Severity.WARNING, what=what, fix=fix))


def cut(found: Observed, first: float, last: float | None) -> Observed:
    """The windows from `first` to `last` [s], `LONGEST` at most.

    Raises:
        InputError: the log does not cover them, or too few are left.
    """
    begin = math.ceil(first / WINDOW - 1e-9)
    end = len(found.readings) if last is None else math.floor(last / WINDOW + 1e-9)
    most = begin + round(LONGEST / WINDOW)
    findings = found.findings
    if min(end, len(found.readings)) > most:
        findings = (*findings, first_part((min(end, len(found.readings)) - begin) * WINDOW))
    readings = found.readings[begin : min(end, most)]
    log = found.log.cut(begin * WINDOW, (begin + len(readings)) * WINDOW)
    return replace(found, readings=readings, log=log, first=found.first + begin * WINDOW, findings=findings)


def first_part(duration: float) -> Finding:
    """What a recording of that duration [s] above `LONGEST` is reported with."""
    what = f"of {duration:.1f} s the first {LONGEST:g} are used"
    return Finding(kind="first-part", severity=Severity.NOTE, what=what, fix="choose others with --start and --end")


def of_table(path: Path) -> Observed:
    """A table of observables, Parquet or comma-separated: one row a window of `WINDOW` seconds, in the order of time.

    Its columns: `time`, the middle of a window [s]; `wind`, the logged mean over it [m/s]; and observables by their
    names, in their units, each perhaps with another column NAME-sigma, what it is off by. Blank cells are windows that
    do not show one. Columns NAME-reason, why not, are passed over.

    Raises:
        InputError: no such table.
        FlagdataError: a file that cannot be read.
    """
    check_input(path, limit=_TABLE_LIMIT)
    where = str(path)
    heading, rows = _cells(path)
    known = {_TIME, _SPEED, *OBSERVABLES, *(f"{name}-sigma" for name in OBSERVABLES)}
    if unknown := [name for name in heading if name not in known and not name.endswith("-reason")]:
        raise InputError(f"columns {', '.join(unknown)} are not known", where=where, fix=f"keep {', '.join(known)}")
    if missing := [name for name in (_TIME, _SPEED) if name not in heading]:
        raise InputError(f"no column {' or '.join(missing)}", where=where, fix="add it: see flagdata calibrate --help")
    columns = {
        name: _numbers(rows, place, name, where) for place, name in enumerate(heading) if not name.endswith("-reason")
    }
    times = columns[_TIME]
    if len(times) < 2 or not np.allclose(np.diff(times), WINDOW, atol=0.05 * WINDOW):
        raise InputError(
            f"windows that do not follow one another every {WINDOW:g} s", where=where, fix="give one row a window"
        )
    speed = columns[_SPEED]
    if not np.isfinite(speed).all():
        raise InputError("a window without a wind speed", where=where, fix="leave out what lies before the gap")
    blank = np.full(len(times), np.nan)
    sigma = [columns.get(f"{name}-sigma", np.zeros(1)) for name in OBSERVED]
    return Observed(
        name=path.stem, source=file_hash(path),
        readings=np.stack([columns.get(name, blank) for name in OBSERVED], axis=1),
        sigma=np.array([float(np.nanmean(own)) if np.isfinite(own).any() else 0.0 for own in sigma]),
        log=Log(times=times - times[0] + WINDOW / 2, speed=speed, averaging=WINDOW),
    )  # fmt: skip


def _cells(path: Path) -> tuple[list[str], list[list[str]]]:
    """Heading and rows of a table as text.

    Raises:
        InputError: no table of that format.
    """
    if path.suffix.lower() == ".parquet":
        import pyarrow as pa
        import pyarrow.parquet as pq

        try:
            table = pq.read_table(path)
        except pa.ArrowException as error:
            raise InputError(f"no Parquet table: {error}", where=str(path), fix="name a table") from None
        columns = [["" if cell is None else str(cell) for cell in column.to_pylist()] for column in table.columns]
        return table.column_names, [list(row) for row in zip(*columns, strict=True)]
    with path.open(encoding="utf-8-sig", newline="") as file:
        rows = list(csv.reader(file))
    return ([cell.strip() for cell in rows[0]] if rows else []), rows[1:]


def _numbers(rows: Sequence[Sequence[str]], place: int, name: str, where: str) -> Floats:
    found = []
    for number, row in enumerate(rows, start=2):
        cell = row[place].strip() if place < len(row) else ""
        try:
            found.append(float(cell) if cell else math.nan)
        except ValueError:
            raise InputError(
                f"{cell!r} is no number", where=f"{where}, line {number}, column {name}", fix="correct the cell"
            ) from None
    return np.array(found)
