"""A part of a data set that one of several builds makes, each on a branch of its own."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

from flagdata.errors import UsageError
from sim.datasets.cast import Roll

_WRITTEN = re.compile(r"(\d{1,6})/(\d{1,6})")


@dataclass(frozen=True, kw_only=True)
class Shard:
    """The sequences, with their films, that one of `of` builds makes: those simulated together stay
    together, and so do those of their cast that take the place of any that fail.

    Attributes:
        number: which build, from 1.
        of: how many builds there are.
    """

    number: int
    of: int

    @classmethod
    def parse(cls, text: str) -> Self:
        """Reads a shard as a user writes it, "2/8".

        Raises:
            UsageError: it is none.
        """
        match = _WRITTEN.fullmatch(text.strip())
        number, of = (int(match[1]), int(match[2])) if match else (0, 0)
        if not 1 <= number <= of:
            raise UsageError(
                f"{text!r} is no shard",
                where="--shard",
                fix="give its number and how many there are: 1/4",
            )
        return cls(number=number, of=of)

    def sequences(self, rolls: Iterable[Roll]) -> frozenset[str]:
        """Returns the identities of the sequences that it makes."""
        shard: set[str] = set()
        before = 0
        for roll in rolls:
            count, batch = roll.cast.simulation.count, roll.cast.simulation.batch
            batches = {index: min(index, count - 1) // batch for index in roll.candidates}
            shard |= {
                roll.id(i)
                for i, number in batches.items()
                if (before + number) % self.of == self.number - 1
            }
            before += math.ceil(count / batch)
        return frozenset(shard)
