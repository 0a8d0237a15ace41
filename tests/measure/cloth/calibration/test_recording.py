"""A film and a log in a lake, from `flagdata observe` to the artifact of `flagdata calibrate`;
nothing is simulated."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click import Command
from click.testing import CliRunner

from flagdata.core.schema import Kind
from flagdata.lake import Artifact, Lake
from flagdata.record import RecordWriter
from flagdata.record.signals import Sensor, WindSeries
from flagdata.timebase import NANOSECONDS
from measure.commands.calibrate import calibrate
from measure.commands.observe import observe
from tests.measure.observables.shapes import RATE
from tests.measure.observables.test_pixels import painted

_START = 1_700_000_000 * NANOSECONDS
_SECONDS = 22.6


@pytest.fixture(scope="module")
def lake(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A camera's film, and the recording that it was aligned to: both called "monday"."""
    pictures = painted(contrast=90.0, seconds=2.5).frames[:-1]
    times = _START + np.round(np.arange(round(_SECONDS * RATE)) / RATE * NANOSECONDS).astype(
        np.int64
    )
    seconds = np.arange(-70, 30, dtype=np.int64)
    folder = tmp_path_factory.mktemp("lakes") / "lake"
    made = Lake.create(folder)
    with made.transaction("a film with its log") as transaction:
        staged = transaction.staging(".mcap")
        with RecordWriter(staged, metadata={"camera": {"name": "monday"}}) as writer:
            for number, time in enumerate(times.tolist()):
                frame = pictures[number % len(pictures)]
                writer.frame(log_time=time, publish_time=time, timestamp=time, image=frame)
            writer.wind(
                WindSeries(
                    time=_START + seconds * NANOSECONDS,
                    flags=np.zeros(len(seconds), dtype=np.uint16),
                    channels={"wind_speed": 5.0 + np.sin(seconds / 4.0)},
                    sensor=Sensor(name="cup"),
                )
            )
        stored = transaction.put(staged)
        shared: dict[str, Any] = {
            "name": "monday",
            "object": stored,
            "start": _START,
            "frame_count": len(times),
            "rate": RATE,
        }
        camera = Artifact(kind=Kind.CAMERA, recipe={"of": "camera"}, **shared)
        transaction.add(camera)
        transaction.add(
            Artifact(kind=Kind.RECORDING, recipe={"of": "recording"}, parents=[camera.id], **shared)
        )
    return folder


def _said(command: Command, lake: Path, *arguments: str, code: int = 0) -> dict[str, Any]:
    given = ["monday", "--lake", str(lake), "--flag-size", "1.5x1.0", "--json", *arguments]
    done = CliRunner().invoke(command, given, catch_exceptions=False)
    assert done.exit_code == code, done.output
    return json.loads(done.stdout)


def _recording(lake: Path) -> str:
    return Lake.open(lake).rows({"kind": Kind.RECORDING})["artifact"][0].as_py()


def test_a_recording_is_meant_by_the_name_that_its_film_has_too(lake: Path) -> None:
    """What is observed has the wind of the log, and its instants."""
    found = _said(observe, lake, "--start", "2s", "--end", "12s")
    # The mean of 5 + sin(t/4) over 2.5 s, to what samples a second resolve.
    middles = 2.0 + 2.5 * (np.arange(4) + 0.5)
    expected = 5.0 + np.sin(middles / 4) * np.sin(2.5 / 8) / (2.5 / 8)
    np.testing.assert_allclose(found["wind"], expected, atol=0.15)
    assert found["observables"]["droop"]["windows"] == 4
    row = Lake.open(lake).artifact(found["artifact"])
    assert list(row.parents) == [_recording(lake)]
    assert (row.start, row.end) == (_START + 2 * NANOSECONDS, _START + 12 * NANOSECONDS)


@pytest.mark.usefixtures("cheap")
def test_a_film_is_calibrated_and_each_part_of_it_is_an_artifact(
    lake: Path, tmp_path: Path
) -> None:
    """No simulated flag looks like the painted one, whose weight is withheld; what was read is kept
    all the same."""
    page = tmp_path / "page.html"
    whole = _said(calibrate, lake, "--end", "20s", "--report", str(page), code=3)
    assert whole["withheld"].startswith("monday: ")
    assert whole["recordings"][0]["windows"] == 8
    assert "droop" in whole["recordings"][0]["observables"]
    row = Lake.open(lake).artifact(whole["artifact"])
    assert (row.kind, list(row.parents)) == (Kind.MEASUREMENT, [_recording(lake)])
    assert "monday" in page.read_text()
    other = _said(calibrate, lake, "--start", "2s", "--end", "22s", code=3)
    assert other["artifact"] != whole["artifact"]
