"""Commands that read films take the processor time of their work, also on a machine that is busy or
has a quota."""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from unittest.mock import Mock

import pytest
import torch

import flagdata
from flagdata.core.workload import cores
from measure.anemometer.making import made
from measure.cloth import calibrate
from measure.cloth.flag_recordings import Sources
from measure.commands.measure_film import run

MOST = 1.5
"""Processor time on a busy machine, of that on an idle one."""
SECONDS = 2.5
"""Of the film: two windows."""


def _processor_time(threads: int) -> float:
    """Measures a film for a caller whose torch has so many threads; the processor time that it took
    [s]."""
    before = torch.get_num_threads()
    torch.set_num_threads(threads)
    try:
        begun = time.process_time()
        flagdata.measure("example:flag", end=SECONDS)
        return time.process_time() - begun
    finally:
        torch.set_num_threads(before)


@pytest.fixture
def busy() -> Iterator[None]:
    """Twice as many processes as cores that do nothing but turn; their time is no child's that was
    waited for."""
    loops = [
        subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(2 * cores())
    ]
    yield
    for loop in loops:
        loop.kill()
    for loop in loops:
        loop.wait()


def test_measuring_on_a_busy_machine_takes_the_processor_time_of_its_work(busy: None) -> None:
    """The work is what one thread takes, whose time is nearly that of an idle machine on a busy
    one, too."""
    _processor_time(1)  # what is loaded once
    pairs = [(_processor_time(1), _processor_time(cores())) for _ in range(3)]
    work, taken = (statistics.median(times) for times in zip(*pairs, strict=True))
    assert taken < MOST * work


class _ReachedError(Exception):
    """The first step of the work."""


ENTRIES: dict[str, tuple[str, Callable[[], object]]] = {
    "measure": (
        "measure.commands.measure_film.gate_beside",
        lambda: run(Mock(), Mock(reading=None), Mock()),
    ),
    "observe": (
        "measure.film.film_source.subjects",
        lambda: flagdata.observe("flag.mp4", flag_size=(1.5, 1.0)),
    ),
    "calibrate, films": (
        "measure.cloth.flag_recordings.usable",
        lambda: Sources(opened=(), left_out=()).read(Mock()),
    ),
    "calibrate, weight": (
        "measure.cloth.cloth_calibration.designs_of",
        lambda: calibrate((), Mock(), folder=Path("unused")),
    ),
    "calibrate, anemometer": (
        "measure.anemometer.making.usable",
        lambda: made(
            ["a"],
            Mock(),
            Mock(),
            name=None,
            model=None,
            lake=None,
            at="main",
            branch=None,
            first=0,
            last=None,
            level=0.9,
        ),
    ),
}
"""What reads films → its first step, and a call."""


@pytest.mark.parametrize("entry", ENTRIES)
def test_films_are_read_by_one_thread_and_the_callers_threads_stay(
    entry: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    place, call = ENTRIES[entry]
    seen: list[int] = []

    def reach(*_: object, **__: object) -> None:
        seen.append(torch.get_num_threads())
        raise _ReachedError

    monkeypatch.setattr(place, reach)
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    try:
        with pytest.raises(_ReachedError):
            call()
        assert (seen, torch.get_num_threads()) == ([1], 2)
    finally:
        torch.set_num_threads(before)
