"""Words for calm air in the place of a speed: a wind of 0 without direction, reported once, and no
missing value."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flagdata.record.signals import WindLog
from tests.flagdata.ingest.anemometer.conftest import read

EVERY = 4
"""One row of so many is calm, the third of each."""


def rows(speed: str, direction: str, calm: tuple[str, str]) -> str:
    """Twenty minutes of which the third of every four is calm; `speed` and `direction` are formats
    of the minute."""
    lines: list[str] = []
    for minute in range(20):
        cells = (
            calm
            if minute % EVERY == 2
            else (speed.format(3 + minute / 10), direction.format(200 + minute))
        )
        lines.append(f"2026-05-01T12:{minute:02d}:00Z,{cells[0]},{cells[1]}\n")
    return "".join(lines)


def check(log: WindLog, scale: float) -> None:
    speed, direction = log.series.channels["wind_speed"], log.series.channels["wind_direction"]
    assert len(log.series) == 20
    assert np.flatnonzero(speed == 0).tolist() == [2, 6, 10, 14, 18]
    assert np.flatnonzero(np.isnan(direction)).tolist() == [2, 6, 10, 14, 18]
    assert speed[[0, 19]].tolist() == pytest.approx([3.0 * scale, 4.9 * scale])
    said = [finding for finding in log.findings if finding.kind == "calm-in-words"]
    assert [(finding.count, finding.where) for finding in said] == [(5, "line 4")]
    assert not {"missing-values", "heading-doubtful", "unreadable-values"} & {
        found.kind for found in log.findings
    }


@pytest.mark.parametrize("word", ["Calm", "CALM", "calm wind", "C", "Windstille", "calme", "静穏"])
@pytest.mark.parametrize("direction", ["", "0", "Calm", "270"])
def test_a_word_for_calm_air_in_a_speed_is_zero_without_a_direction(
    word: str, direction: str
) -> None:
    check(read("time,wind_speed,wind_direction\n" + rows("{:.1f}", "{}", (word, direction))), 1.0)


def test_it_is_so_by_a_line_of_columns_and_by_a_recipe() -> None:
    text = rows("{:.1f}", "{}", ("Calm", ""))
    check(read("a,b,c\n" + text, columns="time,wind_speed[kn],wind_direction[deg]"), 1852 / 3600)
    log = read("time,wind_speed,wind_direction\n" + text, recipe="generic-csv")
    assert np.flatnonzero(log.series.channels["wind_speed"] == 0).tolist() == [2, 6, 10, 14, 18]


def test_it_is_so_beyond_the_first_rows() -> None:
    stamps = [
        f"2026-05-01T{at // 3600:02d}:{at // 60 % 60:02d}:{at % 60:02d}Z" for at in range(2000)
    ]
    cells = ["Calm" if at == 1990 else f"{3 + at % 7 / 10:.1f}" for at in range(2000)]
    body = "".join(f"{stamp},{cell}\n" for stamp, cell in zip(stamps, cells, strict=True))
    log = read("time,wind speed (m/s)\n" + body)
    assert np.flatnonzero(log.series.channels["wind_speed"] == 0).tolist() == [1990]


def test_a_word_that_a_recipe_calls_missing_is_missing(log_file: Callable[..., object]) -> None:
    recipe = log_file(
        'name = "own"\nabout = "made"\nsource = "made"\n[file]\nmissing = ["calm"]\n'
        '[time]\ncolumns = ["time"]\nformat = "iso"\n'
        '[channels.wind_speed]\ncolumn = "v"\nunit = "m/s"\n[sensor]\nname = "own"\n',
        "own.toml",
    )
    cells = ["Calm" if at == 3 else str(at) for at in range(9)]
    body = "".join(f"2026-05-01T12:{at:02d}:00Z,{cell}\n" for at, cell in enumerate(cells))
    log = read("time,v\n" + body, recipe=str(recipe))
    assert np.flatnonzero(np.isnan(log.series.channels["wind_speed"])).tolist() == [3]


def test_other_words_in_a_speed_are_still_missing_values() -> None:
    cells = ["VRB" if at % EVERY == 2 else f"{3 + at / 10:.1f}" for at in range(20)]
    body = "".join(f"2026-05-01T12:{at:02d}:00Z,{cell}\n" for at, cell in enumerate(cells))
    log = read("time,wind_speed\n" + body)
    assert np.flatnonzero(np.isnan(log.series.channels["wind_speed"])).tolist() == [
        2,
        6,
        10,
        14,
        18,
    ]
