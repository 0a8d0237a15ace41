"""Research vessels' codes of two letters: what is read from the bow, and what is over ground."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from flagdata.ingest.anemometer import WindOptions, anemometers, read_log

Write = Callable[..., Path]


def test_tw_and_ti_are_the_wind_and_ws_and_wd_from_the_bow(log_file: Write) -> None:
    names = ["ZD", "AT", "WS", "WD", "SP", "TW", "TI", "WS-2", "WD-2", "TW-2", "TI-2", "GY"]
    rows = [
        [1_491_963_000 + 30 * at, 20.1, 9 + 0.1 * at, 10 + at, 4.9 + 0.01 * at, 5 + 0.1 * at, 200 + at, 8 + 0.1 * at,
         12 + at, 4 + 0.1 * at, 210 + at, 270.0]
        for at in range(20)
    ]  # fmt: skip
    lines = [
        "# R/V Example",
        "\t".join(names),
        *("\t".join(f"{cell:g}" if cell < 1e6 else f"{cell}" for cell in row) for row in rows),
    ]
    path = log_file("\n".join(lines) + "\n")
    first, second = anemometers(path)
    for label, least, away in ((first, 5.0, 200.0), (second, 4.0, 210.0)):
        series = read_log(path, WindOptions(wind=label, unit="m/s")).series
        np.testing.assert_allclose(series.channels["wind_speed"], least + 0.1 * np.arange(20))
        np.testing.assert_allclose(np.rad2deg(series.channels["wind_direction"]), away + np.arange(20))
        assert "apparent_wind_direction" in series.channels
