"""A command on a bucket is killed beside faults, as `tests.studies.failing.buckets` does with every
verb."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from tests.contract.imports import ROOT


def test_a_branch_whose_command_is_killed_beside_faults_is_made_by_the_same_command(
    tmp_path: Path,
) -> None:
    results = tmp_path / "buckets.json"
    command = [
        sys.executable,
        "-m",
        "tests.studies.failing.buckets",
        "branch",
        "--points",
        "3",
        "--out",
        str(results),
    ]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    page = results.with_suffix(".md").read_text()
    (row,) = (line.split("|") for line in page.splitlines() if line.startswith("| branch |"))
    points, killed, *_, lost, silent, wrong, repeats, unhealthy, left, _, _, _ = row[3:]
    assert int(points) == 3
    assert int(killed) >= 2, (
        ended.stdout
    )  # of the last request there may be none, where fewer were repeated
    assert [int(cell) for cell in (lost, silent, wrong, repeats, unhealthy, left)] == [0] * 6, (
        ended.stdout
    )
