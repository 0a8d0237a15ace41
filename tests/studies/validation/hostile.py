"""Five hundred hostile recipes, models, inputs, files and lakes, and bombs; `validate-hostile.md`
is written beside."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tests.studies.hostile.campaign import MEMORY, SECONDS, WALL_SECONDS, campaign

COUNTS = {"recipes": 60, "models": 66, "inputs": 100, "files": 202, "lakes": 72, "bombs": 1}
"""Examples of each class; of the bombs, each is one."""


def run(*, seed: int, out: Path) -> dict[str, Any]:
    result = {str(seed): campaign(COUNTS, start=seed)}
    (out / "validate-hostile.md").write_text(page(result), encoding="utf-8")
    return result


def page(result: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> str:
    """The counts of each class by each seed."""
    rows = [
        f"| {kind} | {start} | {sum(found['examples'].values())} | {len(found['examples'])} | "
        f"{found['refused']} "
        f"| {len(found['failures'])} | {found['slowest']:g} s | {found['peak'] / 2**20:.0f} MiB |"
        for start, kinds in result.items()
        for kind, found in kinds.items()
    ]
    words = (
        "Recipes, models, inputs, files and lakes are damaged by values, types, bits, lengths, "
        "numbers, shapes, parts "
        "and files of other kinds, drawn from a seed; bombs are small files, made by hand, that "
        "state or unpack to "
        "what no machine holds. Each is read by the function or the commands that take it, in a "
        "process of its own. An "
        "example fails where anything but an error of flagdata or of the command's usage comes "
        "out, where it takes "
        f"more than {SECONDS:g} s of processor time or {WALL_SECONDS:g} s in all, or where the "
        "process, or one that it "
        f"starts, takes more than {MEMORY >> 20} MiB, of which some 400 MiB are modules that one "
        "command does not load."
    )
    head = "| class | seed | examples | kinds of file | refused | failed | slowest | most memory |"
    return "\n".join(["# Hostile files", "", words, "", head, "|---" * 8 + "|", *rows, ""])
