"""Batches in an order that depends on (data, seed, epoch) alone, with a cursor that can be saved
and restored."""

from __future__ import annotations

import hashlib
import re
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from typing import Literal, TypeAlias

import numpy as np
import torch
from torch.utils.data import DataLoader, Dataset

from flagdata.core.arguments import check_arguments, whole
from flagdata.core.arrays import IntArray
from flagdata.core.rng import stream
from flagdata.dataset.sample import Batch, Sample, collate
from flagdata.errors import RefusedError, UsageError

Order: TypeAlias = Literal["shuffled", "stored"]
Last: TypeAlias = Literal["keep", "drop"]
Memory: TypeAlias = Literal["pageable", "pinned"]
RunIn: TypeAlias = Literal["threads", "fork", "spawn", "forkserver"]
State: TypeAlias = dict[str, str | int | None]

_AHEAD = 2  # batches that each thread reads ahead, as many as torch's worker processes do
_MOVING = (
    "epoch",
    "before",
    "cursor",
    "share",
    "at",
)  # parts of a state that may differ from the loader that goes on
_SHARE = re.compile(r"([0-9]{1,9}) of ([1-9][0-9]{0,8})")


class Batchable(Dataset[Sample], ABC):
    """A map-style dataset that a `PairLoader` reads.

    Attributes:
        at: the ref its query was resolved at, as it was given.
        seed: of the shuffled orders.
        fingerprint: hash of its samples, in order; equal means the same data.
    """

    at: str | None
    seed: int
    fingerprint: str

    @abstractmethod
    def __len__(self) -> int:
        """Counts the samples."""


class PairLoader:
    """Iterates over the batches of one epoch; a new iteration after the end begins the next epoch.

    The order of an epoch depends on the pairs, the seed and the epoch's number, never on the number
    of workers or shares; `order_hash` is a hash of it. An iteration that was left early is taken up
    where it stopped, in this process
    or, through `state_dict`, in others: with as many shares each goes on with its own batches; with
    another number they divide anew what the epoch has left, once all shares had handed out equally
    many.

    Args:
        pairs: the dataset.
        batch_size: pairs a batch.
        workers: threads or processes that read and decode ahead; 0 reads when a batch is asked for.
        run_in: what the workers are. "threads" share memory with the caller, so a batch costs no
            copy between processes; reading and JPEG decoding leave Python's lock. Processes,
            started by "fork", "spawn" or "forkserver", are for callers that hold that lock
            themselves most of the time.
        order: "shuffled" anew each epoch, or as "stored": by recording and frame.
        last: whether to "keep" or "drop" the last batch when it is not full.
        memory: "pinned" copies batches to page-locked memory for transfer to an accelerator.
        share: (index, count) of this process among those that train together; each takes every
            `count`-th batch of one common order, all equally many, so that up to `count` - 1
            batches of an epoch are in no share.

    Attributes:
        epoch: number of the epoch that the next batch belongs to, from 0.
        cursor: batches of it that were handed out by this share.

    Raises:
        UsageError: sizes that cannot be, an unknown option, or pinned memory where there is no
            accelerator.
    """

    @check_arguments
    def __init__(
        self,
        pairs: Batchable,
        *,
        batch_size: int,
        workers: int = 0,
        run_in: RunIn = "threads",
        order: Order = "shuffled",
        last: Last = "keep",
        memory: Memory = "pageable",
        share: tuple[int, int] = (0, 1),
    ) -> None:
        if batch_size < 1 or workers < 0:
            raise UsageError(
                f"batches of {batch_size} with {workers} workers", fix="give at least 1 and 0"
            )
        if not 0 <= share[0] < share[1]:
            raise UsageError(
                f"there is no share {share[0]} of {share[1]}",
                fix="give (index, count) with 0 <= index < count",
            )
        for option, value, choices in (
            ("order", order, ("shuffled", "stored")),
            ("last", last, ("keep", "drop")),
            ("memory", memory, ("pageable", "pinned")),
            ("run_in", run_in, ("threads", "fork", "spawn", "forkserver")),
        ):
            if value not in choices:
                raise UsageError(
                    f"{option} cannot be {value!r}", fix=f"give {' or '.join(map(repr, choices))}"
                )
        if memory == "pinned" and not torch.accelerator.is_available():
            raise UsageError(
                "pinned memory without an accelerator", fix="leave memory at 'pageable'"
            )
        self.pairs = pairs
        self.epoch = 0
        self.cursor = 0
        self._before = 0  # batches of this epoch that another number of shares handed out
        self._batch_size = batch_size
        self._order: Order = order
        self._last: Last = last
        self._share = share
        if not len(self):
            raise UsageError(
                f"{len(pairs)} pairs do not make a batch of {batch_size} for each of {share[1]} "
                "shares",
                fix="give a smaller batch, fewer shares, or last='keep'",
            )
        self._memory: Memory = memory
        self._threads = workers if run_in == "threads" else 0
        self._todo = _Todo()
        self._iteration = 0
        self._processes: DataLoader[Sample] | None = None
        if workers and run_in != "threads":
            self._processes = DataLoader(
                pairs,
                batch_sampler=self._todo,
                num_workers=workers,
                collate_fn=collate,
                pin_memory=memory == "pinned",
                persistent_workers=True,
                multiprocessing_context=run_in,
                # its own, so that loading draws nothing from the global stream
                generator=torch.Generator(),
            )

    def __len__(self) -> int:
        """Batches of this share in a whole epoch."""
        return self._total() // self._share[1]

    def _total(self) -> int:
        """Counts batches of all shares in a whole epoch."""
        full_batches, rest = divmod(len(self.pairs), self._batch_size)
        return full_batches + (rest > 0 and self._last == "keep")

    @check_arguments
    def batches(self, epoch: int) -> list[list[int]]:
        """Indices of the pairs in each batch of this share in a whole epoch, in order."""
        return self._from(epoch, 0)

    def _from(self, epoch: int, first: int) -> list[list[int]]:
        """Batches of this share in an epoch of which all shares together handed out `first`
        before."""
        size, order = self._batch_size, self._order_of_epoch(epoch)
        index, count = self._share
        end = first + (self._total() - first) // count * count
        return [order[k * size : (k + 1) * size].tolist() for k in range(first + index, end, count)]

    def _order_of_epoch(self, epoch: int) -> IntArray:
        n = len(self.pairs)
        if self._order == "stored":
            return np.arange(n)
        return stream(self.pairs.seed, "pairs", "order", epoch).permutation(n)

    @check_arguments
    def order_hash(self, epoch: int) -> str:
        """Computes the SHA-256 of the samples and their order in an epoch, in hexadecimal: equal
        for any workers and shares."""
        order = self._order_of_epoch(epoch).astype("<i8").tobytes()
        return hashlib.sha256(
            f"{self.pairs.fingerprint} {self._batch_size} {self._last}\n".encode() + order
        ).hexdigest()

    def __iter__(self) -> Iterator[Batch]:
        """Yields the batches of the epoch that are left.

        Raises:
            UsageError: while stepping, when another iteration of this loader has begun since.
        """
        self._iteration += 1
        return self._run(self._iteration)

    def _run(self, iteration: int) -> Iterator[Batch]:
        batches = self._from(self.epoch, self._before)
        self._todo.batches = batches[self.cursor :]
        if not self._todo.batches:  # what was left is less than a batch for each share
            self.epoch, self.cursor, self._before = self.epoch + 1, 0, 0
            return
        for batch in self._in_this_process() if self._processes is None else self._processes:
            if iteration != self._iteration:
                raise UsageError(
                    "another iteration of this loader has begun",
                    fix="use one loader for each iteration",
                )
            self.cursor += 1
            if self.cursor == len(batches):
                self.epoch, self.cursor, self._before = self.epoch + 1, 0, 0
            yield batch

    def _in_this_process(self) -> Iterator[Batch]:
        todo = iter(self._todo)
        if not self._threads:
            yield from map(self._batch, todo)
            return
        pool = ThreadPoolExecutor(self._threads, thread_name_prefix="pairs")
        try:
            ahead = deque(
                pool.submit(self._batch, batch) for batch in islice(todo, _AHEAD * self._threads)
            )
            while ahead:
                batch = ahead.popleft().result()
                ahead.extend(pool.submit(self._batch, indices) for indices in islice(todo, 1))
                yield batch
        finally:
            pool.shutdown(wait=True, cancel_futures=True)

    def _batch(self, indices: list[int]) -> Batch:
        batch = collate([self.pairs[index] for index in indices])
        return batch.pin_memory() if self._memory == "pinned" else batch

    def state_dict(self) -> State:
        """Returns everything that determines the batches still to come; put it into the checkpoint
        beside the model."""
        return {
            "at": self.pairs.at,
            "fingerprint": self.pairs.fingerprint,
            "seed": whole(self.pairs.seed, "seed"),
            "batch_size": self._batch_size,
            "order": self._order,
            "last": self._last,
            "share": f"{self._share[0]} of {self._share[1]}",
            "epoch": whole(self.epoch, "epoch"),
            "before": self._before,
            "cursor": self.cursor,
        }

    def load_state_dict(self, state: Mapping[str, str | int | None]) -> None:
        """Goes to where `state` was taken: the next iteration gives the same batches, bit for bit.
        Taken with another number of shares, it is that of any of them after equally many batches.

        Raises:
            RefusedError: it was taken of other data, another seed, or other batches.
            UsageError: it is not a state of a loader.
        """
        present_state = self.state_dict()
        state = {"before": 0, **state}  # which states of older versions lack
        share = _SHARE.fullmatch(str(state.get("share")))
        if set(state) != set(present_state) or share is None:
            raise UsageError(
                "this is not a state of a loader of pairs", fix="give what state_dict returned"
            )
        different = [
            name
            for name in present_state
            if name not in _MOVING and state[name] != present_state[name]
        ]
        if different:
            differences = "; ".join(
                f"{name} was {state[name]!r}, is {present_state[name]!r}" for name in different
            )
            raise RefusedError(
                f"the saved state belongs to other batches: {differences}",
                where=f"data at {state['at'] or 'the head of main'}",
                fix="resolve the query at the same tag, with the same options",
            )
        numbers = [
            whole(state[name], f"{name} of the state") for name in ("epoch", "before", "cursor")
        ]
        count, total = int(share[2]), self._total()
        if min(numbers) < 0 or numbers[1] + numbers[2] * count >= total:
            raise UsageError(
                f"there is no batch {state['cursor']!r} in epoch {state['epoch']!r}",
                fix="give what state_dict returned",
            )
        epoch, before, cursor = numbers
        self._iteration += 1
        self.epoch = epoch
        same = count == self._share[1]
        self._before, self.cursor = (before, cursor) if same else (before + cursor * count, 0)


class _Todo:
    """The batch sampler that the `DataLoader` asks for the lists of indices left in the epoch.

    It does not know its loader: a reference cycle would leave the end of the workers to the garbage
    collector, which takes their queues apart first, and each worker then costs five seconds.
    """

    def __init__(self) -> None:
        self.batches: list[list[int]] = []

    def __iter__(self) -> Iterator[list[int]]:
        return iter(self.batches)

    def __len__(self) -> int:
        return len(self.batches)
