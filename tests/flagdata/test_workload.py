"""How long work takes is stated in the unit that people use for it."""

from __future__ import annotations

import pytest

from flagdata.workload import announced


@pytest.mark.parametrize(
    ("seconds", "workers", "said"),
    [
        (600.0, 1, "simulating takes about 10 minutes on one idle core"),
        (600.0, 2, "simulating takes about 5 minutes on 2 idle cores"),
        (20.0, 2, "simulating takes a minute or two on 2 idle cores"),
        (9000.0, 1, "simulating takes about 2.5 hours on one idle core"),
        (144000.0, 2, "simulating takes about 20 hours on 2 idle cores"),
    ],
)
def test_the_length_is_shared_by_the_workers(seconds: float, workers: int, said: str) -> None:
    assert announced("simulating", seconds, workers=workers) == said


def test_what_is_kept_follows() -> None:
    assert announced("simulating", 0.0, kept="all is kept").endswith("on one idle core; all is kept")
