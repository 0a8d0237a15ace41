"""Devices below a heading that does not name them: told by the stamps of their rows, never sorted into each other."""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import SeveralDevicesError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
Write = Callable[[str], Path]
START = dt.datetime(2026, 5, 1, tzinfo=dt.UTC)
MANY = 1020
"""Rows of a device: more than are looked at before a file is read."""


def row(name: str, device: int, at: int, *, late: int = 0) -> str:
    """A row a minute: `device` reads 3, 6, 9… m/s and a tenth more each of ten rows; its stamps are `late` seconds."""
    stamp = f"{START + dt.timedelta(minutes=at, seconds=late):%Y-%m-%dT%H:%M:%SZ}"
    return f"{stamp},{name},{3 + 3 * device + at % 10 / 10:.1f},{200 + at % 90}\n"


def stacked(names: Sequence[str], heading: str = "pod", *, late: int = 0, count: int = MANY) -> str:
    body = (row(name, k, at, late=k * late) for k, name in enumerate(names) for at in range(count))
    return f"time,{heading},wind speed (m/s),wind dir\n" + "".join(body)


def in_turn(names: Sequence[str], heading: str = "pod", *, late: int = 0, count: int = MANY) -> str:
    body = (row(name, k, at, late=k * late) for at in range(count) for k, name in enumerate(names))
    return f"time,{heading},wind speed (m/s),wind dir\n" + "".join(body)


def check_apart(path: Path, options: WindOptions, names: Sequence[str], count: int = MANY) -> None:
    assert sorted(anemometers(path, options)) == sorted(names)
    for device, name in enumerate(names):
        series = read_log(path, replace(options, wind=name)).series
        assert len(series) == count
        assert series.channels["wind_speed"][[0, 9]].tolist() == pytest.approx([3 + 3 * device, 3.9 + 3 * device])
        assert set(np.diff(series.time).tolist()) == {60 * 10**9}


def offered(text: str) -> str:
    match = re.search(r'--columns "([^"]*)"', text)
    assert match is not None
    return match[1]


@pytest.mark.parametrize("names", [("A", "B"), ("17", "23"), ("N", "S", "W")])
@pytest.mark.parametrize("late", [0, 20], ids=["same-stamps", "stamps-between"])
def test_devices_below_each_other_are_refused_with_the_line_that_reads_each(
    log_file: Write, names: tuple[str, ...], late: int
) -> None:
    path = log_file(stacked(names, late=late))
    assert anemometers(path) == ()
    with pytest.raises(SeveralDevicesError, match=rf"'pod' tells {len(names)} devices apart") as caught:
        read_log(path)
    line = offered(caught.value.fix)
    assert line == "time,site,wind_speed[m/s],wind_direction[deg]"
    check_apart(path, WindOptions(columns=line), names)


def test_columns_that_leave_the_devices_out_are_completed(log_file: Write) -> None:
    path = log_file(stacked(("A", "B"), late=20))
    for told in ("time,,wind_speed[m/s],wind_direction[deg]", "1=time,3=wind_speed[m/s]"):
        with pytest.raises(SeveralDevicesError) as caught:
            read_log(path, WindOptions(columns=told))
        check_apart(path, WindOptions(columns=offered(caught.value.fix)), ("A", "B"))


def test_devices_in_turn_with_stamps_of_their_own_are_refused_with_the_line_that_reads_each(log_file: Write) -> None:
    path = log_file(in_turn(("east roof", "west roof"), late=20))
    with pytest.raises(SeveralDevicesError, match="row by row in turn") as caught:
        read_log(path)
    check_apart(path, WindOptions(columns=offered(caught.value.fix)), ("east roof", "west roof"))


def test_numbers_that_part_rows_of_one_stamp_are_doubted_with_the_line_that_reads_each(log_file: Write) -> None:
    path = log_file(in_turn(("1", "2")))
    (mixed,) = [found for found in read_log(path).findings if found.kind == "devices-mixed"]
    assert mixed.fix is not None
    check_apart(path, WindOptions(columns=offered(mixed.fix)), ("1", "2"))


@pytest.mark.parametrize("heading", ["Gerät", "MAC", "dev_id", "WEA"])
@pytest.mark.parametrize("lay", [stacked, in_turn])
def test_a_heading_that_names_devices_needs_no_word_of_the_user(
    log_file: Write, heading: str, lay: Callable[..., str]
) -> None:
    check_apart(log_file(lay(("101", "102"), heading, late=20)), WindOptions(), ("101", "102"))


@pytest.mark.parametrize(
    "names", [("AA:00:11:22:33:4D", "AA:00:11:22:33:4E"), ("70b3d50000000a01", "70b3d50000000a02")]
)
@pytest.mark.parametrize("lay", [stacked, in_turn])
def test_addresses_are_devices_whatever_their_column_is_called(
    log_file: Write, names: tuple[str, str], lay: Callable[..., str]
) -> None:
    check_apart(log_file(lay(names, "from", late=20)), WindOptions(), names)


def test_addresses_of_gateways_part_no_device(log_file: Write) -> None:
    text = in_turn(("70b3d50000000a01", "70b3d50000000a02"), "gateway", late=20, count=20).replace("6.", "3.")
    path = log_file(text.replace("70b3d50000000a02", "70b3d50000000a01", 7))
    assert anemometers(path) == ()
    assert len(read_log(path).series) == 40


def test_days_in_another_order_and_an_hour_that_comes_again_are_one_device(log_file: Write) -> None:
    days = [f"day {number}" for number in (2, 1, 3)]
    body = "".join(row(day, 0, (int(day[-1]) - 1) * 300 + at) for day in days for at in range(300))
    log = read_log(log_file("time,memo,wind speed (m/s),wind dir\n" + body))
    assert len(log.series) == 900
    body = "".join(row("CEST", 0, at) for at in range(600)) + "".join(row("CET", 1, at + 540) for at in range(600))
    log = read_log(log_file("time,memo,wind speed (m/s),wind dir\n" + body))
    assert [found.value for found in log.findings if found.kind == "clock-set-back"] == [-3600]


def test_a_table_that_was_cut_in_its_second_device_is_of_two(log_file: Write) -> None:
    body = "".join(row("north 1", 0, at) for at in range(MANY)) + "".join(row("south 2", 1, at) for at in range(60))
    path = log_file("time,memo,wind speed (m/s),wind dir\n" + body)
    with pytest.raises(SeveralDevicesError, match="2 devices") as caught:
        read_log(path)
    check = WindOptions(columns=offered(str(caught.value.fix)))
    assert [len(read_log(path, replace(check, wind=name)).series) for name in ("north 1", "south 2")] == [MANY, 60]


def test_numbers_with_a_fraction_name_no_device(log_file: Write) -> None:
    body = "".join(row(f"{at % 2 * 0.25:.2f}", 0, at // 2) for at in range(200))
    log = read_log(log_file("time,rain,wind speed (m/s),wind dir\n" + body))
    assert "devices-mixed" not in {found.kind for found in log.findings}


def test_the_user_may_say_that_it_is_one_device(log_file: Write) -> None:
    path = log_file(stacked(("A", "B"), late=30, count=100))
    assert len(read_log(path, WindOptions(clock="sort")).series) == 200


def test_a_column_that_the_user_names_is_the_wind_of_the_line_that_reads_each_device(log_file: Write) -> None:
    path = log_file(stacked(("A", "B"), late=20).replace("wind speed (m/s)", "z9"))
    with pytest.raises(SeveralDevicesError) as caught:
        read_log(path, WindOptions(wind="z9", unit="m/s"))
    assert "in place of --wind" in caught.value.fix
    assert offered(caught.value.fix) == "time,site,wind_speed[m/s],wind_direction[deg]"
    check_apart(path, WindOptions(columns=offered(caught.value.fix)), ("A", "B"))


def test_devices_of_a_table_of_the_catalog_are_refused_as_those_of_another(log_file: Write) -> None:
    rows = [f"2026-05-01,12:{at:02d}:{late},{speed + at * 3.6},{name}"
            for name, late, speed in (("A", 10, 3.6), ("B", 40, 36.0)) for at in range(30)]  # fmt: skip
    path = log_file("\n".join(["Date,Time,Wind speed [km/h],pod", *rows, ""]))
    with pytest.raises(SeveralDevicesError, match="'pod' tells 2 devices apart") as caught:
        read_log(path, WindOptions(zone="UTC"))
    options = WindOptions(columns=offered(caught.value.fix), zone="UTC")
    assert anemometers(path, options) == ("A", "B")
    first, second = (read_log(path, replace(options, wind=name)).series for name in ("A", "B"))
    assert first.channels["wind_speed"][:3].tolist() == pytest.approx([1, 2, 3])
    assert second.channels["wind_speed"][:3].tolist() == pytest.approx([10, 11, 12])


@pytest.mark.parametrize("name", ["pod", "generic-csv"])
def test_lines_beside_devices_that_share_stamps_name_their_column(read: Read, name: str) -> None:
    stamps = [f"2026-05-01T12:{at:02d}:00Z" for at in range(30)]
    recipe = {} if name == "pod" else {"recipe": name}
    heading = "pod,time,wind speed (m/s),gust,bearing" if name == "pod" else "pod,time,wind_speed,gust,bearing"
    rows = "".join(f"{pod},{stamp},{pod + at % 4},{9 + at % 3},{200 + at}\n" for at, stamp in enumerate(stamps)
                   for pod in (1, 2))  # fmt: skip
    found = read(f"{heading}\n{rows}", **recipe)
    told = " ".join(one.what for one in found.findings if one.kind == "columns-not-read")
    offered = re.findall(r'--columns "([^"]*)"', told)
    assert offered
    assert all(line.startswith("1=site,") for line in offered), offered


def test_a_mark_that_few_rows_have_tells_no_devices(read: Read) -> None:
    rows = [f"2026-05-01T12:{at:02d}:00Z,{3 + at % 4}.5,{'TRUE' if at == 1 else 'FALSE'},turbine {'AB'[at == 4]}"
            for at in range(40)]  # fmt: skip
    found = read("\n".join(["time,wind speed (m/s),FaultMsg,state text", *rows]) + "\n")
    assert len(found.series.time) == 40
    assert not [one for one in found.findings if one.kind == "devices-mixed"]


def test_answers_in_strict_turn_tell_no_devices(read: Read) -> None:
    rows = [f"2026-05-01T12:{at:02d}:00Z,{3 + at % 4}.5,{('yes', 'no')[at % 2]}" for at in range(40)]
    assert len(read("\n".join(["time,wind speed (m/s),heater", *rows]) + "\n").series.time) == 40
