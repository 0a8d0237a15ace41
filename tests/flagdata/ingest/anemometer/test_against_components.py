"""A direction that contradicts the components beside it is not read without a word."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
SPEED = np.array([4.0, 4.6, 5.1, 3.8, 4.4, 5.0, 4.2, 3.9])  # m/s
FROM = np.array([200.0, 212.0, 221.0, 208.0, 190.0, 231.0, 204.0, 217.0])  # deg


def table(*, direction: np.ndarray, names: str = "wind speed [m/s],wind direction [deg],u [m/s],v [m/s]") -> str:
    """Rows with u = −V sin d and v = −V cos d of the wind from `FROM` (AMS Glossary, "wind")."""
    u, v = -SPEED * np.sin(np.radians(FROM)), -SPEED * np.cos(np.radians(FROM))
    rows = "".join(
        f"2026-05-01T12:0{at}:00Z,{SPEED[at]:.2f},{direction[at]:.1f},{u[at]:.2f},{v[at]:.2f}\n"
        for at in range(len(SPEED))
    )
    return f"time,{names}\n{rows}"


def stored(log: WindLog) -> np.ndarray:
    return np.degrees(log.series.channels["wind_direction"])


def test_a_direction_that_the_components_confirm_is_read(read: Read) -> None:
    log = read(table(direction=FROM))
    np.testing.assert_allclose(stored(log), FROM, atol=1e-6)
    assert "heading-doubtful" not in {finding.kind for finding in log.findings}


@pytest.mark.parametrize(
    "names",
    ["wind speed [m/s],wind direction [deg],u [m/s],v [m/s]", "wind speed (m/s),wind direction (deg),part 1,part 2"],
)
def test_a_direction_the_wind_blows_to_is_refused_with_a_line_for_either_way(read: Read, names: str) -> None:
    text = table(direction=(FROM + 180) % 360, names=names)
    with pytest.raises(InputError, match="is where the wind blows to by") as refused:
        read(text)
    to, of = re.findall(r'--columns "([^"]*)"', refused.value.fix or "")
    np.testing.assert_allclose(stored(read(text, columns=to)), FROM, atol=1e-6)
    opposite = read(text, columns=of)
    np.testing.assert_allclose(stored(opposite), (FROM + 180) % 360, atol=1e-6)
    said = [finding.what for finding in opposite.findings if finding.kind == "heading-doubtful"]
    assert any("is where the wind blows to by" in what for what in said)


def test_speeds_and_components_that_nothing_names_are_told_apart_by_their_numbers(read: Read) -> None:
    text = table(direction=(FROM + 180) % 360, names="vw,dw,vwx,vwy")
    with pytest.raises(InputError) as refused:
        read(text, wind="vw", unit="m/s")
    (to, _) = re.findall(r'--columns "([^"]*)"', refused.value.fix or "")
    assert "wind_direction_to[deg]" in to
    with pytest.raises(InputError, match=r"wind_direction_to\[deg\]"):
        read(text)


def test_a_direction_left_out_beside_components_that_points_the_other_way_is_told(read: Read) -> None:
    names = "speed of sound [m/s],wind direction [deg],u[m/s],v[m/s]"
    kinds = {finding.kind: finding.what for finding in read(table(direction=(FROM + 180) % 360, names=names)).findings}
    assert "the wind is turned by 180°" in kinds["heading-doubtful"]
    assert "heading-doubtful" not in {f.kind for f in read(table(direction=FROM, names=names)).findings}


def mathematical(direction: np.ndarray) -> np.ndarray:
    """The angle of (u, v) counter-clockwise from east, for a wind from `direction` [deg]: atan2(v, u) = 270° − d."""
    return (270.0 - direction) % 360


def test_an_angle_of_mathematics_is_refused_with_a_line_that_reads_the_components(read: Read) -> None:
    text = table(direction=mathematical(FROM))
    with pytest.raises(InputError, match="is counted counter-clockwise") as refused:
        read(text)
    components, compass = re.findall(r'--columns "([^"]*)"', refused.value.fix or "")
    np.testing.assert_allclose(
        read(text, columns=components).series.channels["wind_x"], -SPEED * np.sin(np.radians(FROM)), atol=0.006
    )
    stated = read(text, columns=compass)
    np.testing.assert_allclose(stored(stated), mathematical(FROM), atol=0.06)
    said = [finding.what for finding in stated.findings if finding.kind == "heading-doubtful"]
    assert any("counter-clockwise" in what and "as you said" in what for what in said)


@pytest.mark.parametrize("turn", [8.0, -90.0, 40.0])
def test_a_direction_turned_against_the_components_is_told_with_the_angle(read: Read, turn: float) -> None:
    turned = read(table(direction=(FROM + turn) % 360))
    np.testing.assert_allclose(stored(turned), (FROM + turn) % 360, atol=0.06)
    kinds = {finding.kind: finding.what for finding in turned.findings}
    assert f"differs by {turn:.0f}°" in kinds["heading-doubtful"]


def test_components_are_told_of_a_direction_that_is_mirrored_or_turned(read: Read) -> None:
    names = "speed of sound [m/s],wind direction [deg],u[m/s],v[m/s]"
    for direction, words in ((mathematical(FROM), "the wind is mirrored"), (FROM + 30.0, "differs by 30°")):
        kinds = {finding.kind: finding.what for finding in read(table(direction=direction, names=names)).findings}
        assert words in kinds["heading-doubtful"]


def test_a_wind_from_one_direction_tells_nothing_of_an_angle(read: Read) -> None:
    heading = table(direction=FROM).splitlines()[0]
    rows = "".join(f"2026-05-01T12:0{at}:00Z,4.00,45.0,0.00,4.00\n" for at in range(8))
    kinds = {finding.kind for finding in read(f"{heading}\n{rows}").findings}
    assert "heading-doubtful" not in kinds


def test_a_date_and_a_clock_of_colons_are_one_stamp_beside_another(read: Read) -> None:
    rows = "".join(
        f"26:05:01:12:00:0{at}.316,2026-05-01T12:00:0{at}.316Z,{SPEED[at]:.2f},{FROM[at]:.1f}\n" for at in range(8)
    )
    log = read(f"raw_ts,ts,wind speed [m/s],wind direction [deg]\n{rows}")
    np.testing.assert_allclose(log.series.channels["wind_speed"], SPEED, atol=1e-9)
