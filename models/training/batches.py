"""The order of training: batches of entries that depend on (data, seed, epoch) alone, with a cursor that is kept."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from flagdata.errors import CorruptError, RefusedError, UsageError
from flagdata.provenance import array_hash
from flagdata.rng import stream
from models.training.inputs import Prepared


@dataclass(frozen=True, kw_only=True, eq=False)
class Batch:
    """Attributes:
    inputs: (n, *shape) float32.
    entries: (n,) which.
    sequence: (n,) of the simulation.
    """

    inputs: Tensor
    entries: NDArray[np.int64]
    sequence: Tensor


@dataclass(kw_only=True)
class Batches:
    """Batches of one epoch after another, all of one size; what does not fill the last is in no batch of that epoch.

    Attributes:
        prepared: the entries.
        size: entries a batch, all ranks together.
        seed: of the orders.
        together: whether films of one simulation follow one another, so that a contrastive loss finds pairs.
        share: (rank, ranks); each takes its part of every batch.
        epoch, cursor: of the next batch.
    """

    prepared: Prepared
    size: int
    seed: int
    together: bool = False
    share: tuple[int, int] = (0, 1)
    epoch: int = 0
    cursor: int = 0
    _variants: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        if self.size % self.share[1]:
            raise UsageError(
                f"batches of {self.size} for {self.share[1]} processes", fix="choose a multiple of their number"
            )
        if len(self.prepared) < self.size:
            raise UsageError(
                f"{len(self.prepared)} films do not make a batch of {self.size}", fix="take a smaller batch"
            )
        self._variants = self.prepared.maps.shape[1]

    def __len__(self) -> int:
        """Batches of an epoch."""
        return len(self.prepared) // self.size

    def __iter__(self) -> Iterator[Batch]:
        """What is left of the epoch."""
        order, variant = self._order(self.epoch)
        part = self.size // self.share[1]
        while True:
            begin = self.cursor * self.size + self.share[0] * part
            entries = order[begin : begin + part]
            batch = Batch(
                inputs=self.prepared.batch(entries, variant[entries]),
                entries=entries,
                sequence=torch.from_numpy(self.prepared.sequence[entries]),
            )
            self.cursor += 1
            ended = self.cursor == len(self)
            if ended:
                self.epoch, self.cursor = self.epoch + 1, 0
            yield batch
            if ended:
                return

    def order_hash(self, epoch: int) -> str:
        """SHA-256 of the entries, their variants and their order in an epoch, in hexadecimal: equal for any share."""
        order, variant = self._order(epoch)
        content = {name: value for name, value in self.state().items() if name not in ("epoch", "cursor")}
        return array_hash(content, [order.astype("<i8"), variant[order].astype("<i8")])

    def _order(self, epoch: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Entries in the epoch's order, and which variant of each entry it takes."""
        rng = stream(self.seed, "batches", epoch)
        if self.together:
            sequences, place = np.unique(self.prepared.sequence, return_inverse=True)
            order = np.argsort(rng.permutation(len(sequences))[place], kind="stable")
        else:
            order = rng.permutation(len(self.prepared))
        start = stream(self.seed, "variants").integers(self._variants, size=len(self.prepared))
        return order, (start + epoch) % self._variants

    def state(self) -> dict[str, Any]:
        """All that determines the batches to come."""
        return {
            "fingerprint": self.prepared.fingerprint,
            "front_end": self.prepared.front_end.hash,
            "entries": len(self.prepared),
            "variants": self._variants,
            "size": self.size,
            "seed": self.seed,
            "together": self.together,
            "epoch": self.epoch,
            "cursor": self.cursor,
        }

    def take_up(self, state: Mapping[str, Any]) -> None:
        """Go to where `state` was taken.

        Raises:
            RefusedError: it is of other data or other batches.
            CorruptError: it names a batch that no epoch has.
        """
        own = self.state()
        different = [name for name in own if name not in ("epoch", "cursor") and state.get(name) != own[name]]
        if different:
            named = "; ".join(f"{name} was {state.get(name)!r}, is {own[name]!r}" for name in different)
            raise RefusedError(
                f"the checkpoint is of other batches: {named}",
                where="the training data",
                fix="train at the same tag with the same recipe, or begin anew in another folder",
            )
        epoch, cursor = state.get("epoch"), state.get("cursor")
        if not (isinstance(epoch, int) and epoch >= 0 and isinstance(cursor, int) and 0 <= cursor < len(self)):
            raise CorruptError(
                f"the checkpoint goes on at batch {cursor!r} of {len(self)} in epoch {epoch!r}",
                where="the training data",
                fix="delete the checkpoint and train again",
            )
        self.epoch, self.cursor = epoch, cursor
