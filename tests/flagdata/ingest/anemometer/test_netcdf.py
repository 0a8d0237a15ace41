"""netCDF-3 files of the CF conventions: the wind of one point by its standard names, or refused with what to do."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.io import netcdf_file

from flagdata.errors import FlagdataError, LimitError
from flagdata.ingest.anemometer import Limits, WindOptions, read_log

Variable = tuple[str, str, str, Sequence[float]]
SPEED: Variable = ("ff", "wind_speed", "knots", [4.0, 5.0, np.nan, 6.0])
FROM: Variable = ("dd", "wind_from_direction", "degree", [200.0, 210.0, 220.0, 350.0])
TO: Variable = ("dd", "wind_to_direction", "degree", [20.0, 30.0, 40.0, 170.0])
EAST: Variable = ("u", "eastward_wind", "m s-1", [3.0, -3.0, 0.0, 0.0])
NORTH: Variable = ("v", "northward_wind", "m s-1", [4.0, 0.0, 4.0, -4.0])
SINCE = "seconds since 2026-05-01 12:00:00"


def written(folder: Path, *variables: Variable, since: str = SINCE) -> Path:
    """A file of four seconds of some variables: name, standard name, unit and values."""
    path = folder / "wind.nc"
    with netcdf_file(path, "w") as file:
        file.createDimension("time", 4)
        time = file.createVariable("time", "d", ("time",))
        time[:] = np.arange(4.0)
        time.units = since
        for name, standard, unit, values in variables:
            variable = file.createVariable(name, "d", ("time",))
            variable[:] = values
            variable.units, variable.standard_name = unit, standard
    return path


@pytest.mark.parametrize("direction", [FROM, TO], ids=["from", "to"])
def test_speed_and_direction_are_read_in_utc_and_nothing_is_asked(tmp_path: Path, direction: Variable) -> None:
    log = read_log(written(tmp_path, SPEED, direction, ("battery", "", "V", [12.0] * 4)))
    assert log.stated
    assert log.series.time.tolist() == [(1_777_636_800 + s) * 10**9 for s in range(4)]
    assert log.series.channels["wind_speed"] == pytest.approx(np.array(SPEED[3]) * 1852 / 3600, nan_ok=True)
    assert np.degrees(log.series.channels["wind_direction"]) == pytest.approx(np.array(FROM[3]))
    assert "variables that are not read: 'battery'" in {finding.what for finding in log.findings}


def test_components_give_the_direction_that_the_wind_comes_from(tmp_path: Path) -> None:
    log = read_log(written(tmp_path, EAST, NORTH))
    assert log.series.channels["wind_speed"] == pytest.approx([5.0, 3.0, 4.0, 4.0])
    assert np.degrees(log.series.channels["wind_direction"]) == pytest.approx([216.8699, 90.0, 180.0, 0.0], abs=1e-4)


def refusal(path: Path, options: WindOptions) -> FlagdataError:
    with pytest.raises(FlagdataError) as caught:
        read_log(path, options)
    return caught.value


@pytest.mark.parametrize(
    ("variables", "says"),
    [
        ([SPEED, ("ff2", *SPEED[1:])], "several variables are wind_speed"),
        ([("t", "air_temperature", "K", [280.0] * 4)], "no variable of wind along time alone"),
        ([("ff", "wind_speed", "counts", [4.0] * 4)], "no variable of wind along time alone"),
    ],
)
def test_what_is_no_one_wind_is_refused(tmp_path: Path, variables: Sequence[Variable], says: str) -> None:
    error = refusal(written(tmp_path, *variables), WindOptions())
    assert says in error.what
    assert error.fix


def test_a_time_without_a_start_is_none(tmp_path: Path) -> None:
    assert "no axis of time" in refusal(written(tmp_path, SPEED, since="s"), WindOptions()).what


def test_the_limit_of_rows_holds(tmp_path: Path) -> None:
    assert isinstance(refusal(written(tmp_path, SPEED), WindOptions(limits=Limits(rows=3))), LimitError)


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
