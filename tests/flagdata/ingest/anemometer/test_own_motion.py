"""The velocity of a drone or boat beside columns that may be the wind is neither read nor offered as the wind."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer import WindOptions, read_log, sniff

Write = Callable[[str], Path]
OWN = (["Vx", "Vy", "Vz"], ["vel_x", "vel_y", "vel_z"], ["velocity.x", "velocity.y", "velocity.z"], ["velN", "velE"])
ROWS = 60


def _log(*columns: tuple[str, Callable[[int], float]]) -> str:
    lines = [",".join(["time", *(name for name, _ in columns)])]
    lines += [
        ",".join([f"2026-05-01T12:00:{at:02d}Z", *(f"{value(at):.4f}" for _, value in columns)]) for at in range(ROWS)
    ]
    return "\n".join([*lines, ""])


def _own(names: list[str]) -> list[tuple[str, Callable[[int], float]]]:
    return [(name, lambda at, turn=turn: 4 * np.sin(at / 9 + turn)) for turn, name in enumerate(names)]


def _beside(unit: str = "") -> list[tuple[str, Callable[[int], float]]]:
    return [
        (f"{letter}m{unit}", lambda at, base=base: base - at % 3 / 10)
        for letter, base in zip("UVW", (3, 1, 0.3), strict=True)
    ]


ATTITUDE: Mapping[str, Callable[[int], float]] = {"roll": lambda at: at % 5, "pitch": lambda at: at % 4}


@pytest.mark.parametrize("names", OWN)
@pytest.mark.parametrize("turned", [True, False])
def test_beside_um_vm_wm_the_doubt_names_both_and_offers_these_alone(
    log_file: Write, names: list[str], turned: bool
) -> None:
    path = log_file(_log(*_own(names), *_beside(), *(ATTITUDE.items() if turned else ())))
    with pytest.raises(InputError) as caught:
        read_log(path)
    assert f"{', '.join(map(repr, names))} may be how the platform itself moves" in caught.value.what
    assert "the wind may be 'Um', 'Vm', 'Wm'" in caught.value.what
    assert "--wind Um" in caught.value.fix
    assert sniff(path)[0].winds == ("Um",)
    offered = caught.value.fix.split('--columns "')[1].split('"')[0]
    assert offered.rstrip(",") == ",".join(["time", *("" for _ in names), "wind_x[?],wind_y[?],wind_z[?]"])
    said = WindOptions(columns=offered.replace("[?]", "[m/s]"))
    named = WindOptions(wind="Um", unit="m/s")
    for options in (said, named):
        channels = read_log(path, options).series.channels
        np.testing.assert_allclose(channels["wind_x"], [3 - at % 3 / 10 for at in range(ROWS)], atol=1e-4)


def test_a_platform_that_hovers_beside_um_vm_wm_is_one_all_the_same(log_file: Write) -> None:
    still = {"Lat": lambda at: 32.6911, "Lon": lambda at: -103.0753}
    path = log_file(_log(*_own(OWN[0]), *_beside(), *still.items()))
    with pytest.raises(InputError, match="may be how the platform itself moves") as caught:
        read_log(path)
    assert "--wind Um" in caught.value.fix


def test_headings_with_units_are_components_and_no_speeds(log_file: Write) -> None:
    names = [f"{name} [m/s]" for name in OWN[0]]
    path = log_file(_log(*_own(names), *_beside(" [m/s]")))
    with pytest.raises(InputError, match="may be how the platform itself moves") as caught:
        read_log(path)
    assert '"time,,,,wind_x[m/s],wind_y[m/s],wind_z[m/s]"' in caught.value.fix


@pytest.mark.parametrize("names", [*OWN, ["velocity north [m/s]", "velocity east [m/s]"]])
def test_a_velocity_alone_beside_a_position_that_changes_is_not_offered(log_file: Write, names: list[str]) -> None:
    position = [("Lat", lambda at: 57 + 1e-4 * at), ("Lon", lambda at: 9 + 1e-4 * at)]
    with pytest.raises(InputError, match="may be how the platform itself moves, since 'Lat' changes") as caught:
        read_log(log_file(_log(*position, *_own(names))))
    assert "wind_x" not in caught.value.fix
    assert f"--wind {names[0]}" not in caught.value.fix


@pytest.mark.parametrize("names", OWN)
def test_beside_a_wind_it_is_told_and_not_read(log_file: Write, names: list[str]) -> None:
    wind = [("Wind speed (m/s)", lambda at: 5 + at % 3 / 10), ("Wind direction (deg)", lambda at: 200 + at)]
    path = log_file(_log(*_own(names), *wind, *ATTITUDE.items()))
    with pytest.raises(InputError, match=f"{names[0]!r} shows that the platform moves"):
        read_log(path)
    log = read_log(path, WindOptions(platform="corrected"))
    np.testing.assert_allclose(log.series.channels["wind_speed"], [5 + at % 3 / 10 for at in range(ROWS)])
    told = {finding.kind: finding.what for finding in log.findings}
    assert f"{', '.join(map(repr, names))} may be how the platform itself moves" in told["columns-not-read"]


def test_the_components_of_a_sonic_alone_are_still_offered(log_file: Write) -> None:
    with pytest.raises(InputError) as caught:
        read_log(log_file(_log(*_own(OWN[0]))))
    assert "platform" not in caught.value.what
    assert "wind_x[?],wind_y[?],wind_z[?]" in caught.value.fix


@pytest.mark.parametrize("names", [["wind_vel_x", "wind_vel_y"], ["Sonic_Vx", "Sonic_Vy"], ["CSAT vx", "CSAT vy"]])
def test_a_velocity_that_is_said_to_be_the_winds_is_read(log_file: Write, names: list[str]) -> None:
    path = log_file(_log(*_own(names), *ATTITUDE.items()))
    channels = read_log(path, WindOptions(unit="m/s", wind=names[0])).series.channels
    np.testing.assert_allclose(channels["wind_x"][0], 0, atol=1e-3)
