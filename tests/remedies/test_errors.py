"""Remedies of what is mistyped, and of files that are not joined."""

from __future__ import annotations

import pytest

from tests.remedies.cases import Case, heal
from tests.remedies.user import User

CASES = [
    Case(
        "flagdata/cli.py",
        "see the command's --help",
        "ls --nothing --json",
        ("ls --help",),
        shows="--kind",
    ),
    Case(
        "commands/ingest_sources.py",
        "ingest each by itself: f",
        "ingest mast.csv second.csv --join",
        ("ingest mast.csv second.csv",),
    ),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_what_a_remedy_says_heals(case: Case, user: User) -> None:
    heal(user, case)
