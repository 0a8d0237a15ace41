"""Remedies of flags as anemometers: what windows of a film show is made, as in
`tests.measure.anemometer`."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.core.schema import Kind
from flagdata.lake import Artifact, Lake
from flagdata.record import RecordWriter
from flagdata.record.signals import Sensor, WindSeries
from flagdata.timebase import NANOSECONDS
from measure.anemometer import anemometer_measuring, reading_calibration
from tests.measure.anemometer.made import Place, features, gusts, place
from tests.remedies.user import User

START = 1_777_629_600 * NANOSECONDS
SECONDS = 120
SIZED = ("--flag-size", "1.5x1.0")
CALIBRATE = ("calibrate", "monday", "--only", "anemometer", *SIZED, "--name")
READ = "the answer combines"


def shown(patch: pytest.MonkeyPatch, *, seed: int, where: Place | None = None) -> None:
    """Let a film show the gusts of a seed, seen from a place."""
    own = features(gusts(float(SECONDS), seed=seed), seed=seed, where=where)
    for module in (reading_calibration, anemometer_measuring):
        patch.setattr(module, "features_of", lambda *_, **__: own)


def film(name: str, kind: Kind) -> None:
    """Write two minutes of a film into the lake; a recording has a log of its gusts."""
    wind = gusts(float(SECONDS), seed=1)
    samples = np.arange(-29, SECONDS + 29, dtype=np.int64)
    with Lake.open("lake").transaction("a film") as transaction:
        staged = transaction.staging(".mcap")
        with RecordWriter(staged, metadata={"camera": {"name": name}}) as writer:
            for time in (START + np.arange(SECONDS + 1, dtype=np.int64) * NANOSECONDS).tolist():
                picture = np.zeros((8, 8), np.uint8)
                writer.frame(log_time=time, publish_time=time, timestamp=time, image=picture)
            if kind is Kind.RECORDING:
                writer.wind(
                    WindSeries(
                        time=START + samples * NANOSECONDS,
                        flags=np.zeros(len(samples), dtype=np.uint16),
                        channels={"wind_speed": np.interp(samples, *wind)},
                        sensor=Sensor(name="cup"),
                    )
                )
        end = START + SECONDS * NANOSECONDS
        transaction.add(
            Artifact(
                kind=kind,
                name=name,
                object=transaction.put(staged),
                start=START,
                end=end,
                rate=1.0,
                frame_count=SECONDS + 1,
                recipe={"film": name},
            )
        )


@pytest.fixture
def monday(user: User, monkeypatch: pytest.MonkeyPatch) -> None:
    """A recording of two minutes, beside a log of its gusts, that shows them."""
    film("monday", Kind.RECORDING)
    shown(monkeypatch, seed=1)


@pytest.mark.usefixtures("monday")
def test_a_film_is_read_by_the_model_that_was_calibrated(
    user: User, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = user.meets(
        "commands/calibrate_recordings.py", "agdata measure: --model", *CALIBRATE, "garden"
    )
    assert said.endswith("--model garden")
    command = ("measure", "monday", "--model", "garden")
    user.follows(*command, shows=READ)
    user.meets(
        "anemometer/anemometer_measuring.py",
        "out, or choose a networ",
        *command,
        "--area-weight",
        "0.1",
    )
    user.again(without="--area-weight", shows=READ)
    user.meets(
        "anemometer/anemometer_measuring.py",
        "check --flag-size, or ca",
        *command,
        "--flag-size",
        "3x1",
    )
    user.again(without="--flag-size", shows=READ)
    shown(monkeypatch, seed=1, where=place(seed=9))
    user.meets("measuring_model/novelty.py", "calibrate this flag from", *command)
    user.leaves(["--model"])
    user.succeeds("withdraw", "garden", "-m", "another flag", "--with-descendants")
    user.follows(*CALIBRATE, "yard")
    user.succeeds("measure", "monday", "--model", "yard", shows=READ)


@pytest.mark.usefixtures("monday")
def test_what_does_not_follow_the_wind_may_be_another_flag(
    user: User, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown(monkeypatch, seed=5)
    user.meets(
        "anemometer/reading_calibration.py", "check the flag with --cr", *CALIBRATE, "garden"
    )
    shown(monkeypatch, seed=1)
    user.follows(*CALIBRATE, "garden", "--flag", 2, shows="--model garden")
    user.leaves(["--crop", "align"])


@pytest.mark.usefixtures("monday")
def test_a_film_is_calibrated_beside_its_log(user: User) -> None:
    film("tuesday", Kind.CAMERA)
    options = ("--only", "anemometer", *SIZED)
    user.meets(
        "anemometer/reading_calibration.py",
        "align a film and a log (",
        "calibrate",
        "tuesday",
        *options,
    )
    aligned = user.follows(
        "align", "tuesday", "mast", "--by", "stamps", "--offset-sigma", "0.1", "--json"
    )
    ended = user.types("calibrate", aligned.document["recording"], *options)
    assert "no log of the wind is beside" not in ended.err
