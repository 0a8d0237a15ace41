"""Which part of a JSON object is the log: a reading beside lists, one of several lists, places with a reading each."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from flagdata.ingest.anemometer import WindOptions, anemometers, read_log

Write = Callable[..., Path]
READINGS = [
    {"timestamp": f"2026-05-06 03:{at:02d}:00", "windSpeed": 1.0 + at % 3, "windDirection": 200 + at}
    for at in range(30)
]


def test_of_several_lists_of_readings_the_closest_in_time_is_read_and_the_others_are_told(log_file: Write) -> None:
    hourly = [{"hour": f"2026-05-06 {at:02d}", "windAvg": 9.0, "windMax": 12.0} for at in range(20)]
    whole = {"current": READINGS[-1], "history": READINGS, "hourly": hourly}
    log = read_log(log_file(json.dumps(whole)), WindOptions(unit="m/s", zone="UTC"))
    assert log.series.channels["wind_speed"].tolist() == [1.0 + at % 3 for at in range(30)]
    (told,) = (finding.what for finding in log.findings if finding.kind == "several-lists")
    assert "'hourly'" in told


def test_a_reading_beside_lists_of_what_it_was_made_of_is_read(log_file: Write) -> None:
    tries = {"speed": ["", "3.4", "3.5"], "avg10": ["3.4", ".", "3.4"]}
    whole = {"ts": 1_777_636_800, "speed": 3.4, "direction": "NE", "debug": tries}
    log = read_log(log_file(json.dumps(whole)), WindOptions(unit="m/s"))
    assert log.series.time.tolist() == [1_777_636_800 * 10**9]
    assert log.series.channels["wind_speed"].tolist() == [3.4]


def test_places_with_one_reading_each_are_told_apart(log_file: Write) -> None:
    rows = [
        {"name": name, "wind_kn": speed, "at": f"2026-05-01T12:{minute:02d}:00Z"}
        for name, speed, minute in (("North pier", 5, 14), ("Lighthouse", 8, 10), ("South beach", 4, 15))
    ]
    path = log_file(json.dumps({"source": "a service", "stations": rows}))
    found = {name: read_log(path, WindOptions(wind=name)).series for name in anemometers(path)}
    assert {name: series.time.tolist() for name, series in found.items()} == {
        row["name"]: [int(np.datetime64(row["at"].removesuffix("Z"), "ns").astype(np.int64))] for row in rows
    }


def test_records_that_are_numbered_are_of_one_place(log_file: Write) -> None:
    rows = [{"name": f"record {at}", "wind_kn": 5 + at % 3, "at": f"2026-05-01T12:{at:02d}:00Z"} for at in range(12)]
    assert anemometers(log_file(json.dumps(rows))) == ()
