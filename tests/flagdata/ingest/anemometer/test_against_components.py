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
