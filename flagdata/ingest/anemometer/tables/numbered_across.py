"""Tables whose columns are numbered on, as hours or samples that stand across: what is said where no more is told."""

from __future__ import annotations

import csv
from collections.abc import Sequence

_LEAST = 10
"""Numbers one after another from which they are hours, days or samples."""
_SIGNS = ",;\t"


def told(lines: Sequence[str]) -> tuple[str, str] | None:
    """What such a table seems to be, and what its user can do; `None` for any other text."""
    first = next((line for line in lines if line.strip()), "")
    sign = max(_SIGNS, key=first.count)
    cells = [cell.strip() for cell in next(csv.reader([first], delimiter=sign), [])]
    start = next((at for at, cell in enumerate(cells) if cell in ("0", "00", "1", "01")), len(cells))
    across = cells[start:]
    if len(across) < _LEAST or not all(cell.isdigit() for cell in across):
        return None
    numbers = [int(cell) for cell in across]
    if numbers != list(range(numbers[0], numbers[0] + len(numbers))):
        return None
    places = f" beside {', '.join(map(repr, cells[:start]))}" if start else ""
    what = (
        f"columns {start + 1} to {len(cells)} are numbered {numbers[0]} to {numbers[-1]}{places}, as hours, days or "
        "samples across are; no line tells of which quantity, in which unit or from which day"
    )
    fix = (
        "turn the table, so that each row is one reading with its time, its speed and the place it is of, and name "
        'the columns in its first line, as "time,site,wind speed (m/s)"'
    )
    return what, fix
