"""The torch dataset of pairs: resolved once in the parent, read by workers from files alone."""

from __future__ import annotations

from collections import OrderedDict
from pathlib import Path
from typing import Any

import torch
from torch.utils.data import Dataset

from flagdata.dataset.cache import DecodedCache
from flagdata.dataset.loader import Last, Memory, Order, PairLoader
from flagdata.dataset.sample import Sample
from flagdata.dataset.table import PairTable
from flagdata.dataset.tolerance import Refusal
from flagdata.record import Record

OPEN_RECORDS = 256  # record files a process keeps open


class Pairs(Dataset[Sample]):
    """Pairs of a query, a map-style dataset. Made by `Source.pairs`.

    Workers, forked or spawned, get flat arrays and paths; they never touch the catalog. Each opens a record when it
    first needs it.

    Attributes:
        table: the pairs' numbers, as arrays.
        refused: the pairs outside the tolerance, each with its reasons.
        at: the ref the query was resolved at, as it was given.
        seed: of the shuffled orders.
        fingerprint: hash of the pairs and their ground truth, in order; equal means the same data.
    """

    def __init__(
        self,
        table: PairTable,
        *,
        paths: tuple[Path, ...],
        refused: tuple[Refusal, ...],
        at: str | None,
        seed: int,
        cache: DecodedCache | None,
    ) -> None:
        self.table = table
        self.refused = refused
        self.at = at
        self.seed = seed
        self.fingerprint = table.fingerprint()
        self._paths = paths
        self._cache = cache
        self._records: OrderedDict[int, Record] = OrderedDict()

    def __len__(self) -> int:
        return len(self.table)

    def __getitem__(self, index: int) -> Sample:
        """The pair at `index`, 0 ≤ index < len.

        Raises:
            IndexError: beyond the last pair.
            CorruptError: its frames cannot be read.
        """
        if not 0 <= index < len(self.table):
            raise IndexError(f"pair {index} of {len(self.table)}")
        table = self.table
        return Sample(
            clip=self._clip(index),
            wind=float(table.wind[index]),
            wind_sigma=float(table.wind_sigma[index]),
            staleness=float(table.staleness[index]),
            coverage=float(table.coverage[index]),
            clock_sigma=float(table.clock_sigma[index]),
            parameters=table.parameters_of(index),
            artifact=str(table.artifact[index]),
            recording=str(table.recording[index]),
            session=str(table.session[index]),
            day=str(table.day[index]),
            seed=int(table.seed[index]) if table.seeded[index] else None,
            start=int(table.start[index]),
            end=int(table.end[index]),
        )

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_records": OrderedDict()}

    def __repr__(self) -> str:
        at = self.at or "the head of main"
        return f"Pairs({len(self)} pairs at {at}, {len(self.refused)} refused, fingerprint {self.fingerprint[:12]})"

    def loader(
        self,
        batch_size: int,
        *,
        workers: int = 0,
        order: Order = "shuffled",
        last: Last = "keep",
        memory: Memory = "pageable",
        start_method: str | None = None,
    ) -> PairLoader:
        """Batches in a deterministic order that can be saved and taken up again; see `PairLoader`."""
        return PairLoader(
            self,
            batch_size=batch_size,
            workers=workers,
            order=order,
            last=last,
            memory=memory,
            start_method=start_method,
        )

    def _clip(self, index: int) -> torch.Tensor:
        number = int(self.table.object[index])
        first, count = int(self.table.frame_first[index]), int(self.table.frame_count[index])

        def decode() -> Any:
            return self._record(number).frames(first, count)

        if self._cache is None:
            frames = decode()
        else:
            frames = self._cache.frames(str(self.table.objects[number]), first, count, decode=decode)
        return torch.from_numpy(frames).unsqueeze(0)

    def _record(self, number: int) -> Record:
        record = self._records.get(number)
        if record is None:
            record = self._records[number] = Record.open(self._paths[number])
            if len(self._records) > OPEN_RECORDS:
                self._records.popitem(last=False)
        else:
            self._records.move_to_end(number)
        return record
