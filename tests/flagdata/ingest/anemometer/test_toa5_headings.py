"""TOA5: a direction without a unit in the header, and components that contradict a direction."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flagdata.signals import WindLog
from tests.flagdata.ingest.anemometer.test_toa5 import table

Read = Callable[..., WindLog]
WS = ("WS_ms_Avg", "m/s", "Avg")


@pytest.mark.parametrize("name", ["True_WindDir", "WindDir_True"])
def test_a_direction_without_a_unit_is_read_in_degrees_by_its_values(read: Read, name: str) -> None:
    rows = [(4 + at % 3, 20.5 + 15 * at) for at in range(20)]
    log = read(table([WS, (name, "", "Smp")], rows), zone="UTC")
    assert np.degrees(log.series.channels["wind_direction"]).tolist() == pytest.approx([row[1] for row in rows])
    (told,) = (finding.what for finding in log.findings if finding.kind == "unit-from-values")
    assert name in told
    assert "in degrees by its values" in told
    assert not any(name in one.what for one in log.findings if one.kind == "columns-not-read")


def test_a_direction_that_may_be_in_radians_is_left_out_with_the_line_that_reads_it(read: Read) -> None:
    rows = [(4 + at % 3, 0.35 + 0.25 * at) for at in range(20)]
    text = table([WS, ("True_WindDir", "", "Smp")], rows)
    log = read(text, zone="UTC")
    assert "wind_direction" not in log.series.channels
    told = " ".join(finding.what for finding in log.findings if finding.kind == "columns-not-read")
    line = told.partition('--columns "')[2].partition('"')[0]
    assert "wind_direction[rad]" in line
    again = read(text, zone="UTC", columns=line)
    assert again.series.channels["wind_direction"][0] == pytest.approx(0.35)


def test_components_that_point_where_the_wind_comes_from_are_told(read: Read) -> None:
    angles = np.radians([20.0 + 14 * at for at in range(20)])
    columns = [("u_Avg", "m/s", "Avg"), ("v_Avg", "m/s", "Avg"), ("WindDir", "degrees", "Smp")]

    def contradictions(sign: int) -> list[str]:
        rows = [(round(sign * 4 * np.sin(a), 4), round(sign * 4 * np.cos(a), 4), np.degrees(a)) for a in angles]
        log = read(table(columns, rows), zone="UTC")
        return [finding.what for finding in log.findings if finding.kind == "heading-doubtful"]

    (told,) = contradictions(1)
    assert "points to where the wind comes from by 'u_Avg' and 'v_Avg'" in told
    assert contradictions(-1) == []


def test_the_maximum_of_a_temperature_is_not_taken_for_its_mean(read: Read) -> None:
    head = '"TOA5","met","CR1000","1","CR1000.Std.32","met.CR1","1","day"\n'
    head += '"TIMESTAMP","RECORD","AirTemp_Max","AirTemp_Avg","WS_ms_Avg","WindDir"\n'
    head += '"TS","RN","Deg C","Deg C","m/s","Deg"\n'
    head += '"","","Max","Avg","Avg","Smp"\n'
    rows = [f'"2026-05-01 12:{at:02d}:00",{at},25.5,{9 + at % 3}.5,3.{at % 10},{200 + at}' for at in range(30)]
    log = read(head + "\n".join(rows) + "\n", zone="UTC")
    assert log.series.channels["air_temperature"][:2].tolist() == pytest.approx([282.65, 283.65])
