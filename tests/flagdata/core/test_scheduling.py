"""What raises the priority of threads is undone."""

from __future__ import annotations

import os
import threading

import pytest

from flagdata.core.scheduling import kept_scheduling


def policies(*threads: threading.Thread) -> set[int]:
    """Return the policies of the calling thread and of ``threads``; those of other tests may have
    ended."""
    return {os.sched_getscheduler(0)} | {
        os.sched_getscheduler(thread.native_id or 0) for thread in threads
    }


def test_threads_that_were_begun_with_real_time_priority_and_the_one_that_began_them_lose_it() -> (
    None
):
    before, done = policies(), threading.Event()
    assert before == {os.SCHED_OTHER}
    thread = threading.Thread(target=done.wait)
    try:
        with kept_scheduling():
            try:
                os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
            except PermissionError:
                pytest.skip("only a privileged process may take real-time priority")
            thread.start()
            assert policies(thread) == {os.SCHED_FIFO}
        assert policies(thread) == before
    finally:
        done.set()
    thread.join()


def test_it_is_undone_after_an_error_too() -> None:
    @kept_scheduling()
    def failing() -> None:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
        except PermissionError:
            pytest.skip("only a privileged process may take real-time priority")
        raise KeyError

    with pytest.raises(KeyError):
        failing()
    assert policies() == {os.SCHED_OTHER}
