"""Calls that are alike, so that of thousands of calls each distinct one is tried and not each
repetition.

Two calls are alike where they are the same function on files of the same role, and what was
published last before them has the same role too. A file's role is its path without what differs
from run to run or from item to item: numbers, hashes and identities.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

PUBLISHING = ("link ", "linkat ", "rename ", "renameat ", "renameat2 ")
"""Calls that give a file or a folder its name."""
_IDENTITY = re.compile(r"[0-9a-f]{8,}(?:-[0-9a-f]+)*|[0-9]+")
_HASHED = re.compile(r"[0-9a-f]{2,}")


@dataclass(frozen=True, kw_only=True)
class Group:
    """Calls that are alike.

    Attributes:
        calls: their numbers, in their order.
        tried: the numbers of those that are made to fail.
    """

    calls: tuple[int, ...]
    tried: tuple[int, ...]


def role(call: str) -> str:
    """A call of a trace, function and path, with every number, hash and identity of the path as
    `*`."""
    function, _, path = call.partition(" ")
    parts = (
        "*" if _HASHED.fullmatch(part) else _IDENTITY.sub("*", part) for part in path.split("/")
    )
    return f"{function} {'/'.join(parts)}"


def kinds(trace: Sequence[str]) -> list[str]:
    """Of each call of a trace what it is: function and role, and what was published last before
    it."""
    found = []
    published = "nothing"
    for call in trace:
        found.append(f"{role(call)} after {published}")
        if call.startswith(PUBLISHING):
            published = role(call)
    return found


def grouped(trace: Sequence[str], *, every: int, last: int) -> dict[str, Group]:
    """The groups of a command's calls, by what they are, as of `kinds`.

    Args:
        trace: function and path of each call.
        every: of each group the first call, the last one and every so many are tried.
        last: number of the call that published last; all later ones are tried.
    """
    members: dict[str, list[int]] = {}
    for number, kind in enumerate(kinds(trace)):
        members.setdefault(kind, []).append(number)
    return {
        kind: Group(
            calls=tuple(calls),
            tried=tuple(
                n for k, n in enumerate(calls) if k % every == 0 or k == len(calls) - 1 or n > last
            ),
        )
        for kind, calls in members.items()
    }
