"""The speed of a rotor, a generator or a blade is no wind's, unless its heading says the wind."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from flagdata.ingest.anemometer.words.headings import understand
from flagdata.signals import WindLog

Read = Callable[..., WindLog]


@pytest.mark.parametrize(
    "heading",
    ["Rotate_Speed", "Rotation Speed", "Rotational speed", "GenSpd", "Gen_Speed", "Generator Speed", "BladeSpeed",
     "spin speed", "shaft_velocity"],
)  # fmt: skip
def test_what_turns_in_a_machine_is_no_wind(heading: str) -> None:
    assert understand(heading).quantity == ""


@pytest.mark.parametrize("heading", ["Generator wind speed", "WindSpeed_Gen1", "Blade 1 WS [m/s]", "Speed [m/s]"])
def test_a_wind_at_a_machine_is_one(heading: str) -> None:
    assert understand(heading).quantity == "wind_speed"


def test_a_rotor_beside_a_wind_is_no_second_anemometer(read: Read) -> None:
    rows = "".join(f"2026-05-01T12:{at:02d}:00Z,{5 + at % 4}.25,{1500 + at},{180 + at}\n" for at in range(12))
    log = read(f"time,Wind_Speed,Rotate_Speed,Wind_Direction\n{rows}", unit="m/s")
    assert set(log.series.channels) == {"wind_speed", "wind_direction"}
    told = [finding.what for finding in log.findings if finding.kind == "columns-not-read"]
    assert any("'Rotate_Speed'" in what and "wind of its own" not in what for what in told)
