"""All challenges that were graded, a row each in one CSV file: by which code and criteria, and
every share with bounds.

A row is made of the sheet's JSON document, so that it can be made again of any sheet that was kept.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flagdata.core.files.outputs import check_rewrite, rewrite
from flagdata.errors import ConflictError, CorruptError

KEYS = ("challenge", "title", "code_version", "criteria", "sets")
"""Columns before the shares: the folder's name, its title, the grader's code, hashes of the
verdicts' criteria divided by blanks (empty in sheets from before they were kept), and how many sets
were graded."""


def row(name: str, sheet: Mapping[str, Any]) -> dict[str, str]:
    """The row of a sheet as `tests.studies.challenge.sheet.as_dict` gives it; shares are
    "hits/count [low, high]"."""
    shares = {what: _share_text(share) for what, share in sheet["shares"].items()}
    return {
        "challenge": name,
        "title": str(sheet["title"]),
        "code_version": str(sheet["code_version"]),
        "criteria": " ".join(sheet.get("criteria", [])),
        "sets": str(sum(sheet["sets"].values())),
        **shares,
    }


def rows(path: Path) -> list[dict[str, str]]:
    """The rows of a file, oldest first; none if there is no file.

    Raises:
        CorruptError: a file of other columns.
    """
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as stream:
        reader = csv.DictReader(stream)
        if tuple(reader.fieldnames or ())[: len(KEYS)] != KEYS:
            fix = "name the history that was written before, or a new file"
            raise CorruptError("not a history of challenges", where=str(path), fix=fix)
        return list(reader)


def without(path: Path, name: str) -> list[dict[str, str]]:
    """The rows of a file in which the challenge `name` is not yet.

    Raises:
        ConflictError: it is: a challenge is graded once.
        CorruptError: see `rows`.
        InputError: the file cannot be written.
    """
    check_rewrite(path)
    known = rows(path)
    if any(one["challenge"] == name for one in known):
        fix = "keep the history as it is, or give the challenge's folder another name"
        raise ConflictError(
            f"the challenge {name} is in the history already", where=str(path), fix=fix
        )
    return known


def write(path: Path, entries: list[dict[str, str]]) -> None:
    """All rows, in one step; a share that a row does not have stays empty."""
    columns = dict.fromkeys([*KEYS, *(column for entry in entries for column in entry)])
    stream = io.StringIO(newline="")
    writer = csv.DictWriter(stream, list(columns), restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(entries)
    rewrite(path, stream.getvalue())


def _share_text(share: Mapping[str, Any]) -> str:
    if not share["count"]:
        return ""
    return f"{share['hits']}/{share['count']} [{share['low']:.3f}, {share['high']:.3f}]"
