"""The cup anemometer's log as its logger writes it: a CSV file in km/h by its own wall clock, and
its sensor recipe."""

from __future__ import annotations

import csv
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from sim.datasets.dataset_recipe import AnemometerSpec, Truth

ZONE = "+02:00"
"""Of the logger's wall clock."""
CUP = AnemometerSpec(
    truth=Truth.MEASURED,
    noise=0.05,
    resolution=0.1,
    accuracy=0.1,
    effects={"anemometer-lag": {"distance": 2.3}, "anemometer-dead-zone": {"threshold": 0.4}},
)
"""The instrument, as its data sheet has it."""
SENSOR = """\
name = "cup-logger"
about = "A cup anemometer on a logger of one's own, described so that flagdata can read it"
source = "the demonstration"

[file]
delimiter = ";"
decimal = ","

[time]
columns = ["Date", "Time"]
format = "%d.%m.%Y %H:%M:%S.%f"

[channels.wind_speed]
column = "Wind speed [km/h]"
unit = "km/h"
range = [0, 200]

[channels.wind_direction]
column = "Wind direction [deg]"
unit = "deg"

[sensor]
name = "cup anemometer"
height = 4.0
distance-constant = 2.3
averaging = 1.0
threshold = 0.4
resolution = 0.1
accuracy = 0.1
"""
_DROPOUT = 3
"""Readings that are missing in one gap."""
_STUCK = 12
"""Readings that repeat the one before them."""


def write_log(
    path: Path, speed: FloatArray, direction: FloatArray, *, first: datetime, quiet: int, seed: int
) -> None:
    """Writes one reading a second, in km/h and degrees, with a gap anywhere and a stretch early on
    at which the logger stuck.

    Args:
        speed, direction: (n,) of the readings [m/s], [rad].
        first: stamp of the first reading by the logger's clock.
        quiet: number of the first readings, among which the logger sticks: before the film begins.
        seed: of the gap and the stretch.
    """
    rng = stream(seed, "demo", "logger")
    gap = int(rng.integers(len(speed) // 4, len(speed) - _DROPOUT))
    stuck = int(rng.integers(1, quiet - _STUCK))
    readings = np.stack([speed * 3.6, np.degrees(direction) % 360], axis=1)
    readings[stuck : stuck + _STUCK] = readings[stuck]
    zone = datetime.strptime(ZONE, "%z").tzinfo
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, delimiter=";")
        writer.writerow(["Date", "Time", "Wind speed [km/h]", "Wind direction [deg]"])
        for second, (kilometres, degrees) in enumerate(readings.tolist()):
            if not gap <= second < gap + _DROPOUT:
                stamp = (first.astimezone(UTC) + timedelta(seconds=second)).astimezone(zone)
                decimal = f"{kilometres:.2f}".replace(".", ",")
                clock = f"{stamp:%H:%M:%S}.{stamp.microsecond // 1000:03d}"
                writer.writerow([f"{stamp:%d.%m.%Y}", clock, decimal, f"{degrees:.0f}"])
