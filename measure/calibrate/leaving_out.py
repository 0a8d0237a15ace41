"""Several recordings of one flag, of which those that cannot be used are left out and named."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from flagdata.errors import InputError, RefusedError
from flagdata.findings import Finding, Severity

S = TypeVar("S")
T = TypeVar("T")
LEFT_OUT = "left-out"
"""Kind of the finding that names one."""


def usable(
    recordings: Sequence[S], use: Callable[[S], T], *, name: Callable[[S], str]
) -> tuple[list[T], tuple[Finding, ...]]:
    """What those recordings come to that can be used, and a warning for each that cannot. Errors of a kind that is not
    the recording's, such as a name that nothing has, are raised.

    Args:
        use: raises InputError or RefusedError where a recording cannot be used.
        name: by which a person knows it.

    Raises:
        InputError, RefusedError: the error of a single recording.
        RefusedError: none of several can be used.
    """
    found: list[T] = []
    failed: list[tuple[str, InputError | RefusedError]] = []
    for one in recordings:
        try:
            found.append(use(one))
        except (InputError, RefusedError) as error:
            if len(recordings) == 1:
                raise
            failed.append((name(one), error))
    if failed and not found:
        reasons = "; ".join(f"{who}: {error.what}" for who, error in failed)
        raise RefusedError(
            f"none of {len(failed)} recordings can be used: {reasons}",
            where=", ".join(who for who, _ in failed),
            fix="; ".join(dict.fromkeys(error.fix for _, error in failed)),
        )
    return found, tuple(
        Finding(kind=LEFT_OUT, severity=Severity.WARNING, what=f"{who} is left out: {error.what}", fix=error.fix)
        for who, error in failed
    )
