"""A pool of processes that starts none: what is submitted is done at once, by this process."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any


class Here:
    """In the place of a `ProcessPoolExecutor` where a test is of what is computed; a start costs
    seconds of imports."""

    def __init__(self, *_: object, **__: object) -> None:
        pass

    def __enter__(self) -> Here:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def submit(self, call: Callable[..., Any], *given: object) -> Future[Any]:
        done: Future[Any] = Future()
        try:
            done.set_result(call(*given))
        except BaseException as error:  # noqa: BLE001  as the pool hands it on
            done.set_exception(error)
        return done
