"""Films that show no flag are refused, and a film is cut into whole windows."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from flagdata.core.arrays import UInt8Array
from flagdata.core.findings import Finding
from flagdata.errors import RefusedError
from measure.commands import observe as command
from measure.film import ConditionedFilm, FlagSize
from measure.observables import watch_film, watching
from tests.program import invoke

SIZE = FlagSize(length=1.5, height=1.0)
RATE, COUNT, SIDE = 10.0, 30, 64


class Still:
    """Three seconds of a picture in which nothing moves."""

    name, rate, duration, start, width, height = "still", RATE, (COUNT - 1) / RATE, None, SIDE, SIDE

    def frames(self, first: float, last: float) -> Iterator[tuple[float, UInt8Array]]:
        picture = np.random.default_rng(1).integers(40, 200, (SIDE, SIDE)).astype(np.uint8)
        for k in range(COUNT):
            if first <= k / RATE <= last:
                yield k / RATE, picture

    def findings(self) -> tuple[Finding, ...]:
        return ()


def test_a_film_in_which_nothing_moves_is_refused() -> None:
    with pytest.raises(RefusedError, match="no motion like cloth"):
        watch_film(ConditionedFilm(Still()), SIZE)


def test_a_film_shorter_than_a_window_is_refused() -> None:
    with pytest.raises(RefusedError, match="no window"):
        watch_film(ConditionedFilm(Still()), SIZE, last=1.0)


def test_the_bar_of_observe_ends_at_the_whole_windows_of_the_part(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The example lasts 12 s: four windows of 2.5 s, and of its last 7 s three of 2 s."""
    lengths: list[int] = []

    @contextmanager
    def bar(total: int, label: str, unit: str) -> Iterator[None]:
        del label, unit
        lengths.append(total)
        yield

    def read(*_: object, **__: object) -> None:
        raise RefusedError("the film is read", fix="none")

    monkeypatch.setattr(command, "progress", bar)
    monkeypatch.setattr(watching, "watch_film", read)
    for part in ([], ["--start", "5s", "--window", "2s"]):
        invoke("observe", "example:flag", "--flag-size", "1.5x1.0", *part)
    assert lengths == [4, 3]
