"""Small logs of every format, written by the tests themselves."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest

from flagdata.core.schema import CHANNELS, SampleFlag
from flagdata.errors import FlagdataError
from flagdata.ingest import OpenFactsError, Reading, WindOptions, read_log
from flagdata.record.signals import Sensor, WindLog
from flagdata.timebase import iso

SECOND = 1_000_000_000
START = 1_777_636_800 * SECOND
"""2026-05-01T12:00:00Z."""


def made(seconds: object, speed: object = None, *, step: float = 1e-9, **more: object) -> Reading:
    """Rows at so many seconds after `START`, each with the wind speed given, or one of its own."""
    time = START + np.round(np.asarray(seconds, dtype=np.float64) * SECOND).astype(np.int64)
    own = {name: more.pop(name) for name in [*more] if name in CHANNELS}
    speeds = 2 + np.modf(np.arange(len(time)) * 0.618034)[0] * 7 if speed is None else speed
    channels = {"wind_speed": speeds, **own} if speed is not False else own
    return Reading(
        time=time,
        channels={name: np.asarray(values, dtype=np.float64) for name, values in channels.items()},
        flags=np.zeros(len(time), dtype=np.uint16),
        line=np.arange(2, len(time) + 2),
        step=round(step * SECOND),
        **{"sensor": Sensor(name="test"), **more},  # type: ignore[arg-type]
    )


@pytest.fixture
def log_file(tmp_path: Path) -> Callable[[str | bytes], Path]:
    """Writes text or bytes to a file and returns its path."""

    def write(content: str | bytes, name: str = "wind.log") -> Path:
        path = tmp_path / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return write


def named(content: str | bytes, options: Mapping[str, Any]) -> dict[str, Any]:
    """Options that name the recipe generic-csv for a log with its heading, as its user must: it
    states no unit."""
    first = (
        content[:200]
        if isinstance(content, str)
        else content.replace(b"\0", b"")[:200].decode("latin-1")
    )
    if "time,wind_speed" in first.partition("\n")[0] and not {"recipe", "format"} & set(options):
        return {**options, "recipe": "generic-csv"}
    return dict(options)


def answered(path: Path, options: WindOptions) -> WindLog:
    """A log as it is read when its user answers every doubt about its numbers with yes."""
    while True:
        try:
            return read_log(path, options)
        except OpenFactsError as error:
            if any(question.key != "expect" for question in error.questions):
                raise
            options = replace(
                options,
                expect=(*options.expect, *(question.example for question in error.questions)),
            )


@contextmanager
def written(content: str | bytes) -> Iterator[Path]:
    """A file of this text, as long as it is read."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "wind.log"
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        yield path


def read(content: str | bytes, **options: object) -> WindLog:
    """A text or bytes read as a log."""
    with written(content) as path:
        return answered(path, WindOptions(**named(content, options)))  # type: ignore[arg-type]


def shows(
    log: WindLog,
    name: str,
    first: str = "",
    *,
    missing: Sequence[int] | None = None,
    faults: Sequence[int] | None = None,
    **channels: float | Sequence[float],
) -> None:
    """Check a log's format and first instant, the rows marked as missing or faulty, and channels:
    the first value by a number, all values by a list."""
    assert log.format == name
    assert not first or iso(int(log.series.time[0])) == first
    for flag, rows in ((SampleFlag.MISSING, missing), (SampleFlag.SENSOR_FAULT, faults)):
        assert rows is None or np.flatnonzero(log.series.flags & flag).tolist() == rows
    for channel, values in channels.items():
        found = log.series.channels[channel]
        assert (found[0] if isinstance(values, (int, float)) else found) == pytest.approx(values), (
            channel
        )


def check_refused(
    content: bytes,
    error: type[FlagdataError],
    where: str = "",
    says: str = "",
    options: Mapping[str, Any] | None = None,
) -> None:
    """Check that a log is refused: by which error, with what in its place and in its sentence or
    fix."""
    with pytest.raises(FlagdataError) as caught:
        read(content, **(options or {}))
    assert isinstance(caught.value, error), caught.value
    assert caught.value.fix
    assert where in (caught.value.where or "")
    assert says in str(caught.value)


def check_reported(
    content: bytes,
    finding: str,
    count: int | None = None,
    where: str | None = None,
    flag: SampleFlag = SampleFlag.OK,
    flagged: int = 0,
    samples: int | None = None,
    options: Mapping[str, Any] | None = None,
) -> None:
    """Check that a log is read with a finding of this kind, count and place, and so many samples
    flagged."""
    log = read(content, **(options or {}))
    found = [f for f in log.findings if f.kind == finding]
    assert found, [f.kind for f in log.findings]
    assert count in (None, found[0].count)
    assert where in (None, found[0].where)
    assert samples in (None, len(log.series))
    assert int(((log.series.flags & flag) != 0).sum()) == flagged
