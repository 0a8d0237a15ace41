"""Tables of the NEAD and iCSV formats, by their specifications."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError, ZoneMissingError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log

Write = Callable[[str], Path]


def nead(*, signature: str = "NEAD 1.0 UTF-8", sign: str = ",", more: str = "", zone: str = "# timezone = 1\n") -> str:
    fields = sign.join(["timestamp", "TA1", "VW1", "DW1", "VW2"])
    units = sign.join(["", "degC", "m s-1", "degrees", "m s-1"])
    head = (
        f"# {signature}\n# [METADATA]\n# station_name = Swiss Camp\n# field_delimiter = {sign}\n# nodata = -999\n{zone}"
    )
    head += f"# [FIELDS]\n# fields = {fields}\n# units = {units}\n{more}# [DATA]\n"
    rows: list[str] = []
    for hour in range(8):
        speed = "-999.0" if hour == 3 else f"{hour + 0.5}"
        rows.append(sign.join([f"2020-01-01T{hour:02d}:00:00", "-20.1", speed, "210", f"{hour + 1}"]))
    return head + "\n".join(rows) + "\n"


@pytest.mark.parametrize(("signature", "sign"), [("NEAD 1.0 UTF-8", ","), ("iCSV 1.0 UTF-8", "|")])
def test_fields_units_zone_and_missing_values_are_those_of_the_header(
    log_file: Write, signature: str, sign: str
) -> None:
    path = log_file(nead(signature=signature, sign=sign))
    names = anemometers(path, WindOptions())
    assert len(names) == 2
    first, second = (read_log(path, WindOptions(wind=name)).series for name in names)
    expected = np.arange(8) + 0.5
    expected[3] = np.nan
    np.testing.assert_allclose(first.channels["wind_speed"], expected)
    np.testing.assert_allclose(np.rad2deg(first.channels["wind_direction"]), 210)
    np.testing.assert_allclose(second.channels["wind_speed"], np.arange(8) + 1.0)
    assert np.datetime64(int(first.time[0]), "ns") == np.datetime64("2019-12-31T23:00")


def test_a_header_without_a_zone_asks_for_it(log_file: Write) -> None:
    with pytest.raises(ZoneMissingError):
        read_log(log_file(nead(zone="")), WindOptions(wind="wind speed 1 [m s-1]"))


def test_values_that_are_scaled_are_not_in_the_stated_unit(log_file: Write) -> None:
    path = log_file(nead(more="# scale_factor = 1,1,0.1,1,0.1\n# add_value = 0,273.15,0,0,0\n"))
    with pytest.raises(FlagdataError, match="unit"):
        read_log(path, WindOptions(wind="wind speed 1"))
