"""Lines of a TriSonica whose tags were renamed, so that one comes twice, and whose values may be missing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.ingest.anemometer import WindOptions, read_log


def test_the_first_of_a_tag_that_comes_twice_is_the_wind_or_the_air(log_file: Callable[[str], Path]) -> None:
    tags = "D  271 D  nan "
    rows = [
        f"2026-05-01 12:00:{at:02d} S  0{1 + at / 10:.1f} D  {100 + at} DV  031 T  20.5 P  1011.5 P -004 R  003 {tags}"
        for at in range(12)
    ]
    lines = ["Logger of tags, version 2", *rows]
    log = read_log(log_file("\n".join(lines) + "\n"), WindOptions(zone="UTC"))
    assert log.format == "trisonica"
    assert log.series.channels["wind_speed"] == pytest.approx([1 + at / 10 for at in range(12)])
    assert log.series.channels["wind_direction"] == pytest.approx(np.radians([100 + at for at in range(12)]))
    assert log.series.channels["air_pressure"] == pytest.approx([101_150.0] * 12)
