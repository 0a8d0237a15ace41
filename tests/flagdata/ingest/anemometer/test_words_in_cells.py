"""Cells of a speed that hold no plain number: below the instrument's threshold, or a word for no
value."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.core.schema import SampleFlag
from tests.flagdata.ingest.anemometer.cases import sentence
from tests.flagdata.ingest.anemometer.conftest import read

N = 60


def rows(cells: list[str]) -> str:
    return "time,wind\n" + "".join(
        f"2026-05-01T12:00:{at:02d}Z,{cell}\n" for at, cell in enumerate(cells)
    )


@pytest.mark.parametrize(
    ("cell", "unit", "limit"), [("<0.3", "m/s", 0.3), ("< 0.5", "m/s", 0.5), ("<1.8", "km/h", 0.5)]
)
def test_a_speed_below_the_threshold_is_zero_and_flagged(
    cell: str, unit: str, limit: float
) -> None:
    text = rows([cell if at % 20 == 5 else f"{4 + at % 7 / 10:.1f}" for at in range(N)])
    log = read(text, columns=f"time,wind_speed[{unit}]")
    still = [5, 25, 45]
    assert np.flatnonzero(log.series.channels["wind_speed"] == 0).tolist() == still
    assert np.flatnonzero(log.series.flags & SampleFlag.DEAD_ZONE).tolist() == still
    assert log.series.sensor.threshold == pytest.approx(limit)
    (said,) = (finding for finding in log.findings if finding.kind == "below-threshold")
    assert (said.count, said.where) == (3, "line 7")
    assert said.value == pytest.approx(limit)


def test_sentences_of_an_ft_sensor_with_a_fault_are_flagged_and_damaged_ones_are_left_out() -> None:
    sentences = [sentence(f"WI,WVP=00{4 + at % 5}.4,21{at % 9},{int(at == 7)}") for at in range(30)]
    sentences[9] = sentences[9][:-2] + "00"
    lines = (f"2026-05-01T12:00:{at:02d}Z {sentence}\n" for at, sentence in enumerate(sentences))
    log = read("".join(lines))
    speed = log.series.channels["wind_speed"]
    assert np.flatnonzero(log.series.flags).tolist() == [7]
    assert log.series.flags[7] == SampleFlag.SENSOR_FAULT
    assert ((log.series.time - log.series.time[0]) // 10**9).tolist() == [
        at for at in range(30) if at != 9
    ]
    assert speed[:5] == pytest.approx([4.4, 5.4, 6.4, 7.4, 8.4])
    assert np.degrees(log.series.channels["wind_direction"][:3]) == pytest.approx(
        [210.0, 211.0, 212.0]
    )
    assert {"sensor-fault", "checksum-errors"} <= {finding.kind for finding in log.findings}
