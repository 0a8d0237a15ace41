"""Any operations on two lakes, killed before any of their steps, show what a plain model shows: see
`lake_machine`.

Many more are tried by `python -m tests.studies state-machine`.
"""

from __future__ import annotations

import pytest

from flagdata.errors import FlagdataError
from tests.flagdata.lake.lake_machine import RULES, machine_of, try_machine
from tests.flagdata.lake.seeded_bugs import BUGS


def test_two_lakes_in_folders_show_what_the_model_shows() -> None:
    try_machine(machine_of(RULES), examples=10, steps=20, number=1)


def test_two_lakes_in_a_bucket_show_what_the_model_shows(bucket_folder: str) -> None:
    try_machine(machine_of(RULES, in_bucket=bucket_folder), examples=1, steps=15, number=1)


@pytest.mark.parametrize("name", BUGS)
def test_the_machine_finds_a_seeded_bug(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    bug = BUGS[name]
    bug.put(monkeypatch)
    with pytest.raises((AssertionError, FlagdataError)):
        try_machine(machine_of(bug.among), examples=40, steps=12, number=bug.seed)


def test_the_machine_finds_a_seeded_bug_in_a_bucket(
    bucket_folder: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    bug = BUGS["erased-by-branch"]
    bug.put(monkeypatch)
    with pytest.raises((AssertionError, FlagdataError)):
        try_machine(
            machine_of(bug.among, in_bucket=bucket_folder), examples=10, steps=12, number=bug.seed
        )
