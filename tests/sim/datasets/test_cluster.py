"""What the processes that build a data set find in their environment, and what becomes of their results."""

from __future__ import annotations

import os
import signal
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from distributed import CancelledError

from sim.datasets import cluster
from sim.datasets.cluster import WorkerError, connected, results


def test_workers_keep_their_memory_and_take_one_thread_each(monkeypatch: pytest.MonkeyPatch) -> None:
    # Dask itself would set the second to 65,536 B.
    names = ("OMP_NUM_THREADS", "MALLOC_TRIM_THRESHOLD_", "MALLOC_MMAP_THRESHOLD_")
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MALLOC_TRIM_THRESHOLD_", raising=False)
    with connected(None, workers=1) as client:
        (found,) = client.run(lambda: [os.environ.get(name) for name in names]).values()
    assert found == ["1", str(2**30), str(2**25)]
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "MALLOC_TRIM_THRESHOLD_" not in os.environ


@pytest.mark.filterwarnings("error")
def test_a_job_may_carry_a_long_mesh_sequence_without_a_word_of_dask() -> None:
    positions = np.zeros(3_000_000)  # 24 MB; Dask warns from 10 MiB on
    with connected(None, workers=1) as client:
        assert list(results(client, [(np.sum, [positions])], say=lambda _: None)) == [0.0]


class _Fatal:
    """A result whose worker dies over sending it."""

    def __reduce__(self) -> tuple[type, tuple[()]]:
        os.kill(os.getpid(), signal.SIGKILL)
        return _Fatal, ()


def _fatal() -> _Fatal:
    return _Fatal()


@pytest.mark.timeout(120)
def test_a_worker_that_dies_over_sending_its_result_keeps_nobody_waiting(
    doomed: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sim.datasets.cluster.PATIENCE", 2.0)
    said: list[str] = []
    with connected(doomed.address, workers=1) as client, pytest.raises(WorkerError, match="no workers for 2 s"):
        list(results(client, [(_fatal, [])], say=said.append))
    assert said == ["all workers are gone; waiting 2 s for new ones"]


def test_what_dask_gives_for_a_job_that_was_lost_with_the_scheduler_is_no_result(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    client: Any = SimpleNamespace(status="running", nthreads=lambda: {"a": 1}, submit=lambda *_, **__: None, loop=None)
    running = SimpleNamespace(count=lambda: 0, add=print, is_empty=lambda: False, clear=lambda: None)
    monkeypatch.setattr(cluster, "as_completed", lambda **_: running)
    monkeypatch.setattr(cluster, "_next", lambda *_: (SimpleNamespace(release=print), CancelledError("a job")))
    with pytest.raises(WorkerError, match="the scheduler is gone"):
        next(results(client, [(sum, [[1]])], say=print))
