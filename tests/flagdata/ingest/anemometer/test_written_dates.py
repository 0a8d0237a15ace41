"""Dates and times as loggers and spreadsheets of many languages write them, in one column or beside a time of day."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
START = np.datetime64("2026-05-13T14:20:05", "s")
ROWS = 12

ONE_COLUMN = {
    "13 mai 2026 {clock}", "13. Mai 2026 {clock}", "Montag, 13. Mai 2026 {clock}", "13 maja 2026 {clock}",
    "13 мая 2026 {clock}", "mié. 13 mayo 2026 {clock}", "13-mag-2026 {clock}", "Wed May 13 {clock} UTC 2026",
    "Wed May 13 {clock} 2026", "Wed 13.05.2026 {clock}", "mi., 13.05.2026 {clock}", "Wed 05/13/2026 {half} PM",
    "May 13, 2026, {half} PM", "May 13, 2026 @ {clock}.000", "5/13/2026, {half} PM", "13.05.2026, {clock}",
    "13/May/2026:{clock} +0000", "13MAY2026:{clock}", "2026_05_13_14_{ms}", "2026:133:{clock}", "2026-133T{clock}Z",
    "{clock} 13/05/2026", "{half} PM 5/13/2026", "{clock}, 13 May 2026", "2026年5月13日 14时{cjk}秒",
    "2026. 5. 13. 오후 {half}", "2026/5/13 下午 {half}", "13/05/2026 a las {clock}", "13/05/2026 {half} p. m.",
}  # fmt: skip
"""The same instant in a column; {clock} is 14:20:05, {half} 2:20:05."""
TWO_COLUMNS = {
    ("May 13 2026", "{half} PM"), ("Wednesday, May 13, 2026", "{clock}"), ("13 de mayo de 2026", "{clock}"),
    ("13-mai-26", "{clock}"), ("May-13-2026", "{clock}"), ("13May2026", "{clock}"), ("2026-133", "{clock}"),
    ("13052026", "{clock}"), ("Wed 13.05.2026", "{clock}"), ("13/05/2026", "{half} p. m."),
    ("2026年5月13日", "{clock}"),
}  # fmt: skip


def written(form: str, at: int) -> str:
    now = START + at
    clock = str(now)[11:]
    half = f"{int(clock[:2]) - 12}{clock[2:]}"
    return form.format(clock=clock, half=half, ms=clock[3:].replace(":", "_"), cjk=clock[3:].replace(":", "分"))


def table(*forms: str) -> str:
    heading = ["Date", "Time"] if len(forms) > 1 else ["Date"]
    rows = ["\t".join([*(written(form, at) for form in forms), f"{3 + at % 4}.5", f"{200 + at}"]) for at in range(ROWS)]
    return "\n".join(["\t".join([*heading, "Wind Speed (m/s)", "Wind Dir (deg)"]), *rows]) + "\n"


@pytest.mark.parametrize("forms", sorted([(form,) for form in ONE_COLUMN] + list(TWO_COLUMNS)), ids=str)
def test_the_instant_is_read(read: Read, forms: tuple[str, ...]) -> None:
    zoned = any(mark in forms[0] for mark in ("UTC", "+0000", "Z"))
    found = read(table(*forms), **({} if zoned else {"zone": "UTC"}))
    expected = (START + np.arange(ROWS)).astype("datetime64[ns]").astype(np.int64)
    np.testing.assert_array_equal(found.series.time, expected)


@pytest.mark.parametrize(
    ("name", "month"),
    [("janv.", 1), ("févr.", 2), ("mrt", 3), ("abr", 4), ("maj", 5), ("giu", 6), ("Juli", 7), ("août", 8), ("set", 9),
     ("okt", 10), ("kas", 11), ("déc.", 12), ("grudnia", 12), ("августа", 8), ("Sept", 9)],
)  # fmt: skip
def test_names_of_months_in_other_languages(read: Read, name: str, month: int) -> None:
    rows = [f"07 {name} 2026 12:00:{at:02d};{3 + at % 4},5" for at in range(ROWS)]
    found = read("\n".join(["Datum;Wind (m/s)", *rows]) + "\n", zone="UTC")
    assert str(found.series.time[0].astype("datetime64[ns]"))[:10] == f"2026-{month:02d}-07"


def test_a_name_that_two_languages_give_to_different_months_is_not_read(log_file: Callable[[str], Path]) -> None:
    rows = [f"07 lip 2026 12:00:{at:02d};3,{at}" for at in range(ROWS)]
    with pytest.raises(FlagdataError, match="time"):
        read_log(log_file("\n".join(["Datum;Wind (m/s)", *rows]) + "\n"), WindOptions(zone="UTC"))


def test_the_months_of_a_log_go_on_behind_its_first_lines(read: Read) -> None:
    days = [f"{1 + at % 28:02d} {name} 2026" for name in ("marzo", "abril", "mayo") for at in range(28)]
    found = read("\n".join(["fecha;viento (m/s)", *(f"{day} 12:00;4,5" for day in days)]) + "\n", zone="UTC")
    assert len(found.series.time) == len(days)


def test_digits_that_two_orders_read_are_asked_about(log_file: Callable[[str], Path]) -> None:
    path = log_file(table("130524", "{clock}"))
    with pytest.raises(FlagdataError) as caught:
        read_log(path, WindOptions(zone="UTC"))
    assert "--date-order ymd or dmy" in (caught.value.fix or "")
    found = read_log(path, WindOptions(zone="UTC", date_order="dmy"))
    assert str(found.series.time[0].astype("datetime64[ns]"))[:10] == "2024-05-13"


def test_a_date_that_is_not_read_is_named_and_no_day_is_asked_for(log_file: Callable[[str], Path]) -> None:
    path = log_file(table("week 20 day 3", "{clock}"))
    with pytest.raises(FlagdataError) as caught:
        read_log(path, WindOptions(zone="UTC"))
    assert "'Date'" in caught.value.what
    assert "week 20 day 3" in caught.value.what
    assert "--date " not in (caught.value.fix or "")
