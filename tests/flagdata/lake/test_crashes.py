"""A process that is killed by a signal leaves what a process leaves that dies as `crashes` has
it."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from flagdata.lake import Lake, doctor
from tests.flagdata.lake.crashes import Killed, dying
from tests.flagdata.lake.killed_worker import OPERATIONS, prepare
from tests.flagdata.lake.lake_machine import Items
from tests.pausing import ROOT, finding_tests

pytestmark = pytest.mark.filterwarnings(
    "ignore:unclosed file:ResourceWarning"
)  # a process that dies closes none
STEPS = (1, 4, 8, 11)
_DRAWN = re.compile(r"(?<![0-9a-f])[0-9a-f]{32}(?![0-9a-f])")


def left(path: Path) -> list[str]:
    """What lies in a lake, without the parts of names that are drawn, and what doctor says."""
    files = [_DRAWN.sub("#", file.relative_to(path).as_posix()) for file in path.rglob("*")]
    return sorted([*files, *(finding.kind for finding in doctor(Lake.open(path)))])


def test_a_process_killed_by_a_signal_leaves_what_one_leaves_that_dies_here(tmp_path: Path) -> None:
    prepare(tmp_path / "lake")
    killed = 0
    command = [sys.executable, "-m", "tests.flagdata.lake.killed_worker"]
    with subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=ROOT,
        env=finding_tests(),
    ) as worker:
        assert worker.stdin is not None
        assert worker.stdout is not None
        for name, run in OPERATIONS.items():
            for step in STEPS:
                here, there = tmp_path / f"{name}-{step}-here", tmp_path / f"{name}-{step}-there"
                for path in (here, there):
                    shutil.copytree(tmp_path / "lake", path)
                worker.stdin.write(f"{name} {step} {there}\n")
                worker.stdin.flush()
                lake = Lake.open(here)
                items = Items(lake)
                try:
                    with dying(step) as steps:
                        run(lake, items)
                except Killed:
                    killed += 1
                assert (worker.stdout.readline() == "killed\n") == steps.dead, (name, step)
                assert left(here) == left(there), (name, step)
        worker.stdin.close()
    assert killed >= len(OPERATIONS) * 3 - 4
