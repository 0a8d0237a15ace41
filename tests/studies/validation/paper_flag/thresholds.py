"""Tables of the paper flag: at which tunnel speed sheets of which length start and stop
fluttering."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from flagdata.errors import InputError, NotFoundError


@dataclass(frozen=True, kw_only=True)
class Threshold:
    """One measured threshold.

    Attributes:
        length: of the sheet [m].
        speed: of the tunnel [m/s].
        frequency: of the flutter there [Hz]; None where the table has none.
    """

    length: float
    speed: float
    frequency: float | None = None


def speeds_by_length(path: Path, *, column: str) -> tuple[Threshold, ...]:
    """Rows `L,<column>`: length in millimetres, speed in m/s with a decimal comma; 0 means that it
    was not measured.

    Raises:
        NotFoundError, InputError: no such file; a row without the columns or that is no number.
    """
    found = []
    for line, row in _rows(path, {"L", column}):
        speed = _number(row[column].replace(",", "."), path, line)
        if speed:
            found.append(
                Threshold(
                    length=_number(row["L"].replace(",", "."), path, line) / 1000, speed=speed
                )
            )
    return tuple(found)


def authors_thresholds(path: Path) -> tuple[tuple[Threshold, ...], tuple[Threshold, ...]]:
    """Bistable and flutter thresholds with their frequencies: length in centimetres, decimal
    points.

    Raises:
        NotFoundError, InputError: as `speeds_by_length`.
    """
    bistable, flutter = [], []
    for line, row in _rows(path, {"L", "U_bistable", "f_bistable", "U_flutter", "f_flutter"}):
        number = {
            key: _number(row[key], path, line) for key in row if key and key not in ("", "Caso")
        }
        length = number["L"] / 100
        bistable.append(
            Threshold(length=length, speed=number["U_bistable"], frequency=number["f_bistable"])
        )
        flutter.append(
            Threshold(length=length, speed=number["U_flutter"], frequency=number["f_flutter"])
        )
    return tuple(sorted(bistable, key=lambda t: t.length)), tuple(
        sorted(flutter, key=lambda t: t.length)
    )


def digitised_curves(path: Path) -> dict[str, tuple[tuple[float, float], ...]]:
    """Name → (x, y) pairs of a table whose first line names pairs of columns, and whose second says
    X, Y.

    Raises:
        NotFoundError, InputError: as `speeds_by_length`.
    """
    if not path.is_file():
        raise _missing(path)
    rows = list(csv.reader(path.read_text(encoding="utf-8-sig").splitlines()))
    curves = {}
    for index, name in enumerate(rows[0] if rows else ()):
        if name:
            pairs = [
                (row[index], row[index + 1], line) for line, row in enumerate(rows[2:], start=3)
            ]
            curves[name] = tuple(
                (_number(x, path, line), _number(y, path, line)) for x, y, line in pairs if x and y
            )
    return curves


def _rows(path: Path, needed: set[str]) -> Iterator[tuple[int, dict[str, str]]]:
    if not path.is_file():
        raise _missing(path)
    reader = csv.DictReader(path.read_text(encoding="utf-8-sig").splitlines())
    absent = needed - set(reader.fieldnames or ())
    if absent:
        raise InputError(
            f"no column {min(absent)!r}", where=str(path), fix=f"give {', '.join(sorted(needed))}"
        )
    yield from enumerate(reader, start=2)


def _number(text: str | None, path: Path, line: int) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(
            f"{text!r} is not a number", where=f"{path}, line {line}", fix="correct the cell"
        )
    return value


def _missing(path: Path) -> NotFoundError:
    return NotFoundError(
        "no such file", where=str(path), fix="give the folder that holds video/ and flutter/"
    )
