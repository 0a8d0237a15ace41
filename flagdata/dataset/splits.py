"""Splits without leaks, for rows that state no side: by simulation seed, recording session and day.

Two recordings that share a session, a day, a seed, a camera file or a mesh sequence are connected,
and what is connected, through however many recordings, stays on one side. (An anemometer log alone
does not connect: two clips an hour apart share no pixel and no minute of it.) A simulated recording
has no day: its start is a matter of convention. It should not be given a session either, unless all
that share one are meant to stay together.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from flagdata.core.arrays import IntArray
from flagdata.errors import RefusedError, UsageError
from flagdata.lake.matching import Where

DEFAULT_FRACTIONS: Mapping[str, float] = {"train": 0.7, "validation": 0.15, "test": 0.15}
_LISTED = 3  # leaks named in an error
_WHOLE = (
    "split by whole sessions, days and seeds, or use the hashed split, which keeps them together"
)


@dataclass(frozen=True, kw_only=True)
class Origin:
    """Where the clips of one recording come from; what connects it to others.

    Attributes:
        recording: artifact of the recording.
        session: one set-up at one place; `None` where none was named.
        days: calendar days (ISO, UTC) of its clips; left out of account when there is a seed.
        seed: root seed of a simulation; `None` for a real recording.
        sources: what else must stay together, in words: the camera files and mesh sequences it was
            made from, the objects that hold them and the film, and the sessions that they are of.
    """

    recording: str
    session: str | None = None
    days: tuple[str, ...] = ()
    seed: int | None = None
    sources: tuple[str, ...] = ()

    @property
    def ties(self) -> tuple[str, ...]:
        """What must not be on two sides, in words."""
        ties = [f"recording {self.recording}", *self.sources]
        if self.session:
            ties.append(f"session {self.session}")
        if self.seed is None:
            ties.extend(f"day {day}" for day in self.days)
        else:
            ties.append(f"seed {self.seed}")
        return tuple(ties)

    @property
    def key(self) -> tuple[int, str | int]:
        """Orders the recordings of a group; the least one names it: the earliest day, else the
        smallest seed."""
        if self.seed is not None:
            return (1, self.seed)
        return (0, min(self.days)) if self.days else (2, self.recording)


def groups(origins: Sequence[Origin]) -> IntArray:
    """Labels (n,) the connected group of each recording, from 0."""
    if not origins:
        return np.empty(0, dtype=np.int64)
    index: dict[str, int] = {}
    pairs = [
        (i, index.setdefault(tie, len(index)))
        for i, origin in enumerate(origins)
        for tie in origin.ties
    ]
    rows, columns = np.array(pairs, dtype=np.int64).T
    n = len(origins)
    size = n + len(index)
    graph = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns + n)), shape=(size, size))
    _, labels = connected_components(graph, directed=False)
    return np.unique(labels[:n], return_inverse=True)[1].astype(np.int64)


@dataclass(frozen=True, kw_only=True)
class HashedSplit:
    """Each group goes to a side by a hash of its name, so that a side is a matter of content, not
    of order or luck.

    A group is named by the earliest of its days, or the smallest of its seeds. Adding recordings of
    other days and seeds therefore moves nothing. What can move: the groups that a new recording
    joins together (all but the one that names the whole), and a group that a new recording extends
    to an earlier day or a smaller seed. The shares are those of groups in the long run; a handful
    of groups can be far from them.

    Attributes:
        fractions: side → share of the groups, adding up to 1.
        salt: another text gives another, equally lawful split.

    Raises:
        UsageError: shares that are negative or do not add up to 1.
    """

    fractions: Mapping[str, float] = field(default_factory=lambda: dict(DEFAULT_FRACTIONS))
    salt: str = ""

    def __post_init__(self) -> None:
        shares = list(self.fractions.values())
        if (
            not shares
            or not all(share >= 0 for share in shares)
            or not math.isclose(sum(shares), 1, abs_tol=1e-9)
        ):
            raise UsageError(
                f"split fractions {dict(self.fractions)}",
                fix="give shares of 0 or more that add up to 1",
            )

    @property
    def sides(self) -> tuple[str, ...]:
        return tuple(self.fractions)

    def assign(self, origins: Sequence[Origin]) -> list[str]:
        """Assigns each recording to a side."""
        labels = groups(origins).tolist()
        names: dict[int, tuple[int, str | int]] = {}
        for label, origin in zip(labels, origins, strict=True):
            names[label] = min(names.get(label, origin.key), origin.key)
        return [self._side(names[label]) for label in labels]

    def _side(self, key: tuple[int, str | int]) -> str:
        digest = hashlib.sha256(f"{self.salt}\x1f{key[0]}\x1f{key[1]}".encode()).digest()
        draw = int.from_bytes(digest[:8], "big") / 2**64
        below = 0.0
        for side, share in self.fractions.items():
            below += share
            if draw < below:
                return side
        return [side for side, share in self.fractions.items() if share > 0][-1]


@dataclass(frozen=True, kw_only=True)
class ExplicitSplit:
    """Sides chosen by the user, each by a filter over the catalog; refused where they leak.

    Attributes:
        where: side → what selects its clips: the values that columns must have, e.g. {"train":
            {"dataset": "flagsim-small", "side": "train"}, …}, or an SQL boolean expression over
            catalog columns, e.g. {"train": "day < '2026-06-01'", …}. Clips that no side takes are
            in none.

    Raises:
        UsageError: no side.
    """

    where: Mapping[str, Where]

    def __post_init__(self) -> None:
        if not self.where:
            raise UsageError(
                "the explicit split has no sides", fix="name at least one side and its filter"
            )

    @property
    def sides(self) -> tuple[str, ...]:
        return tuple(self.where)


def refuse_leaks(sides: Mapping[str, Iterable[Origin]], *, fix: str = _WHOLE) -> None:
    """Check that no two sides share a recording, session, day, seed, camera file or mesh sequence.

    Args:
        sides: side → origins of the clips that it takes (with the days of those clips only).
        fix: what the user can do about it.

    Raises:
        RefusedError: they do; it names what is shared, and by which sides.
    """
    holders: dict[str, list[str]] = {}
    for side, origins in sides.items():
        for tie in {tie for origin in origins for tie in origin.ties}:
            holders.setdefault(tie, []).append(side)
    leaks = sorted(tie for tie, names in holders.items() if len(names) > 1)
    if leaks:
        listed = "; ".join(
            f"{tie} is in {' and in '.join(holders[tie])}" for tie in leaks[:_LISTED]
        )
        further = f"; and {len(leaks) - _LISTED} more" if len(leaks) > _LISTED else ""
        raise RefusedError(
            f"the split leaks: {listed}{further}",
            fix=fix,
        )
