"""How long work takes is stated in the unit that people use for it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import torch

from flagdata.core import workload
from flagdata.core.workload import announce_work, cores, one_thread


@pytest.mark.parametrize(
    ("seconds", "workers", "said"),
    [
        (600.0, 1, "simulating takes about 10 minutes on one idle core"),
        (600.0, 2, "simulating takes about 5 minutes on 2 idle cores"),
        (20.0, 2, "simulating takes a minute or two on 2 idle cores"),
        (9000.0, 1, "simulating takes about 2.5 hours on one idle core"),
        (144000.0, 2, "simulating takes about 20 hours on 2 idle cores"),
    ],
)
def test_the_length_is_shared_by_the_workers(seconds: float, workers: int, said: str) -> None:
    assert announce_work("simulating", seconds, workers=workers) == said


def test_what_is_kept_follows() -> None:
    assert announce_work("simulating", 0.0, kept="all is kept").endswith(
        "on one idle core; all is kept"
    )


GROUPS: dict[str, tuple[str, dict[str, str], int]] = {
    "no groups": ("", {}, 64),
    "no quota": ("0::/\n", {"cpu.max": "max 100000\n"}, 64),
    "a quota": ("0::/\n", {"cpu.max": "250000 100000\n"}, 2),
    "less than one": ("0::/\n", {"cpu.max": "50000 100000\n"}, 1),
    "of a service": (
        "0::/a/b\n",
        {"a/b/cpu.max": "max 100000\n", "a/cpu.max": "300000 100000\n"},
        3,
    ),
    "more than there are": ("0::/\n", {"cpu.max": "9900000 100000\n"}, 64),
    "of the first kind": (
        "4:memory:/x\n3:cpu,cpuacct:/x\n0::/\n",
        {
            "cpu,cpuacct/x/cpu.cfs_quota_us": "400000\n",
            "cpu,cpuacct/x/cpu.cfs_period_us": "100000\n",
        },
        4,
    ),
    "none, of the first kind": (
        "3:cpu,cpuacct:/\n",
        {"cpu,cpuacct/cpu.cfs_quota_us": "-1\n", "cpu,cpuacct/cpu.cfs_period_us": "100000\n"},
        64,
    ),
    "damaged": ("0::/\n", {"cpu.max": "\n"}, 64),
}
"""What the kernel states of a process on 64 processors (Linux, admin-guide/cgroup-v2, cgroup-v1) →
cores."""


@pytest.mark.parametrize("name", GROUPS)
def test_the_cores_are_those_that_the_process_may_use(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    groups, files, expected = GROUPS[name]
    for file, text in {"groups": groups, **files}.items():
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text(text)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(64)))
    monkeypatch.setattr(workload, "_GROUPS", tmp_path / "groups")
    monkeypatch.setattr(workload, "_MOUNT", tmp_path)
    assert cores() == expected


def test_one_thread_is_for_a_block() -> None:
    before = torch.get_num_threads()
    try:
        torch.set_num_threads(2)
        with one_thread():
            assert torch.get_num_threads() == 1
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(before)
