"""What a refusal prints to paste names no unit that is guessed, and no component or empty column as a speed."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

from flagdata.errors import FlagdataError, UsageError
from flagdata.ingest.anemometer.times.count_units import likely
from flagdata.signals import WindLog
from flagdata.timebase import NANOSECONDS

Read = Callable[..., WindLog]
START = 1_777_636_800 * NANOSECONDS


def fix_of(read: Read, text: str, **options: object) -> str:
    """The fix of the refusal of a log."""
    with pytest.raises(FlagdataError) as caught:
        read(text, **options)
    return caught.value.fix or ""


def lines(fix: str) -> list[str]:
    return re.findall(r'--columns "([^"]*)"', fix)


@pytest.mark.parametrize(
    ("step", "digits", "form"),
    [
        (1, 0, "s"), (300, 0, "s"), (1800, 0, "s"), (50, 0, "ms"), (200, 0, "ms"), (0.05, 2, "s"), (0.01, 3, "s"),
        (0.125, 3, "s"), (1 / 144, 6, "d"), (1 / 144, 4, "d"), (1 / 48, 4, "d"), (1 / 24, 5, "d"), (1 / 1440, 7, "d"),
        (5, 0, ""), (10, 0, ""), (30, 0, ""), (60, 0, ""), (100, 0, ""), (1000, 0, ""), (37, 0, ""), (0.5, 1, ""),
        (1 / 60, 4, ""), (1 / 12, 5, ""), (1 / 86_400, 5, ""),
    ],
)  # fmt: skip
def test_a_step_that_is_round_in_one_unit_alone_tells_it(step: float, digits: int, form: str) -> None:
    value = np.array([round(3 + step * at, digits) for at in range(40)], dtype=np.float64)
    assert likely(value, digits=digits).form.removeprefix("elapsed-") == form


def test_a_loop_that_is_never_quite_as_long_is_of_milliseconds() -> None:
    steps = np.tile([1003, 998, 1001, 1006], 8)
    assert likely(np.cumsum(steps), digits=0).form == "elapsed-ms"
    assert likely(np.cumsum(np.tile([300, 301, 300, 302], 8)), digits=0).form == ""


@pytest.mark.parametrize(("heading", "form"), [("jd", ".7e"), ("time jd", ".6f"), ("doy", ".8e")])
def test_a_heading_of_days_says_days(read: Read, heading: str, form: str) -> None:
    rows = "".join(f"{format(9 + at / 144, form)},{4 + at % 3}.5\n" for at in range(20))
    (line,) = lines(fix_of(read, f"{heading},wind speed (m/s)\n{rows}"))
    assert line == "time[elapsed-d],wind_speed[m/s]"
    found = read(f"{heading},wind speed (m/s)\n{rows}", columns=line, start=START)
    assert found.series.time[-1] - START == pytest.approx(19 * 600 * NANOSECONDS, abs=NANOSECONDS)


def test_a_unit_that_is_not_told_is_left_open_in_the_line(read: Read) -> None:
    text = "t,wind speed (m/s)\n" + "".join(f"{60 * at},{4 + at % 3}.5\n" for at in range(12))
    fix = fix_of(read, text)
    assert lines(fix) == ["time[elapsed-?],wind_speed[m/s]"]
    assert "it may be elapsed-s or elapsed-min" in fix
    assert "the ? is s, ms, us, min, h or d" in fix
    with pytest.raises(UsageError, match="still has a question mark"):
        read(text, columns=lines(fix)[0], start=START)
    found = read(text, columns=lines(fix)[0].replace("?", "s"), start=START)
    assert found.series.time[-1] - START == 11 * 60 * NANOSECONDS


INPUTS = ("In 4 - U (m/s)", "In 5 - V (m/s)", "In 6 - W (m/s)")


def inputs(rows: int, names: tuple[str, ...] = INPUTS) -> str:
    heading = "\t".join(("Row", "Date", "Time", "CO2 (mmol/m^3)", *names))
    return f"Serial:\tX-12\nTimezone:\tUS/Pacific\n{heading}\n" + "".join(
        f"{7 + at}\t2026-05-01\t12:00:{at:02d}\t15.{at}\t{0.5 + at / 10:.1f}\t{-0.9 + at / 10:.1f}\t-0.{at % 9}1\n"
        for at in range(rows)
    )


@pytest.mark.parametrize("rows", [2, 3, 8])
def test_inputs_that_differ_by_u_v_and_w_alone_are_components(read: Read, rows: int) -> None:
    found = read(inputs(rows), zone="UTC")
    assert found.series.channels["wind_x"][:2].tolist() == pytest.approx([0.5, 0.6])
    assert found.series.channels["wind_y"][:2].tolist() == pytest.approx([-0.9, -0.8])
    assert found.series.channels["wind_z"][:2].tolist() == pytest.approx([-0.01, -0.11])


def test_two_of_the_letters_are_offered_as_no_speeds(read: Read) -> None:
    fix = fix_of(read, inputs(8, ("In 4 - U (m/s)", "In 5 - V (m/s)", "Spare")), zone="UTC")
    assert lines(fix)
    assert not any("wind_speed[m/s]" in line for line in lines(fix))
    assert "--wind 'In" not in fix


def test_a_letter_alone_is_offered_as_no_speed(read: Read) -> None:
    rows = "".join(f"2026-05-01T12:{at:02d}:00Z,{3 + at % 4}.5,{1 + at}\n" for at in range(12))
    fix = fix_of(read, f"time,u (m/s),zu\n{rows}")
    assert not any("wind_speed[" in line for line in lines(fix))
    assert "if it is the wind's whole speed, no component of it, name it: --wind 'u (m/s)'" in fix


def test_a_column_below_zero_is_offered_as_no_speed(read: Read) -> None:
    rows = "".join(f"2026-05-01T12:{at:02d}:00Z,{at - 6}.5,{3 - at}.25\n" for at in range(12))
    fix = fix_of(read, f"time,speed A (m/s),speed B (m/s)\n{rows}")
    assert lines(fix)
    assert not any("wind_speed" in line for line in lines(fix))
    assert "--wind 'speed" not in fix


def test_an_empty_average_is_not_offered_beside_the_latest_reading(read: Read) -> None:
    line = "01/05/26 12:00:30 11.3 61 4.1 NULL 6.6 90 0.0 NULL 1012.2 E 2 kts C mb mm 0.0 NULL 3.6 151.2 0.0 34.5 11 "
    line += "11.3 NULL NULL NULL NULL NULL NULL NULL NULL NULL NULL NULL NULL NULL 3.8.2 0 NULL 11.3 11.3 2 NULL 227 "
    line += "NULL NULL 0 1 0 --- 1314 m 7.6 2.2 NULL 0\n"
    (offered,) = lines(fix_of(read, line, zone="UTC"))
    assert "wind_speed[kn]" in offered
    found = read(line, zone="UTC", columns=offered)
    assert found.series.channels["wind_speed"].tolist() == pytest.approx([6.6 * 1852 / 3600], rel=1e-5)
