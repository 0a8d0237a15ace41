"""What the processes that compute jobs find in their environment, and what becomes of their
results."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from distributed import CancelledError

from flagdata.errors import MissingExtraError
from sim.workers import LocalWorkers, Scheduled, WorkerError, connect_workers, scheduled
from tests.sim.workers.worked import environment, fatal, fatal_result, once

NAMES = ("OMP_NUM_THREADS", "MALLOC_TRIM_THRESHOLD_", "MALLOC_MMAP_THRESHOLD_")


def test_processes_keep_their_memory_take_one_thread_each_and_are_replaced_when_they_die(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MALLOC_TRIM_THRESHOLD_", raising=False)
    said: list[str] = []
    with connect_workers(None, workers=2, say=said.append) as workers:
        assert list(workers.results([(environment, [NAMES])])) == [["1", str(2**30), str(2**25), 1]]
        results = workers.results((once, [tmp_path / "note", number]) for number in range(6))
        assert sorted(results) == list(range(6))
        assert said == ["a process has died; its jobs are done again"]
        monkeypatch.setattr("sim.workers.local.TRIES", 2)
        with pytest.raises(WorkerError, match="died 2 times over the same jobs"):
            list(workers.results([(fatal, [0])]))
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "MALLOC_TRIM_THRESHOLD_" not in os.environ


def test_one_worker_is_this_process_whose_threads_are_as_many_afterwards() -> None:
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(2)
    try:
        with connect_workers(None, workers=1) as workers:
            assert list(workers.results([(os.getpid, []), (torch.get_num_threads, [])])) == [
                os.getpid(),
                1,
            ]
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(before)


def test_jobs_of_this_machine_need_no_dask(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("dask", "distributed", "sim.workers.scheduled"):
        monkeypatch.setitem(sys.modules, name, None)
    with connect_workers(None, workers=1) as workers:
        assert list(workers.results([(max, [(1, 2)])])) == [2]
    monkeypatch.delitem(sys.modules, "sim.workers.scheduled")
    with pytest.raises(MissingExtraError, match="the workers of a scheduler need distributed"):
        connect_workers("tcp://127.0.0.1:1", workers=1)


def test_an_error_of_a_job_is_that_of_the_iteration() -> None:
    with pytest.raises(ZeroDivisionError):
        list(LocalWorkers(1).results([(divmod, [1, 0])]))


@pytest.mark.timeout(120)
def test_a_worker_that_dies_over_sending_its_result_keeps_nobody_waiting(
    doomed: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sim.workers.scheduled.PATIENCE", 2.0)
    said: list[str] = []
    with connect_workers(doomed.address, workers=1, say=said.append) as workers:
        assert list(workers.results([(max, [1, 2])])) == [2]
        with pytest.raises(WorkerError, match="no workers for 2 s"):
            list(workers.results([(fatal_result, [])]))
    assert said == ["all workers are gone; waiting 2 s for new ones"]


def test_what_dask_gives_for_a_job_that_was_lost_with_the_scheduler_is_no_result(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    client: Any = SimpleNamespace(
        status="running", nthreads=lambda: {"a": 1}, submit=lambda *_, **__: None, loop=None
    )
    running = SimpleNamespace(
        count=lambda: 0, add=print, is_empty=lambda: False, clear=lambda: None
    )
    monkeypatch.setattr(scheduled, "as_completed", lambda **_: running)
    monkeypatch.setattr(
        Scheduled, "_next", lambda *_: (SimpleNamespace(release=print), CancelledError("a job"))
    )
    with pytest.raises(WorkerError, match="the scheduler is gone"):
        next(Scheduled(client, say=print).results([(sum, [[1]])]))
