"""The ledger of proposals: what was tried on which data, errors before and after, and whether it was kept."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from flagdata.documents import read_json
from flagdata.errors import CorruptError
from flagdata.outputs import check_rewrite, rewrite
from measure.propose.outcome import Outcome

SCHEMA = "flagdata.ledger/1"


def entries(path: Path) -> list[dict[str, Any]]:
    """What a ledger holds; nothing where there is none.

    Raises:
        CorruptError: a file that is no ledger.
    """
    if not path.exists():
        return []
    content = read_json(path, noun="ledger", fix="move it away")
    if content.get("schema") != SCHEMA or not isinstance(content.get("entries"), list):
        raise CorruptError(f"not a ledger of schema {SCHEMA}", where=str(path), fix="move it away")
    return content["entries"]


def check(path: Path) -> None:
    """Refuse a path at which no entry can be added, before any term is sought.

    Raises:
        ConflictError, CorruptError: a file that is no ledger.
        InputError: the folder cannot be written.
    """
    check_rewrite(path)
    entries(path)


def add(path: Path, outcome: Outcome, *, effect: str) -> None:
    """One more entry, after those that are there. Entries are never changed.

    Args:
        effect: name of the effect's file and class; empty where no term was taken.

    Raises:
        CorruptError: a file that is no ledger.
    """
    made = [*entries(path), {"effect": effect, **outcome.as_dict()}]
    text = json.dumps({"schema": SCHEMA, "entries": made}, indent=1, allow_nan=False, ensure_ascii=False)
    rewrite(path, text + "\n")
