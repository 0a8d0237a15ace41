"""The torch dataset of pairs: resolved once in the parent, read by workers from files alone."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Mapping
from typing import Any

import torch

from flagdata.core.arguments import check_arguments
from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.core.html import table
from flagdata.core.printable import SHORT
from flagdata.dataset.cache import DecodedCache
from flagdata.dataset.loader import Batchable, Last, Memory, Order, PairLoader, RunIn
from flagdata.dataset.pair_table import PairTable
from flagdata.dataset.sample import Sample
from flagdata.dataset.tolerance import Refusal
from flagdata.record import Record
from flagdata.storage import Place
from flagdata.timebase import NANOSECONDS

_SHOWN = 5
OPEN_RECORDS = 64  # record files that a thread keeps open


class _OpenRecords(threading.local):
    """The records that this thread has open, the least recently used first; each thread has its
    own."""

    def __init__(self) -> None:
        self.records: OrderedDict[int, Record] = OrderedDict()


class Pairs(Batchable):
    """Pairs of a query, a map-style dataset. Made by `Source.pairs`.

    Workers, forked or spawned, get flat arrays and paths; they never touch the catalog. Each opens
    a record when it first needs it; of a lake in a bucket it fetches what is needed then, which
    forked workers cannot. A `torch.utils.data.DataLoader` of your own gives batches as `loader`
    does, in an order of its own.

    Attributes:
        table: the pairs' numbers, as arrays.
        refused: the pairs outside the tolerance, each with its reasons.
        split: side that all pairs are on; `None` where none was asked for.
        split_by: the rule by which sides were decided, and their sizes, as JSON; `None` where no
            side was asked for.
        at: the ref the query was resolved at, as it was given.
        seed: of the shuffled orders.
        fingerprint: hash of the pairs and their ground truth, in order; equal means the same data.
    """

    def __init__(
        self,
        table: PairTable,
        *,
        openers: tuple[Callable[[], Place], ...],
        refused: tuple[Refusal, ...],
        at: str | None,
        seed: int,
        cache: DecodedCache | None,
        split: str | None,
        split_by: Mapping[str, Any] | None,
    ) -> None:
        self.table = table
        self.refused = refused
        self.split = split
        self.split_by = split_by
        self.at = at
        self.seed = seed
        self.fingerprint = table.fingerprint()
        self._openers = openers
        self._cache = cache
        self._open = _OpenRecords()

    def __len__(self) -> int:
        return len(self.table)

    @check_arguments
    def __getitem__(self, index: int) -> Sample:
        """Reads the pair at `index`, 0 ≤ index < len.

        Raises:
            IndexError: beyond the last pair.
            CorruptError: its frames cannot be read.
        """
        if not 0 <= index < len(self.table):
            raise IndexError(f"there is no pair {index} among {len(self.table)}")
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

    @check_arguments
    def film(self, index: int) -> UInt8Array:
        """Reads all frames of the recording that the pair at `index` is of: (frames, height, width)
        gray.

        Raises:
            IndexError: beyond the last pair.
            CorruptError: its frames cannot be read.
        """
        if not 0 <= index < len(self.table):
            raise IndexError(f"there is no pair {index} among {len(self.table)}")
        record = self._record(int(self.table.object[index]))
        return record.frames(0, record.frame_count)

    @check_arguments
    def film_times(self, index: int) -> FloatArray:
        """Reads (frames,) instants of the frames of `film`, from the first [s].

        Raises:
            IndexError: beyond the last pair.
        """
        if not 0 <= index < len(self.table):
            raise IndexError(f"there is no pair {index} among {len(self.table)}")
        times = self._record(int(self.table.object[index])).frame_times
        return (times - times[0]) / NANOSECONDS

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_open"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._open = _OpenRecords()

    def __repr__(self) -> str:
        at = self.at or "the head of main"
        return (
            f"Pairs({len(self)} pairs at {at}, {len(self.refused)} refused, fingerprint "
            f"{self.fingerprint[:12]})"
        )

    def _repr_html_(self) -> str:
        refused = {
            f"refused {refusal.artifact[:SHORT]}": "; ".join(refusal.reasons)
            for refusal in self.refused[:_SHOWN]
        }
        wind = self.table.wind
        rows = {
            "version": self.at or "the head of main",
            "wind": f"{wind.min():.2f} to {wind.max():.2f} m/s",
        }
        return table(f"{len(self)} pairs, {len(self.refused)} refused", rows | refused)

    @check_arguments
    def loader(
        self,
        batch_size: int,
        *,
        workers: int = 0,
        run_in: RunIn = "threads",
        order: Order = "shuffled",
        last: Last = "keep",
        memory: Memory = "pageable",
        share: tuple[int, int] = (0, 1),
    ) -> PairLoader:
        """Batches in a deterministic order that can be saved and taken up again; see
        `PairLoader`."""
        return PairLoader(
            self,
            batch_size=batch_size,
            workers=workers,
            run_in=run_in,
            order=order,
            last=last,
            memory=memory,
            share=share,
        )

    def _clip(self, index: int) -> torch.Tensor:
        number = int(self.table.object[index])
        first, count = int(self.table.frame_first[index]), int(self.table.frame_count[index])

        def decode() -> Any:
            return self._record(number).frames(first, count)

        if self._cache is None:
            frames = decode()
        else:
            frames = self._cache.frames(
                str(self.table.objects[number]), first, count, decode=decode
            )
        return torch.from_numpy(frames).unsqueeze(0)

    def _record(self, number: int) -> Record:
        records = self._open.records
        record = records.get(number)
        if record is None:
            record = records[number] = Record.open(self._openers[number]())
            if len(records) > OPEN_RECORDS:
                records.popitem(last=False)
        else:
            records.move_to_end(number)
        return record
