"""A direction and its speed beside components are named when left out, with the line of columns that reads them."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

from flagdata.signals import WindLog

Read = Callable[..., WindLog]
X = [1.2, -0.4, 2.8, 3.1, -1.7, 0.6, 4.4, 2.2]
Y = [-3.0, 2.5, 0.3, -1.8, -2.6, 4.1, 1.5, -0.9]


def table(*, speed: bool) -> str:
    rows = [
        f"2026-05-01 12:0{at}:00Z,{x},{y},0.1,{f'{np.hypot(x, y):.2f},' if speed else ''}{200 + at}\n"
        for at, (x, y) in enumerate(zip(X, Y, strict=True))
    ]
    return f"datetime,U,V,W,{'Ubar,' if speed else ''}Winddir\n{''.join(rows)}"


def offered(log: WindLog) -> tuple[str, str]:
    said = " ".join(finding.what for finding in log.findings if finding.kind == "columns-not-read")
    (line,) = re.findall(r'--columns "([^"]*)"', said)
    return said, line


def test_the_speed_and_the_direction_beside_components_are_offered_together(read: Read) -> None:
    said, line = offered(read(table(speed=True), unit="m/s"))
    assert "'Ubar'" in said
    assert "'Winddir'" in said
    found = read(table(speed=True), columns=line)
    assert found.series.channels["wind_speed"].tolist() == pytest.approx(np.hypot(X, Y).tolist(), abs=0.01)
    assert np.degrees(found.series.channels["wind_direction"]) == pytest.approx(np.arange(200, 208))


def test_a_direction_alone_beside_components_is_offered_with_a_question_for_its_speed(read: Read) -> None:
    said, line = offered(read(table(speed=False), unit="m/s"))
    assert line == "1=time,5=wind_direction[deg],?=wind_speed[m/s]"
    assert "with the number of the speed for the ?" in said


def test_components_beside_a_speed_are_offered_in_its_place(read: Read) -> None:
    rows = "".join(
        f"2026-05-01 12:0{at}:00Z,{x},{y},{np.hypot(x, y):.3f}\n" for at, (x, y) in enumerate(zip(X, Y, strict=True))
    )
    log = read(f"datetime,u,v,ws\n{rows}", unit="m/s")
    said, line = offered(log)
    assert "in place of 'ws'" in said
    assert "vertical" not in " ".join(finding.what for finding in log.findings)
    found = read(f"datetime,u,v,ws\n{rows}", columns=line)
    assert found.series.channels["wind_x"].tolist() == pytest.approx(X)


def test_a_speed_with_the_vertical_wind_in_it_is_told(read: Read) -> None:
    rows = "".join(
        f"2026-05-01 12:0{at}:00Z,{x},{y},1.{at},{np.sqrt(x**2 + y**2 + (1 + at / 10) ** 2):.3f}\n"
        for at, (x, y) in enumerate(zip(X, Y, strict=True))
    )
    told = [finding.what for finding in read(f"datetime,u,v,w,ws\n{rows}", unit="m/s").findings]
    assert any("'ws' is the length of 'u', 'v', 'w': the vertical wind is in it" in what for what in told)
