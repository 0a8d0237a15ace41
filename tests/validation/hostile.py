"""Hostile recipes, models, inputs and lakes: 200 of each, by two seeds; `validate-hostile.md` is written beside."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tests.hostile import KINDS
from tests.hostile.campaign import MEMORY, SECONDS, WALL_SECONDS, campaign

COUNT = 100
"""Examples of a class by one seed."""


def run(*, seed: int, out: Path) -> dict[str, Any]:
    seeds = (seed, seed + 1)
    result = {str(start): {kind: campaign(kind, count=COUNT, start=start) for kind in KINDS} for start in seeds}
    (out / "validate-hostile.md").write_text(page(result), encoding="utf-8")
    return result


def page(result: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> str:
    """The counts of each class by each seed."""
    rows = [
        f"| {kind} | {start} | {sum(found['examples'].values())} | {len(found['examples'])} | {found['refused']} "
        f"| {len(found['failures'])} | {found['slowest']:g} s | {found['peak'] / 2**20:.0f} MiB |"
        for start, kinds in result.items()
        for kind, found in kinds.items()
    ]
    words = (
        "Recipes, models, inputs and lakes are damaged by values, types, bytes, shapes and files of other kinds, drawn "
        "from a seed, and read by the function or the command that takes them. An example fails where anything but an "
        "error of flagdata or of the command's usage comes out, where it takes more than "
        f"{SECONDS:g} s of processor time or {WALL_SECONDS:g} s in all, or where the process takes more than "
        f"{MEMORY >> 20} MiB beyond what it has with its modules loaded."
    )
    head = "| class | seed | examples | kinds of file | refused | failed | slowest | most memory |"
    return "\n".join(["# Hostile files", "", words, "", head, "|---" * 8 + "|", *rows, ""])
