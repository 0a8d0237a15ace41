"""A film and its log become what is calibrated."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flagdata.answer.circumstances import Circumstances
from flagdata.api.measuring_verbs import OfFlag
from flagdata.core.findings import Finding, Severity
from flagdata.errors import InputError, RefusedError
from flagdata.record.signals import Sensor, WindSeries
from measure.cloth import OBSERVED, sources_of
from measure.cloth import flag_recordings as filmed
from measure.film import FlagSize
from measure.observables import WindowReading

_SIZE = FlagSize(length=1.5, height=1.0)
_START = 1_700_000_000_000_000_000


def _subject(*, logged: float = 200.0, findings: tuple[Finding, ...] = ()) -> Any:
    time = _START + np.round((np.arange(0.0, logged) - 60.0) * 1e9).astype(np.int64)
    wind = WindSeries(
        time=time,
        channels={"wind_speed": np.linspace(4.0, 6.0, len(time))},
        flags=np.zeros(len(time), np.uint16),
        sensor=Sensor(name="cup", distance_constant=2.5),
    )
    film = SimpleNamespace(name="film", start=_START, duration=300.0, findings=lambda: findings)
    artifact = SimpleNamespace(id="0123abcd", clock_sigma=0.3)
    return SimpleNamespace(
        film=film,
        artifact=artifact,
        record=SimpleNamespace(wind=lambda: wind),
        identity="0123abcd",
        circumstances=lambda lake: Circumstances(start=_START, seconds=300.0, sensor="cup"),
    )


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch) -> None:
    """Windows that show their number of everything; the third shows nothing."""

    def watched(film: object, size: FlagSize, *, first: float, last: float, advance: object) -> Any:
        count = int((last - first) / 2.5)
        return SimpleNamespace(
            windows=tuple(None if k == 2 else k for k in range(count)), seconds=2.5
        )

    monkeypatch.setattr(filmed, "watch_film", watched)
    fake = SimpleNamespace(of_film=lambda window: WindowReading(value=float(window)), sigma=0.01)
    monkeypatch.setattr(filmed, "OBSERVABLES", dict.fromkeys(OBSERVED, fake))


@pytest.mark.usefixtures("shown")
def test_two_minutes_are_read_with_the_log_on_the_films_clock() -> None:
    found = filmed.part_of(_subject(), first=10.0, last=None).read(_SIZE)
    stated = found.circumstances
    assert (stated.start, stated.seconds, stated.sensor) == (_START + 10 * 10**9, 120.0, "cup")
    assert found.readings.shape == (48, len(OBSERVED))
    assert np.isnan(found.readings[2]).all()
    assert found.readings[5, 0] == 5.0
    assert (found.log.distance, found.log.clock) == (2.5, 0.3)
    # The log rises by 2/199 m/s a second, and is at its 70th second where the part begins.
    assert found.speed[0] == pytest.approx(4.0 + 2 / 199 * 71.25, abs=0.01)
    assert found.first == 10.0
    assert [(one.kind, one.what) for one in found.findings] == [
        ("first-part", "of 290.0 s the first 120 are used")
    ]
    assert found.sigma.tolist() == [0.01] * len(OBSERVED)


@pytest.mark.usefixtures("shown")
def test_a_log_that_ends_before_the_film_is_refused() -> None:
    with pytest.raises(InputError, match="does not cover"):
        filmed.part_of(_subject(logged=100.0), first=0.0, last=None).read(_SIZE)


@pytest.mark.usefixtures("shown")
def test_a_camera_that_cannot_be_steadied_is_refused() -> None:
    lost = Finding(
        kind="camera-lost", severity=Severity.WARNING, what="40 % of the frames", value=0.4
    )
    with pytest.raises(RefusedError, match="the camera may move"):
        filmed.part_of(_subject(findings=(lost,)), first=0.0, last=None).read(_SIZE)


def test_a_film_without_a_log_is_refused() -> None:
    subject = _subject()
    subject.record = None
    with pytest.raises(InputError, match="no log of the wind"):
        filmed.part_of(subject, first=0.0, last=None).read(_SIZE)


def test_a_film_too_short_to_weigh_is_refused_by_its_length_before_its_log_is_cut() -> None:
    with pytest.raises(InputError, match=r"0\.5 s of film have a log"):
        filmed.part_of(_subject(), first=0.0, last=0.5).read(_SIZE)


def _named(patch: pytest.MonkeyPatch, durations: dict[str, float]) -> None:
    """Recordings of a lake by their names, none of whose pictures may be read."""

    def subjects(source: str, **_: object) -> list[Any]:
        own = _subject()
        own.film.name, own.film.duration = source, durations[source]
        return [own]

    def watched(*_: object, **__: object) -> Any:
        raise AssertionError("pictures are read")

    patch.setattr(filmed, "subjects", subjects)
    patch.setattr(filmed, "watch_film", watched)


def test_films_that_are_together_too_short_are_refused_before_a_picture_is_read(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    _named(monkeypatch, {"monday": 15.0, "tuesday": 4.0})
    with pytest.raises(
        InputError,
        match=r"15 s of film have a log beside them; tuesday is left out: only 4 s of film",
    ):
        sources_of(("monday", "tuesday"), OfFlag(), _SIZE, None, at="main")


def test_a_film_whose_length_is_enough_is_opened_and_not_read(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    _named(monkeypatch, {"monday": 60.0})
    found = sources_of(("monday",), OfFlag(), _SIZE, None, at="main")
    assert [one.duration for one in found.opened] == [60.0]
    with pytest.raises(AssertionError, match="pictures are read"):
        found.read(_SIZE)
