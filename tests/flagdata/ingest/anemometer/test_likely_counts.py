"""A count whose unit is likely is offered with it, so that the line works as it is printed; units alone name counts."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

from flagdata.errors import FlagdataError, InputError
from flagdata.rng import stream
from flagdata.signals import WindLog
from flagdata.timebase import NANOSECONDS

Read = Callable[..., WindLog]
START = 1_777_636_800 * NANOSECONDS
STEPS = np.round(40 + np.cumsum(stream(31, "counts").uniform(0.0004, 0.003, 20)), 9)


def offered(read: Read, text: str, **options: object) -> tuple[str, str]:
    """The fix of the refusal of a log, and the line of columns in it."""
    with pytest.raises(FlagdataError) as caught:
        read(text, **options)
    fix = caught.value.fix or ""
    return fix, re.findall(r'--columns "([^"]*)"', fix)[0]


@pytest.mark.parametrize(
    ("unit", "seconds"), [("s", 1), ("ms", 1e-3), ("us", 1e-6), ("µs", 1e-6), ("min", 60), ("h", 3600), ("d", 86_400)]
)
def test_the_unit_of_a_count_alone_names_its_format(read: Read, unit: str, seconds: float) -> None:
    text = "t,wind speed (m/s)\n" + "".join(f"{20 + 3 * at},{4 + at % 3}.5\n" for at in range(9))
    found = read(text, columns=f"time[{unit}],wind_speed[m/s]", start=START)
    assert (found.series.time - START).tolist() == [round(3 * at * seconds * NANOSECONDS) for at in range(9)]


@pytest.mark.parametrize(("step", "unit"), [(0.12, "s"), (50, "ms")])
def test_a_likely_unit_stands_in_the_line_that_is_offered(read: Read, step: float, unit: str) -> None:
    rows = "".join(f"{round(3 + at * step, 3)},{4 + at % 3}.5\n" for at in range(12))
    fix, line = offered(read, f"Timestamp,wind speed (m/s)\n{rows}")
    assert f"time[elapsed-{unit}]" in line
    assert "--start TIME" in fix
    assert len(read(f"Timestamp,wind speed (m/s)\n{rows}", columns=line, start=START).series) == 12


def test_a_heading_of_more_columns_than_rows_fill_is_told_as_it_is(read: Read) -> None:
    rows = "".join(f"{3 + at * 0.12:.3f},{4 + at % 3}.5,{200 + at},,,\n" for at in range(12))
    text = f"Time (s),Wind Speed (m/s),Wind Direction (deg),Load 1,Load 2,Load 3\n{rows}"
    said = " ".join(read(text, start=START).reasons)
    assert "line 1 names 6 columns, of which rows fill the first 3" in said


def gill(letter: str) -> str:
    rows = "".join(
        f"{value:.9f},b'\\x02Q,{150 + at},00{3 + at % 4}.25,{letter},00,\\x031A\\r\\n'\n"
        for at, value in enumerate(STEPS)
    )
    return f"run of a test\nFormat, Wind Direction, Wind Speed, Units, Status, Checksum\n{rows}"


@pytest.mark.parametrize(
    ("letter", "scale"), [("M", 1), ("N", 0.514444), ("P", 0.44704), ("K", 1 / 3.6), ("F", 0.00508)]
)
def test_gills_letters_state_the_unit_and_a_growing_first_column_is_a_count(
    read: Read, letter: str, scale: float
) -> None:
    fix, line = offered(read, gill(letter))
    assert line.startswith("time[elapsed-s],")
    assert "add --start TIME" in fix
    assert "?" not in line
    assert "unit of column" not in fix
    found = read(gill(letter), columns=line, start=START)
    assert found.series.channels["wind_speed"][:2].tolist() == pytest.approx([3.25 * scale, 4.25 * scale], rel=1e-5)
    seconds = (found.series.time - START) / NANOSECONDS
    assert seconds.tolist() == pytest.approx((STEPS - STEPS[0]).tolist(), abs=1e-8)


def test_a_letter_that_changes_states_no_unit(read: Read) -> None:
    with pytest.raises(InputError, match="unit"):
        read(gill("M").replace(",M,", ",N,", 1))


def test_a_year_of_two_digits_and_its_day_are_offered_as_such(read: Read) -> None:
    text = "".join(f"{96_001 + at}  21.8  {1 + at % 5}.7\n" for at in range(20))
    fix, line = offered(read, text, columns="time,,wind_speed[m/s]", zone="UTC")
    assert "%y%j" in fix
    log = read(text, columns=line, zone="UTC")
    assert [str(np.datetime64(int(log.series.time[at]), "ns"))[:10] for at in (0, -1)] == ["1996-01-01", "1996-01-20"]
