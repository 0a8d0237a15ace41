"""netCDF-3 files of the CF conventions: the wind of one point by its standard names, or refused
with what to do."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.io import netcdf_file

from flagdata.errors import FlagdataError, LimitError
from flagdata.ingest import WindOptions, read_log
from flagdata.ingest.anemometer import Limits
from flagdata.ingest.anemometer.containers.netcdf import instants

Variable = tuple[str, str, str, Sequence[float]]
SPEED: Variable = ("ff", "wind_speed", "knots", [4.0, 5.0, np.nan, 6.0])
FROM: Variable = ("dd", "wind_from_direction", "degree", [200.0, 210.0, 220.0, 350.0])
TO: Variable = ("dd", "wind_to_direction", "degree", [20.0, 30.0, 40.0, 170.0])
EAST: Variable = ("u", "eastward_wind", "m s-1", [3.0, -3.0, 0.0, 0.0])
NORTH: Variable = ("v", "northward_wind", "m s-1", [4.0, 0.0, 4.0, -4.0])
SINCE = "seconds since 2026-05-01 12:00:00"


def written(
    folder: Path,
    *variables: Variable,
    since: str = SINCE,
    times: Sequence[float] = (0.0, 1.0, 2.0, 3.0),
    kind: str = "d",
    **attributes: object,
) -> Path:
    """A file of four seconds of some variables: name, standard name, unit and values; `attributes`
    of its time."""
    path = folder / "wind.nc"
    with netcdf_file(path, "w") as file:
        file.createDimension("time", 4)
        time = file.createVariable("time", kind, ("time",))
        time[:] = times
        time.units = since
        for name, value in attributes.items():
            setattr(time, name, value)
        for name, standard, unit, values in variables:
            variable = file.createVariable(name, "d", ("time",))
            variable[:] = values
            variable.units, variable.standard_name = unit, standard
    return path


@pytest.mark.parametrize("direction", [FROM, TO], ids=["from", "to"])
def test_speed_and_direction_are_read_in_utc_and_nothing_is_asked(
    tmp_path: Path, direction: Variable
) -> None:
    log = read_log(written(tmp_path, SPEED, direction, ("battery", "", "V", [12.0] * 4)))
    assert log.stated
    assert log.series.time.tolist() == [(1_777_636_800 + s) * 10**9 for s in range(4)]
    assert log.series.channels["wind_speed"] == pytest.approx(
        np.array(SPEED[3]) * 1852 / 3600, nan_ok=True
    )
    assert np.degrees(log.series.channels["wind_direction"]) == pytest.approx(np.array(FROM[3]))
    assert "variables that are not read: 'battery'" in {finding.what for finding in log.findings}


def test_components_give_the_direction_that_the_wind_comes_from(tmp_path: Path) -> None:
    log = read_log(written(tmp_path, EAST, NORTH))
    assert log.series.channels["wind_speed"] == pytest.approx([5.0, 3.0, 4.0, 4.0])
    assert np.degrees(log.series.channels["wind_direction"]) == pytest.approx(
        [216.8699, 90.0, 180.0, 0.0], abs=1e-4
    )


def refusal(path: Path, options: WindOptions) -> FlagdataError:
    with pytest.raises(FlagdataError) as caught:
        read_log(path, options)
    return caught.value


@pytest.mark.parametrize(
    ("variables", "says"),
    [
        ([SPEED, ("ff2", *SPEED[1:])], "several variables are wind_speed"),
        ([("t", "air_temperature", "K", [280.0] * 4)], "no variable of the file is a wind"),
        ([("ff", "wind_speed", "counts", [4.0] * 4)], "no variable of the file is a wind"),
    ],
)
def test_what_is_no_one_wind_is_refused(
    tmp_path: Path, variables: Sequence[Variable], says: str
) -> None:
    error = refusal(written(tmp_path, *variables), WindOptions())
    assert says in error.what
    assert error.fix


def test_a_time_without_a_start_is_none(tmp_path: Path) -> None:
    assert "no axis of time" in refusal(written(tmp_path, SPEED, since="s"), WindOptions()).what


def test_the_limit_of_rows_holds(tmp_path: Path) -> None:
    assert isinstance(
        refusal(written(tmp_path, SPEED), WindOptions(limits=Limits(rows=3))), LimitError
    )


@pytest.mark.parametrize("size", [8, 60, 200])
def test_a_file_that_is_cut_off_is_refused(tmp_path: Path, size: int) -> None:
    path = written(tmp_path, SPEED, FROM)
    path.write_bytes(path.read_bytes()[:size])
    assert "cannot be read" in refusal(path, WindOptions()).what


def test_netcdf_4_without_a_library_that_reads_it_is_refused_with_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("xarray.backends.list_engines", lambda: {"scipy": None})
    path = tmp_path / "wind.nc"
    path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(200))
    error = refusal(path, WindOptions())
    assert "netCDF-4" in error.what
    assert "pip install h5netcdf" in error.fix


NOON = 1_777_636_800
"""2026-05-01T12:00:00Z, by GNU date."""


@pytest.mark.parametrize(
    ("since", "first", "step"),
    [
        ("seconds since 2026-05-01T12:00:00Z", 0.0, 1.0),
        ("sec since 2026-5-1 12:0:0.0 UTC", 0.0, 1.0),
        ("s since 2026-05-01 14:00:00 +02:00", 0.0, 1.0),
        ("seconds since 2026-05-01 06:00:00 -6", 0.0, 1.0),
        ("seconds since 2026-05-01 06:30 -0530", 0.0, 1.0),
        ("seconds since 2026-05-01 12:00:00 00", 0.0, 1.0),
        ("days since 2026-05-01 12:00:00 00:00", 0.0, 1 / 86_400),
        ("hours since 1900-01-01 00:00:0.0", (NOON + 2_208_988_800) / 3600, 1 / 3600),
        ("days since 1970-01-01", NOON / 86_400, 1 / 86_400),
        ("msecs since 1970-01-01", NOON * 1000.0, 1000.0),
        ("minutes since 2026-05-01 11:59:59.5", 0.5 / 60, 1 / 60),
    ],
)
def test_a_time_since_a_date_is_the_instant_that_it_says(
    tmp_path: Path, since: str, first: float, step: float
) -> None:
    log = read_log(
        written(tmp_path, SPEED, since=since, times=[first + step * k for k in range(4)])
    )
    assert (
        np.abs(log.series.time - (NOON + np.arange(4)) * 10**9).max() <= 1000
    )  # a double's days to 0.3 µs


def test_packed_times_are_unpacked_and_missing_ones_are_no_rows(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        SPEED,
        since="seconds since 2026-05-01 11:00:00",
        times=[0, 2, -32768, 6],
        kind="h",
        scale_factor=0.5,
        add_offset=3600.0,
        _FillValue=np.int16(-32768),
    )
    log = read_log(path, WindOptions(expect=("lines",)))
    assert log.series.time.tolist() == [(NOON + s) * 10**9 for s in (0, 1, 3)]
    assert [one.count for one in log.findings if one.kind == "unreadable-stamps"] == [1]


@pytest.mark.parametrize(
    "calendar", ["noleap", "365_day", "all_leap", "360_day", "julian", "utc", "tai", "none"]
)
def test_a_calendar_that_is_none_of_clocks_is_refused_by_its_name(
    tmp_path: Path, calendar: str
) -> None:
    error = refusal(written(tmp_path, SPEED, calendar=calendar), WindOptions())
    assert f"calendar {calendar!r}" in error.what
    assert "proleptic_gregorian" in str(error.fix)


@pytest.mark.parametrize(
    ("since", "calendar", "says"),
    [
        ("months since 2026-05-01", "standard", "no fixed length"),
        ("years since 2026-05-01", "standard", "no fixed length"),
        ("days since 0000-01-01", "proleptic_gregorian", "no date"),
        ("seconds since 2026-02-30", "standard", "no date"),
        ("hours since 1-1-1 00:00:0.0", "standard", "Julian"),
        ("seconds since May 1st", "standard", "cannot be read"),
    ],
)
def test_units_that_are_no_instant_are_refused_with_their_text(
    tmp_path: Path, since: str, calendar: str, says: str
) -> None:
    error = refusal(written(tmp_path, SPEED, since=since, calendar=calendar), WindOptions())
    assert repr(since) in error.what
    assert says in error.what


def test_a_first_year_of_the_gregorian_calendar_is_read_where_that_is_stated(
    tmp_path: Path,
) -> None:
    first = (
        739_736.5  # days to 2026-05-01 12:00, by Python's ordinals, which are proleptic Gregorian
    )
    path = written(
        tmp_path,
        SPEED,
        since="days since 0001-01-01",
        calendar="proleptic_gregorian",
        times=[first + k / 86_400 for k in range(4)],
    )
    assert (
        np.abs(read_log(path).series.time - (NOON + np.arange(4)) * 10**9).max() <= 10_000
    )  # of a double, 10 µs


def test_times_too_coarse_for_their_rows_are_reported(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        SPEED,
        since="seconds since 1970-01-01",
        times=[NOON + 600 * k for k in range(4)],
        kind="f",
    )
    log = read_log(path, WindOptions(expect=("coarse",)))
    assert [one.value for one in log.findings if one.kind == "coarse-stamps"] == [128.0]


@pytest.mark.parametrize("kind", ["<i8", ">i8", "<u8"])
def test_whole_nanoseconds_stay_exact(kind: str) -> None:
    stored = np.array([NOON * 10**9 + k for k in (0, 1, 999_999_999)], dtype=kind)
    time, found = instants(stored, {"units": "nanoseconds since 1970-01-01"}, where="time")
    assert (time.tolist(), found) == ([NOON * 10**9 + k for k in (0, 1, 999_999_999)], ())
