"""Lines of columns that are offered beside a wind which is read can be given back as they are printed."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

from flagdata.signals import WindLog

Read = Callable[..., WindLog]


def lines(log: WindLog) -> list[str]:
    """The lines of columns that the findings of a log offer, in their order."""
    return [line for found in log.findings for line in re.findall(r'--columns "([^"]*)"', f"{found.what} {found.fix}")]


@pytest.mark.parametrize("before", [0, 9])
def test_a_direction_that_the_user_alone_knows_is_offered_with_one_number_to_fill_in(before: int, read: Read) -> None:
    other = "".join(f"{7 + at};" for at in range(before))
    text = "".join(f"2026-05-01T12:{at:02d}:00Z;{other}{3 + at / 10:.1f};x;{200 + at};5\n" for at in range(20))
    (line,) = lines(read(text, wind=str(before + 2), unit="m/s"))
    assert line.count("?") == 1
    found = read(text, columns=line.replace("?", str(before + 4)))
    assert found.series.channels["wind_speed"].tolist() == pytest.approx([3 + at / 10 for at in range(20)])
    assert np.degrees(found.series.channels["wind_direction"]) == pytest.approx(np.arange(200, 220))
