"""The proposal log: the terms tried on each data set, errors before and after, and whether the term
was kept."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from flagdata.core.files.outputs import check_rewrite, rewrite
from flagdata.core.json_values import json_values
from flagdata.errors import CorruptError
from flagdata.recipes.documents import read_json
from measure.propose.outcome import ProposalOutcome
from measure.verdict.verdict_record import QUANTITY_ENTRIES

SCHEMA = "flagdata.proposals/1"
_FORMER_SCHEMA = "flagdata.ledger/1"


def entries(path: Path) -> list[dict[str, Any]]:
    """Reads the entries of a log; empty where there is no file.

    Raises:
        CorruptError: the file is not a proposal log.
    """
    if not path.exists():
        return []
    content = read_json(path, noun="proposal log", fix="move it away")
    if content.get("schema") not in (SCHEMA, _FORMER_SCHEMA) or not isinstance(
        content.get("entries"), list
    ):
        raise CorruptError(
            f"it is not a proposal log of schema {SCHEMA}", where=str(path), fix="move it away"
        )
    return content["entries"]


def check(path: Path) -> None:
    """Refuses a path at which no entry can be added, before any term is tried.

    Raises:
        ConflictError, CorruptError: the file is not a proposal log.
        InputError: the folder cannot be written.
    """
    check_rewrite(path)
    entries(path)


def add(path: Path, outcome: ProposalOutcome, *, effect: str) -> None:
    """Adds one more entry, after those that are there. Entries are never changed.

    Args:
        effect: name of the effect's file and class; empty where no term was accepted.

    Raises:
        CorruptError: the file is not a proposal log.
    """
    all_entries = [
        *entries(path),
        {"effect": effect, **json_values(outcome, names=QUANTITY_ENTRIES)},
    ]
    text = json.dumps(
        {"schema": SCHEMA, "entries": all_entries}, indent=1, allow_nan=False, ensure_ascii=False
    )
    rewrite(path, text + "\n")
