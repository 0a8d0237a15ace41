"""Stretches one below the other, each with a count of time of its own, are refused with the line that reads one."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError, TimeError
from flagdata.ingest.anemometer import WindOptions, anemometers
from flagdata.signals import WindLog
from flagdata.timebase import NANOSECONDS

Read = Callable[..., WindLog]
_START = 1_777_622_400 * NANOSECONDS


def _table(*runs: str, rows: int = 8) -> str:
    lines = "".join(
        f"{run},{5 * at},{61 + at},{3 + number}.{at},{'ENS'[at % 3]}\n"
        for number, run in enumerate(runs) for at in range(rows)
    )  # fmt: skip
    return f"run,minutes,rel_hum,wind_speed,wind_dir\n{lines}"


def test_the_line_that_is_offered_reads_each_stretch_with_its_own_start(read: Read) -> None:
    text = _table("a", "b", "c")
    with pytest.raises(InputError, match="starts again wherever column 'run' changes") as caught:
        read(text, unit="km/h")
    found = re.search(r'--columns "([^"]*)" --wind (\w+) --start TIME', caught.value.fix)
    assert found is not None
    assert found[2] == "a"
    with pytest.raises(InputError, match="starts again wherever"):
        read(text, columns=found[1], start=_START)
    for number, run in enumerate("abc"):
        start = _START + number * 86_400 * NANOSECONDS
        log = read(text, columns=found[1], wind=run, start=start)
        assert log.series.time[0] == start
        assert bool((np.diff(log.series.time) == 300 * NANOSECONDS).all())
        expected = [(3 + number + at / 10) / 3.6 for at in range(8)]
        np.testing.assert_allclose(log.series.channels["wind_speed"], expected)


def test_stretches_are_not_taken_for_anemometers_that_began_together(log_file: Callable[[str], Path]) -> None:
    path = log_file(_table("a", "b", "c"))
    assert anemometers(path, WindOptions(unit="km/h", start=_START)) == ()
    rows = "".join(f"{5 * at},{site},{4 + at}.5\n" for at in range(6) for site in "abc")
    together = log_file(f"minutes,site,wind_speed\n{rows}")
    assert anemometers(together, WindOptions(unit="km/h", start=_START)) == ("a", "b", "c")


def test_a_count_that_starts_again_where_no_column_changes_is_refused_as_before(read: Read) -> None:
    with pytest.raises(TimeError, match="the count starts again once"):
        read(_table("a", "a"), unit="km/h", start=_START)
    assert len(read(_table("a"), unit="km/h", start=_START).series.time) == 8
