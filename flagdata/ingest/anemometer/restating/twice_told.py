"""Directions that are told twice in one cell, as a point of the compass and as an angle: SW (225°), 225° SW, 225 (SW).

The angle is kept, since it says more. That the cell is a direction is told by both saying the same: an angle is within
half a step of 22.5° of its point, of a point of eight within 22.5°. Degrees of latitude, 45 N, are not.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from flagdata.compass import BY_UNIT
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_POINT = r"(?P<point{0}>[^\W\d_](?:[^\W\d_]|[ -](?=[^\W\d_])){{0,15}})"
_ANGLE = r"(?P<angle{0}>\d{{1,3}}(?:\.\d+)?) ?(?:°|º|deg)?"
_CELL = re.compile(
    rf"(?:^|(?<=[,;\t|\"])) {{0,3}}(?:{_POINT.format(1)} {{0,3}}[(\[]? ?{_ANGLE.format(1)} ?[)\]]?"
    rf"|{_ANGLE.format(2)} ?[(\[]? ?{_POINT.format(2)} ?[)\]]?) {{0,3}}(?=$|[,;\t|\"])"
)
_NEAR = 22.5 + 1
_SHARE = 0.9
_LEAST = 3
_POINTS = 3
"""Different points that a column must hold: a place's longitude, 90 E, holds one."""


def matches(lines: Sequence[str]) -> bool:
    """Whether most lines, headings apart, hold one direction in both spellings."""
    rows = [line for line in lines if any(map(str.isdigit, line))]
    return _table(rows) is not None


def as_table(source: TextFile) -> TableText | None:
    """The same lines with the angles alone; `None` where they are of another kind after all."""
    rows = [line for line in source.head() if any(map(str.isdigit, line))]
    points = _table(rows)
    if points is None:
        return None
    apart = 0
    text: list[str] = []
    for _, lines in source.blocks():
        for line in lines:
            kept, differ = _angles(line, points)
            text.append(kept)
            apart += differ
    what = "each direction is told as a point of the compass and as an angle: the angle is read"
    notes = [Finding(kind="direction-told-twice", severity=Severity.NOTE, what=what)]
    if apart:
        what = f"{apart} directions are told twice and differ by more than {_NEAR:g}°: left as they are, unreadable"
        notes.append(Finding(kind="directions-differ", severity=Severity.WARNING, count=apart, what=what))
    return TableText.of(source, text, notes)


def _both(match: re.Match[str], points: Mapping[str, float]) -> tuple[float, float] | None:
    """The point's angle and the angle [deg] of a cell; `None` where its letters are no point."""
    point = points.get((match["point1"] or match["point2"]).upper())
    return None if point is None else (point, float(match["angle1"] or match["angle2"]))


def _agree(both: tuple[float, float]) -> bool:
    return abs((both[1] - both[0] + 180) % 360 - 180) <= _NEAR


def _table(rows: Sequence[str]) -> Mapping[str, float] | None:
    """The points of the language in which most rows say the same twice; `None` where none does."""
    cells = [list(_CELL.finditer(row)) for row in rows]
    if sum(map(bool, cells)) < max(_LEAST, _SHARE * len(rows)):
        return None
    for points in BY_UNIT.values():
        told = [both for found in cells for match in found if (both := _both(match, points)) is not None]
        right = [both for both in told if _agree(both)]
        if len(right) >= max(_LEAST, _SHARE * len(rows)) and len({point for point, _ in right}) >= _POINTS:
            return points
    return None


def _angles(line: str, points: Mapping[str, float]) -> tuple[str, int]:
    """A line with the angle alone in each cell that says the same twice, and how many say two things."""
    differ = 0

    def angle(match: re.Match[str]) -> str:
        nonlocal differ
        both = _both(match, points)
        if both is None:
            return match[0]
        if not _agree(both):
            differ += 1
            return match[0]
        return match["angle1"] or match["angle2"]

    return _CELL.sub(angle, line), differ
