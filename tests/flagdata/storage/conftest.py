"""A store whose every answer a test sets."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from flagdata.storage import RemotePath, connection
from tests.s3 import Scripted, serving

Answering = Callable[[tuple[int, dict[str, str], bytes] | None], RemotePath]


@pytest.fixture(scope="session")
def scripted() -> Iterator[str]:
    """The address of such a store."""
    with serving(Scripted) as address:
        yield address


@pytest.fixture
def answering(
    scripted: str, use_store: Callable[[str], None], monkeypatch: pytest.MonkeyPatch
) -> Answering:
    """Sets the store's answer, and gives a place of its bucket; failed requests are repeated
    once."""
    monkeypatch.setattr(connection, "RETRIES", 1)
    use_store(scripted)

    def answer(given: tuple[int, dict[str, str], bytes] | None) -> RemotePath:
        Scripted.answer = given
        Scripted.asked.clear()
        return RemotePath.parse("s3://case/lake/lake.json")

    return answer
