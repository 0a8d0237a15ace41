"""A speed beside a direction is a station's wind where the position stays and nothing else has a speed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
Write = Callable[[str], Path]
_NAMES = '"Site","Lat","Lon","Speed","Speed_Units(mph,kph,mps,kts)","Direction(degrees)","Temp","Temp_Units(F,C)"'


def _table(place: str = "47.5,-112.25", unit: str = "mps", names: str = _NAMES, more: str = "") -> str:
    rows = "".join(
        f"KMAD,{place.format(at=at)},{at % 4}.5,{unit},{200 + at},18.{at % 10},C{more},2026-05-01T12:{at:02d}:00Z\n"
        for at in range(24)
    )
    return f'{names},"date_time"\n{rows}'


@pytest.mark.parametrize(("unit", "speed"), [("mps", 1.5), ("kph", 1.5 / 3.6), ("kts", 1.5 * 1852 / 3600)])
def test_a_speed_of_a_station_is_its_wind_in_the_unit_of_the_next_column(read: Read, unit: str, speed: float) -> None:
    log = read(_table(unit=unit))
    assert log.series.channels["wind_speed"][1] == pytest.approx(speed)
    assert "wind_direction" in log.series.channels


def test_where_something_moves_it_is_asked_for(log_file: Write) -> None:
    moving = _table(place="47.{at:02d},-112.25")
    afloat = _table(names=f'{_NAMES},"SOG"', more=",0.0")
    alone = _table(names=_NAMES.replace("Direction(degrees)", "Battery(V)"))
    for text in (moving, afloat, alone):
        with pytest.raises(InputError, match="'Speed' may be a wind or another speed"):
            read_log(log_file(text), WindOptions())
