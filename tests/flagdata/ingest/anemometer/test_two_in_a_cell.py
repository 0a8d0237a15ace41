"""A direction and a speed in one cell are two quantities, with the unit that stands there."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.ingest.anemometer import WindOptions, read_log

Write = Callable[[str], Path]


@pytest.mark.parametrize(
    ("heading", "cell", "options", "speed", "direction"),
    [
        ("Wind", "WSW 3.6 km/h", {}, 1.0, 247.5), ("Wind", "SW at 3.6 km/h", {}, 1.0, 225.0),
        ("Wind", "240@12", {"unit": "kn"}, 12 * 1852 / 3600, 240.0),
        ("dir/spd", "240/12", {"unit": "m/s"}, 12.0, 240.0),
        ("Viento", "36 km/h NE", {}, 10.0, 45.0), ("Wind", "240° 10 m/s", {}, 10.0, 240.0),
    ],
)  # fmt: skip
def test_direction_and_speed_in_one_cell_are_both_read(
    log_file: Write, heading: str, cell: str, options: dict[str, str], speed: float, direction: float
) -> None:
    rows = "".join(f"2026-05-01T12:00:{at:02d}Z,{cell},{at}\n" for at in range(12))
    channels = read_log(log_file(f"time,{heading},battery\n{rows}"), WindOptions(**options)).series.channels  # type: ignore[arg-type]
    np.testing.assert_allclose(channels["wind_speed"], speed)
    np.testing.assert_allclose(np.rad2deg(channels["wind_direction"]), direction)


def test_a_column_of_points_beside_its_speed_is_left_as_it_is(log_file: Write) -> None:
    rows = "".join(f"2026-05-01T12:00:{at:02d}Z,WSW,3.5\n" for at in range(12))
    channels = read_log(log_file(f"time,Wind,Wind speed (m/s)\n{rows}")).series.channels
    np.testing.assert_allclose(np.rad2deg(channels["wind_direction"]), 247.5)
