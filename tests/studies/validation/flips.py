"""Single bits that flip in what flagdata keeps, by two seeds; `validate-flips.md` is written
beside."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tests.studies.hostile.flips import campaign

COUNT = int(os.environ.get("FLAGDATA_FLIPS", "200"))
"""Flips of each kind of file by one seed."""


def run(*, seed: int, out: Path) -> dict[str, Any]:
    result = {str(start): campaign(count=COUNT, seed=start) for start in (seed, seed + 1)}
    (out / "validate-flips.md").write_text(page(result), encoding="utf-8")
    return result


def page(result: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> str:
    """The counts of each kind of file by each seed."""
    rows = [
        f"| {kind} | {seed} | {one['flips']} | {one['refused']} | {one['same']} | "
        f"{len(one['failures'])} |"
        for seed, kinds in result.items()
        for kind, one in kinds.items()
    ]
    words = (
        "One bit of a file flips, and what reads the file is asked as a fresh process asks. It "
        "refuses with an error "
        "that names the file; or it gives the same as before, where the bit carries no meaning, "
        "where a summary or a "
        "checkpoint covers an old entry of the log (`verify` and `clone` compare those), or where "
        "a cache is made "
        "anew. Another value without an error, or any other exception, is a failure."
    )
    head = "| kind of file | seed | flips | refused | the same | failed |"
    return "\n".join(["# Flipped bits", "", words, "", head, "|---" * 6 + "|", *rows, ""])
