"""How long simulating takes is stated beforehand."""

from __future__ import annotations

import pytest

from measure.cloth import announce_simulations


@pytest.mark.parametrize(
    ("flags", "seconds", "workers", "said"),
    [
        (
            128,
            120.0,
            1,
            "about 10 minutes on one idle core",
        ),  # as docs/weighing.md states it was measured
        (128, 120.0, 2, "about 5 minutes on 2 idle cores"),
        (64, 20.0, 2, "a minute or two on 2 idle cores"),
    ],
)
def test_the_length_is_that_of_the_measured_pace(
    flags: int, seconds: float, workers: int, said: str
) -> None:
    assert said in announce_simulations(flags * seconds, workers=workers)
