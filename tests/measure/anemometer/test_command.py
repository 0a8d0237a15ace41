"""From a recording in a lake to a reading model by which another film is measured; what is looked
at is replaced."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

import flagdata
from flagdata.core.schema import Kind
from flagdata.errors import InputError, RefusedError, UsageError
from flagdata.lake import Artifact, Lake
from flagdata.record import RecordWriter
from flagdata.record.signals import Sensor, WindSeries
from flagdata.timebase import NANOSECONDS
from measure.anemometer import anemometer_measuring, making, reading_calibration
from measure.commands.calibrate import calibrate
from measure.commands.measure import measure
from measure.measuring_model import network
from tests.golden_answers import changes
from tests.measure.anemometer.made import features, gusts, place

_START = 1_700_000_000 * NANOSECONDS
_SECONDS = 120


@pytest.fixture
def lake(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A recording "monday" of two minutes with a gusty log, whose windows show what `made.features`
    says."""
    wind = gusts(float(_SECONDS), seed=1)
    samples = np.arange(-29, _SECONDS + 29, dtype=np.int64)
    picture = np.zeros((8, 8), np.uint8)
    made = Lake.create(tmp_path / "lake")
    with made.transaction("a film with its log") as transaction:
        staged = transaction.staging(".mcap")
        with RecordWriter(staged, metadata={"camera": {"name": "monday"}}) as writer:
            for time in (_START + np.arange(_SECONDS + 1, dtype=np.int64) * NANOSECONDS).tolist():
                writer.frame(log_time=time, publish_time=time, timestamp=time, image=picture)
            writer.wind(
                WindSeries(
                    time=_START + samples * NANOSECONDS,
                    flags=np.zeros(len(samples), dtype=np.uint16),
                    channels={"wind_speed": np.interp(samples, *wind)},
                    sensor=Sensor(name="cup"),
                )
            )
        transaction.add(
            Artifact(
                kind=Kind.RECORDING,
                name="monday",
                object=transaction.put(staged),
                start=_START,
                rate=1.0,
            )
        )
    _shown(monkeypatch, seed=1)
    return tmp_path / "lake"


def _shown(patch: pytest.MonkeyPatch, **changes: Any) -> None:
    own = features(gusts(float(_SECONDS), seed=changes["seed"]), **changes)
    for module in (reading_calibration, anemometer_measuring):
        patch.setattr(module, "features_of", lambda *_, **__: own)


def _run(command: Any, *arguments: str | Path) -> Result:
    return CliRunner().invoke(command, [str(one) for one in arguments])


def test_a_recording_becomes_a_model_by_which_another_film_is_read(
    lake: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = (
        "monday",
        "--lake",
        lake,
        "--flag-size",
        "1.5x1.0",
        "--only",
        "anemometer",
        "--name",
        "garden",
    )
    done = _run(calibrate, *given, "--json", "--report", tmp_path / "garden.html")
    assert done.exit_code == 0, done.output
    said = json.loads(done.stdout)["anemometer"]
    assert (said["name"], said["windows"]) == ("garden", 100)
    assert changes("calibrate-anemometer", json.loads(done.stdout), relative=1e-5) == []
    row = Lake.open(lake).artifact(said["artifact"])
    recording = Lake.open(lake).rows({"kind": Kind.RECORDING})["artifact"][0].as_py()
    assert (row.kind, list(row.parents)) == (Kind.MEASUREMENT, [recording])
    assert "monday" in (tmp_path / "garden.html").read_text()
    assert "there already" in _run(calibrate, *given).stderr

    _shown(monkeypatch, seed=2)
    later = _run(measure, "monday", "--lake", lake, "--model", "garden", "--json")
    assert later.exit_code == 0, later.output
    found = json.loads(later.stdout)
    assert found["model"] == "garden"
    assert changes("measure-anemometer", found, relative=1e-5) == []
    assert len(found["windows"]) == 100
    mean = gusts(float(_SECONDS), seed=2)[1][300:1500].mean()
    low, high = found["quantities"]["wind_speed"]["interval"]
    assert low - 0.1 < mean < high + 0.1
    assert said["artifact"] in Lake.open(lake).artifact(found["artifact"]).parents

    _shown(monkeypatch, seed=2, where=place(seed=9))
    refused = _run(measure, "monday", "--lake", lake, "--model", said["artifact"])
    assert "another place" in str(refused.exception)

    _shown(monkeypatch, seed=1)
    monkeypatch.setattr("flagdata.core.provenance.code_version", lambda: "0.1.0+mended")
    assert "committed as version 2 of 'garden'" in _run(calibrate, *given).stderr
    newest = network("garden", lake=Lake.open(lake), at=None).artifact
    assert newest is not None
    assert newest.code_version == "0.1.0+mended"


def test_the_call_makes_the_reading_model_of_the_command_with_its_answer(
    lake: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options: dict[str, Any] = {"lake": lake, "flag_size": (1.5, 1.0), "only": "anemometer"}
    looked_at = flagdata.calibrate("monday", name="garden", read_only=True, **options)
    assert looked_at.document["anemometer"]["artifact"] is None
    found = flagdata.calibrate("monday", name="garden", **options)
    given = ("--lake", lake, "--flag-size", "1.5x1.0", "--only", "anemometer", "--name", "garden")
    printed = json.loads(_run(calibrate, "monday", *given, "--json").stdout)
    assert found.document == {"anemometer": printed["anemometer"]}
    assert found.sentence.startswith("This flag reads winds of ")
    windows = found.to_xarray()
    error = windows["wind_speed"] - windows["wind_logged"]
    rmse = found.document["anemometer"]["rmse"]
    assert float((error**2).mean()) ** 0.5 == pytest.approx(rmse, rel=1e-6)
    with pytest.raises(RefusedError, match="reads winds"):
        _ = found.area_weight

    _shown(monkeypatch, seed=2)
    measured = flagdata.measure("monday", lake=lake, model="garden", flag_size=(1.5, 1.0))
    mean = gusts(float(_SECONDS), seed=2)[1][300:1500].mean()
    low, high = measured.wind.interval
    assert low - 0.1 < mean < high + 0.1


def test_the_call_refuses_what_the_command_refuses(lake: Path) -> None:
    with pytest.raises(UsageError, match="--name cannot be combined") as refused:
        flagdata.calibrate("monday", lake=lake, flag_size=(1.5, 1.0), only="weight", name="garden")
    assert refused.value.where == "name"
    with pytest.raises(UsageError, match="no pictures"):
        flagdata.calibrate({"time": [0.0]}, flag_size=(1.5, 1.0), only="anemometer")


def test_a_model_whose_network_has_changed_is_refused(
    lake: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = ("monday", "--lake", lake, "--flag-size", "1.5x1.0", "--only", "anemometer")
    assert _run(calibrate, *given).exit_code == 0
    monkeypatch.setattr("measure.measuring_model.networks.file_hash", lambda _: "another")
    with pytest.raises(InputError, match="is another one"):
        network("monday-anemometer", lake=Lake.open(lake), at=None)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            ("--only", "anemometer", "--azimuth", "70±7"),
            "--azimuth cannot be combined with --only anemometer",
        ),
        (("--only", "weight", "--name", "garden"), "--name cannot be combined with --only weight"),
    ],
)
def test_options_of_what_is_not_done_are_refused(
    lake: Path, given: tuple[str, ...], said: str
) -> None:
    done = _run(calibrate, "monday", "--lake", lake, "--flag-size", "1.5x1.0", *given)
    assert isinstance(done.exception, UsageError)
    assert said in str(done.exception)


def test_a_table_makes_no_reading_model(tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    table.write_text("time,wind,droop\n")
    done = _run(calibrate, table, "--flag-size", "1.5x1.0", "--only", "anemometer")
    assert isinstance(done.exception, UsageError)
    assert "no pictures" in str(done.exception)


def test_a_recording_that_cannot_be_looked_at_is_left_out_of_two_and_named(
    lake: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before the first film is looked at its camera is found to be lost."""
    plain, asked = making.windows_of_recording, list[str]()

    def recorded(subject: Any, *given: Any, **named: Any) -> Any:
        asked.append(subject.film.name)
        if len(asked) == 1:
            raise RefusedError(
                "the picture changes at once", where=subject.film.name, fix="choose a part"
            )
        return plain(subject, *given, **named)

    monkeypatch.setattr(making, "windows_of_recording", recorded)
    given = (
        "monday",
        "monday",
        "--lake",
        lake,
        "--flag-size",
        "1.5x1.0",
        "--only",
        "anemometer",
        "--json",
    )
    done = _run(calibrate, *given)
    assert done.exit_code == 0, done.output
    said = json.loads(done.stdout)["anemometer"]
    assert [one["name"] for one in said["recordings"]] == ["monday"]
    assert said["findings"][0]["what"] == "monday is left out: the picture changes at once"
    assert "monday is left out: the picture changes at once; choose a part" in done.stderr
