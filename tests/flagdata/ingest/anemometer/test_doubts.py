"""Numbers that are impossible or doubtful open a question; the answer closes it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.ingest.anemometer.draft.doubts import CHECKS
from flagdata.ingest.anemometer.draft.questions import OpenFactsError

Write = Callable[[str | bytes], Path]
PLAIN = "time,wind_speed (m/s),wind_direction (deg)\n"


def table(
    speed: Callable[[int], object], away: Callable[[int], object], stamp: str = "2026-05-01T12:{m:02d}:{s:02d}Z"
) -> str:
    return PLAIN + "".join(f"{stamp.format(m=k // 60, s=k % 60, h=k // 2)},{speed(k)},{away(k)}\n" for k in range(60))


def usual(k: int) -> float:
    return 4 + k % 7 / 10


def vane(k: int) -> float:
    return 200 + k % 9


ODD = {
    "fast": table(lambda k: 80.5 if k == 9 else usual(k), vane),
    "strong": table(lambda k: 31 + k % 7 / 10, vane),
    "negative": table(lambda k: -0.1 - k / 1000 if k % 10 == 3 else usual(k), vane),
    "still": table(lambda k: 0, vane),
    "constant": table(lambda k: 4.1, vane),
    "angles": table(lambda k: 6 * k % 360, vane).replace("(m/s)", "(km/h)", 1),
    "out-of-range": table(usual, lambda k: 400 if k == 5 else vane(k)),
    "code-for-missing": table(lambda k: -99.9 if k % 20 == 3 else usual(k), vane),
    "tens": table(usual, lambda k: 19 + k % 4).replace(" (deg)", ""),
    "fixed": table(usual, lambda k: 123),
    "calm": table(lambda k: 0.1 if k < 5 else usual(k), lambda k: 0 if k < 5 else vane(k)),
    "order": table(usual, vane, stamp="2026-05-01T12:00:{h:02d}Z"),
    "future": table(usual, vane, stamp="2199-05-01T12:{m:02d}:{s:02d}Z"),
    "old": table(usual, vane, stamp="1980-05-01T12:{m:02d}:{s:02d}Z"),
    "coarse": PLAIN + "".join(
        f"2026-05-{1 + k // 12:02d}T{2 * (k % 12):02d}:00:00Z,{usual(k)},{vane(k)}\n" for k in range(60)
    ),
    "lines": table(usual, vane).replace("12:00:30Z", "nonsense"),
}  # fmt: skip


def test_every_check_has_a_case() -> None:
    assert set(CHECKS) <= set(ODD)


@pytest.mark.parametrize("key", ODD)
def test_what_is_odd_is_asked_and_a_yes_closes_it(key: str, log_file: Write) -> None:
    path = log_file(ODD[key])
    with pytest.raises(OpenFactsError) as refused:
        read_log(path)
    assert key in {question.example for question in refused.value.questions}
    every = tuple(question.example for question in refused.value.questions)
    if key != "order":  # which rows are right is a question of its own: --clock
        assert read_log(path, WindOptions(expect=every)).drafted


def test_devices_that_follow_one_another_are_asked_about(log_file: Write) -> None:
    """A column that no word calls a site: 2 devices of 200 rows each, so that the time goes back only once."""
    made = [f"2026-05-01T12:{k // 60:02d}:{k % 60:02d}Z,{pod},{usual(k)}" for pod in (17, 23) for k in range(200)]
    with pytest.raises(OpenFactsError, match="goes back by 199 s"):
        read_log(log_file("\n".join(["time,pod,wind_speed (m/s)", *made]) + "\n"))


def test_a_usual_log_is_not_doubted(log_file: Write) -> None:
    assert read_log(log_file(table(usual, vane))).stated


def test_a_code_for_no_value_is_given(log_file: Write) -> None:
    log = read_log(log_file(ODD["code-for-missing"]), WindOptions(missing=("-99.9",)))
    speed = log.series.channels["wind_speed"]
    assert int(np.isnan(speed).sum()) == 3
    assert np.nanmin(speed) == 4.0
