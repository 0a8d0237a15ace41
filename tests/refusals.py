"""Tables of what must be refused: one test a table, which lists every row that is not."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import Any


def unrefused(
    use: Callable[..., object],
    cases: Iterable[tuple[Any, ...]],
    error: type[Exception] | None = None,
    match: str = "",
    *,
    where: str = "",
) -> list[str]:
    """What is wrong with the cases, a line each; none where all are refused as they state.

    A case is the arguments of `use`, then the class of the error unless it is given for all, then,
    unless `match` is
    given for all, what its text matches: as many of these as the case has besides the arguments.
    `where` is what the place matches that the error of flagdata names; nothing where it names none.
    """
    wrong = []
    for case in cases:
        arguments, wanted, words = _parts(use, case, error, match)
        try:
            found = use(*arguments)
        except wanted as refusal:
            place = getattr(refusal, "where", None) or ""
            if not re.search(words, str(refusal)) or not re.search(where, place):
                wrong.append(
                    f"{arguments!r}: {str(refusal)!r} at {place!r} does not match {words!r} at "
                    f"{where!r}"
                )
        except Exception as other:  # noqa: BLE001 — it belongs in the list
            wrong.append(
                f"{arguments!r}: {type(other).__name__} instead of {wanted.__name__}: {other}"
            )
        else:
            wrong.append(f"{arguments!r}: not refused, but {found!r}")
    return wrong


def _parts(
    use: Callable[..., object], case: tuple[Any, ...], error: type[Exception] | None, match: str
) -> tuple[tuple[Any, ...], type[Exception], str]:
    count = use.__code__.co_argcount
    arguments, rest = case[:count], list(case[count:])
    wanted = error if error is not None else rest.pop(0)
    return arguments, wanted, rest.pop(0) if rest else match
