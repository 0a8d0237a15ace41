"""Stamps hours from those of the satellite receiver in the same lines."""

from __future__ import annotations

import pytest

from flagdata.record.signals import WindLog
from tests.flagdata.ingest.anemometer.conftest import read


def reported(log: WindLog, kind: str) -> list[str]:
    return [finding.what for finding in log.findings if finding.kind == kind]


@pytest.mark.parametrize(("receiver", "said"), [("171300", "19.5 h behind"), ("124130", "")])
def test_a_receiver_whose_time_differs_is_reported(receiver: str, said: str) -> None:
    day = "010924" if said else "020924"
    lines = "".join(
        f"2024-09-02T12:41:3{at}.168+00:00 $IIMWV,032,R,03.{at},N,A\n"
        f"2024-09-02T12:41:3{at}.200+00:00 "
        f"$IIRMC,{int(receiver) + at},A,5928.094,N,02449.269,E,00.1,036,{day},00,E,A\n"
        for at in range(6)
    )
    found = reported(read(lines), "receiver-clock-off")
    assert [said in what for what in found] == ([True] if said else [])
