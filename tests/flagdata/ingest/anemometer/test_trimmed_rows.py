"""Tables whose rows end with their last value, as sailing programs and spreadsheets write them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer.restating import trimmed_rows
from flagdata.ingest.anemometer.tables.line_kinds import line_kinds
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
NAMES = "Boat,Utc,Bsp,Awa,Aws,Twa,Tws,Twd,Rudder,Leeway"


def rows() -> list[str]:
    """Rows of three lengths: the boat's speed alone, the apparent wind as well, and a rudder behind it."""
    tails = ["5.1", "5.1,111.5,14.4", "5.1,113.5,13.5,,,,2.5"]
    return [f"0,{43337.5 + at / 86400:.8f},{tails[at % 3]}" for at in range(30)]


def test_shorter_rows_are_read_by_the_names_above(read: Read) -> None:
    log = read("\n".join([NAMES, *rows()]) + "\n", unit="kn", zone="UTC")
    speed = log.series.channels["apparent_wind_speed"]
    assert len(speed) == 30
    assert np.isfinite(speed).sum() == 20
    assert speed[1] == pytest.approx(14.4 * 1852 / 3600)
    assert np.datetime64(int(log.series.time[0]), "ns") == np.datetime64("2018-08-25T12:00")


@pytest.mark.parametrize(
    "lines",
    [
        [NAMES, *("0,43337.5,5.1,111.5,14.4,1,2,3,4,5" for _ in range(10)), *rows()[:3]],  # whole but for damage
        [NAMES, *(f"{row},," for row in rows())],  # rows do not end in a value
        ["43337.5,5.1,1,2,3,4,5,6,7,8", *rows()],  # no names
        [NAMES, *(f"{row},1,2,3,4,5,6,7,8,9" for row in rows())],  # beyond the names
        [NAMES, *(["0,43337.5,5.1,111.5,14.4,1", "2,3,4,5"] * 8)],  # each row cut into two lines
    ],
)
def test_other_tables_are_left_as_they_are(lines: list[str]) -> None:
    assert not trimmed_rows.matches(lines)


def test_lines_of_several_kinds_are_named_where_they_are_refused(read: Read) -> None:
    lines = [
        line for at in range(20) for line in (
            f"19+085:10:05:{at:02d}.817 MET,12.5,54,8.98,70.5,2.02,-0.0,-0.05,280.5,280.4,1016.5",
            f"19+085:10:05:{at:02d}.870 SUS,A,{160 + at},003.9{at % 10},M,+335.2,+005.8,60,09",
        )
    ]  # fmt: skip
    assert "2 kinds (MET, SUS)" in line_kinds(lines, ",")
    assert not line_kinds(lines[1::2], ",")
    with pytest.raises(InputError) as raised:
        read("\n".join(lines) + "\n")
    assert "put those of one kind into a file of its own" in (raised.value.fix or "")
