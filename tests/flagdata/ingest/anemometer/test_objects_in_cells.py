"""Objects in cells of a table are read by their members, whatever stands in the other cells."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flagdata.signals import WindLog

Read = Callable[..., WindLog]
MINUTES = 12


def rows(wind: str, *, other: str, rain: str) -> str:
    return "coord,weather,wind,rain,dt,name\n" + "".join(
        f"\"{{'lon': 16.4, 'lat': 41.2}}\",{other},{wind.format(3 + at / 10, 270 + at)},{rain if at % 2 else ''},"
        f"{1777636800 + 60 * at},Mast\n"
        for at in range(MINUTES)
    )


@pytest.mark.parametrize(
    "wind", ["\"{{'speed': {:.1f}, 'deg': {}, 'gust': 9.7}}\"", '"{{""speed"": {:.1f}, ""deg"": {}, ""gust"": 9.7}}"']
)
@pytest.mark.parametrize("other", ["Rain", "\"[{'id': 500, 'main': 'Rain'}]\"", '"[1, 2]"'])
def test_members_become_columns(read: Read, wind: str, other: str) -> None:
    log = read(rows(wind, other=other, rain="{'1h': 0.12}"), unit="m/s")
    assert log.series.channels["wind_speed"] == pytest.approx([3 + at / 10 for at in range(MINUTES)])
    assert np.degrees(log.series.channels["wind_direction"]) == pytest.approx([270 + at for at in range(MINUTES)])
    said = {finding.kind: finding.what for finding in log.findings}
    assert "'wind.gust'" in said["columns-not-read"]
    assert "'coord', 'wind', 'rain'" in said["objects-in-cells"]
