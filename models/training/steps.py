"""The steps of a training: forward, backward, Adam, one batch after another, until the validation
loss has settled.

What a step does depends on the recipe, the data and the step's number alone, so that a training
that was killed and taken up from its checkpoint reaches the same weights as one that ran through
(on one kind of machine, with as many threads). With several processes (`torchrun`) each takes its
part of every batch, and gradients are averaged by `DistributedDataParallel`; the mean over all
parts is that of the whole batch.

The order of training: batches of entries that depend on (data, seed, epoch) alone, with a cursor
that is kept.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import torch
from torch import Tensor, nn
from torch import distributed as ranks
from torch.nn.parallel import DistributedDataParallel

from flagdata.core.arrays import IntArray
from flagdata.core.provenance import array_hash
from flagdata.core.rng import stream, torch_draws
from flagdata.errors import CorruptError, ErrorKind, FlagdataError, RefusedError, UsageError
from models.networks.learner import Learner, Loss
from models.training import checkpoint
from models.training.checkpoint import Standing
from models.training.inputs import Prepared
from models.training.progress import Epoch, LossCourse
from models.training.training_recipe import (
    LEAST_BATCH,
    OptimiserSpec,
    Precision,
    Schedule,
    TrainingRecipe,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class TrainingBatch:
    """Attributes:
    inputs: (n, *shape) float32.
    entries: (n,) which.
    sequence: (n,) of the simulation.
    """

    inputs: Tensor
    entries: IntArray
    sequence: Tensor


@dataclass(kw_only=True)
class Batches:
    """Batches of one epoch after another, all of one size; what does not fill the last is in no
    batch of that epoch.

    Attributes:
        prepared: the entries.
        size: entries a batch, all ranks together.
        seed: of the orders.
        together: whether films of one simulation follow one another, so that a contrastive loss
            finds pairs.
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
        check_batch(len(self.prepared), self.size, ranks=self.share[1])
        self._variants = self.prepared.maps.shape[1]

    def __len__(self) -> int:
        """Batches of an epoch."""
        return len(self.prepared) // self.size

    def __iter__(self) -> Iterator[TrainingBatch]:
        """Yields what is left of the epoch."""
        order, variant = self._order(self.epoch)
        part = self.size // self.share[1]
        while True:
            begin = self.cursor * self.size + self.share[0] * part
            entries = order[begin : begin + part]
            batch = TrainingBatch(
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
        """Hashes the entries, their variants and their order in an epoch, SHA-256 in hexadecimal:
        equal for any share."""
        order, variant = self._order(epoch)
        content = {
            name: value for name, value in self.state().items() if name not in ("epoch", "cursor")
        }
        return array_hash(content, [order.astype("<i8"), variant[order].astype("<i8")])

    def _order(self, epoch: int) -> tuple[IntArray, IntArray]:
        """Returns entries in the epoch's order, and which variant of each entry it takes."""
        rng = stream(self.seed, "batches", epoch)
        if self.together:
            sequences, simulation = np.unique(self.prepared.sequence, return_inverse=True)
            order = np.argsort(rng.permutation(len(sequences))[simulation], kind="stable")
        else:
            order = rng.permutation(len(self.prepared))
        start = stream(self.seed, "variants").integers(self._variants, size=len(self.prepared))
        return order, (start + epoch) % self._variants

    def state(self) -> dict[str, Any]:
        """Returns all that determines the batches to come."""
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
        """Goes to where `state` was taken.

        Raises:
            RefusedError: it is of other data or other batches.
            CorruptError: it names a batch that no epoch has.
        """
        current = self.state()
        different = [
            name
            for name in current
            if name not in ("epoch", "cursor") and state.get(name) != current[name]
        ]
        if different:
            changes = "; ".join(
                f"{name} was {state.get(name)!r}, is {current[name]!r}" for name in different
            )
            raise RefusedError(
                f"the checkpoint is of other batches: {changes}",
                where="the training data",
                fix="train at the same tag with the same recipe, or begin anew in another folder",
            )
        epoch, cursor = state.get("epoch"), state.get("cursor")
        if not (
            isinstance(epoch, int)
            and epoch >= 0
            and isinstance(cursor, int)
            and 0 <= cursor < len(self)
        ):
            raise CorruptError(
                f"the checkpoint goes on at batch {cursor!r} of {len(self)} in epoch {epoch!r}",
                where="the training data",
                fix="delete the checkpoint and train again",
            )
        self.epoch, self.cursor = epoch, cursor


def check_batch(films: int, size: int, *, ranks: int = 1) -> None:
    """Checks that so many films make batches of this size, which so many processes share.

    Raises:
        UsageError: they do not.
    """
    if size % ranks:
        raise UsageError(
            f"batches of {size} cannot be shared by {ranks} processes",
            where="[optimiser] batch",
            fix="choose a multiple of their number",
        )
    if films < size:
        raise UsageError(
            f"{films} films do not make a batch of {size}",
            where="[optimiser] batch",
            fix=f"write batch = {films} in [optimiser], or less"
            if films >= LEAST_BATCH
            else f"learn from {LEAST_BATCH} films or more",
        )


_TRIED = 2  # steps before the first, of which the second is timed
CHECKPOINT_SECONDS = 60.0
"""A checkpoint is written after this time, and at the end of each epoch."""
_WARM_UP = 0.05  # of all steps, of the cosine schedule
_LEAST = 0.05  # of the rate, where it begins
_FINAL = 0.002  # of the rate, where it ends
_EVALUATED = 64  # clips at a time

Bars: TypeAlias = Callable[[int, str, str], AbstractContextManager[Callable[[int], None]]]


class TrainingDivergedError(FlagdataError):
    """The loss is no longer a number."""

    kind = ErrorKind.TRAINING_DIVERGED


@dataclass(frozen=True, kw_only=True, eq=False)
class Trained:
    """Attributes:
    learner: with the weights of the best validation loss.
    course: of the losses.
    seconds: of all epochs.
    """

    learner: Learner
    course: LossCourse
    seconds: float


@dataclass(kw_only=True)
class Training:
    """One training.

    Attributes:
        recipe: what is trained.
        train, validation: inputs, prepared.
        run: folder of its checkpoint.
        identity: of recipe and data; a checkpoint of another one is refused.
        device: where it computes.
        bars: makes progress bars.
        checkpoint_seconds: from one checkpoint to the next.
    """

    recipe: TrainingRecipe
    train: Prepared
    validation: Prepared
    run: Path
    identity: dict[str, object]
    device: torch.device
    bars: Bars
    checkpoint_seconds: float = CHECKPOINT_SECONDS

    def begin(self) -> Standing:
        """Stands at the beginning, or where the checkpoint was taken.

        Raises:
            RefusedError, CorruptError: a checkpoint that does not fit.
        """
        spec, batches, learner = self.recipe.optimiser, self.batches, self._fresh()
        optimiser = torch.optim.Adam(learner.parameters(), lr=spec.rate, weight_decay=spec.decay)
        standing = Standing(
            learner=learner,
            best=None,
            optimiser=optimiser,
            course=LossCourse(),
            batches=batches.state(),
        )
        if checkpoint.restore(self.run, standing, identity=self.identity):
            batches.take_up(standing.batches)
        return standing

    def complete(self, standing: Standing | None = None) -> Trained:
        """Trains from where `begin` stands to the end.

        Raises:
            TrainingDivergedError: the loss is not finite.
            RefusedError, CorruptError: a checkpoint that does not fit.
            FlagdataError: the disk is full.
        """
        standing = standing if standing is not None else self.begin()
        spec, batches, learner, course = (
            self.recipe.optimiser,
            self.batches,
            standing.learner,
            standing.course,
        )
        values = self._values(self.train, learner)
        self._values(
            self.validation, learner
        )  # what cannot be learned is refused before the first step
        module = _Loss(learner)
        stepped: nn.Module = module if _share()[1] == 1 else DistributedDataParallel(module)
        while len(course.epochs) < spec.epochs and not course.is_stalled(spec.patience):
            self._epoch(standing, batches, stepped, values)
        if standing.best is not None:
            learner.load_state_dict(standing.best)
        return Trained(
            learner=learner.eval(),
            course=course,
            seconds=sum(epoch.seconds for epoch in course.epochs),
        )

    def length(self, epochs: int) -> float:
        """Predicts how long so many epochs take on this machine, validation left out, by a step
        that changes nothing [s]."""
        spec = self.recipe.optimiser
        with torch.random.fork_rng(devices=[]):
            learner = self._fresh().train()
            entries = np.arange(min(spec.batch, len(self.train)))
            inputs = self.train.batch(entries, np.zeros(len(entries), dtype=np.int64)).to(
                self.device
            )
            values, sequence = (
                self._values(self.train, learner)[: len(entries)],
                torch.from_numpy(self.train.sequence),
            )
            begun = 0.0
            for _ in range(_TRIED):
                begun = time.monotonic()
                with _computing(spec.precision, self.device):
                    loss = learner.loss(inputs, values, sequence[: len(entries)].to(self.device))
                loss.backward()
                float(loss.detach())  # waits for the device
            return (time.monotonic() - begun) * len(self.batches) * epochs

    @cached_property
    def batches(self) -> Batches:
        """This process's part of all batches; its state is the progress of the training."""
        together = self.recipe.loss.name is Loss.CONTRASTIVE
        return Batches(
            prepared=self.train,
            size=self.recipe.optimiser.batch,
            seed=self.recipe.seed,
            together=together,
            share=_share(),
        )

    def _fresh(self) -> Learner:
        with torch_draws(self.recipe.seed, "weights"):
            learner = self.recipe.learner()
        if self.recipe.loss.targets:
            learner.fit_scale(torch.from_numpy(self.train.truth(self.recipe.loss.targets)))
        return learner.to(self.device)

    def _values(self, prepared: Prepared, learner: Learner) -> Tensor:
        """Returns (n, target) of the entries.

        Raises:
            InputError: some lie beyond the range of their target.
        """
        scaling = learner.scaling
        truth = prepared.truth(scaling.names) if scaling.names else np.empty((len(prepared), 0))
        scaling.check(truth, where="the training data")
        return torch.from_numpy(truth).to(self.device)

    def _epoch(
        self, standing: Standing, batches: Batches, stepped: nn.Module, values: Tensor
    ) -> None:
        spec, number = self.recipe.optimiser, batches.epoch
        begun = written = time.monotonic()
        total, steps = standing.running
        clips = len(batches) * spec.batch
        standing.learner.train()
        with self.bars(
            clips, f"{self.recipe.name}: epoch {number + 1} of {spec.epochs}", "clip"
        ) as advance:
            advance(steps * spec.batch)
            for batch in batches:
                rate = learning_rate(spec, number * len(batches) + steps, len(batches))
                total += self._step(standing, stepped, batch, values, rate)
                steps += 1
                advance(spec.batch)
                if batches.epoch == number and time.monotonic() - written > self.checkpoint_seconds:
                    standing.running, standing.batches = (total, steps), batches.state()
                    self._save(standing)
                    written = time.monotonic()
        validation = self._validate(standing.learner)
        epoch = Epoch(
            number=number,
            train=total / steps,
            validation=validation,
            rate=learning_rate(spec, (number + 1) * len(batches) - 1, len(batches)),
            seconds=time.monotonic() - begun,
            clips=clips,
        )
        best = standing.course.best
        if best is None or validation < best.validation:
            standing.best = {
                name: value.detach().clone()
                for name, value in standing.learner.state_dict().items()
            }
        standing.course.epochs.append(epoch)
        standing.running, standing.batches = (0.0, 0), batches.state()
        self._save(standing)

    def _step(
        self,
        standing: Standing,
        stepped: nn.Module,
        batch: TrainingBatch,
        values: Tensor,
        rate: float,
    ) -> float:
        """Takes a step on one batch; returns its loss."""
        optimiser, spec = standing.optimiser, self.recipe.optimiser
        for group in optimiser.param_groups:
            group["lr"] = rate
        inputs = batch.inputs.to(self.device)
        wanted = values[torch.from_numpy(batch.entries).to(self.device)]
        with _computing(spec.precision, self.device):
            loss = stepped(inputs, wanted, batch.sequence.to(self.device))
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        limit = spec.clip_norm if spec.clip_norm is not None else math.inf
        norm = nn.utils.clip_grad_norm_(standing.learner.parameters(), limit)
        if not math.isfinite(float(loss.detach())) or not math.isfinite(float(norm)):
            raise TrainingDivergedError(
                f"the loss is {float(loss.detach())} in epoch {len(standing.course.epochs) + 1}, "
                f"its gradient's norm {float(norm)}",
                where=str(self.run),
                fix="lower the rate or set clip-norm; the last good checkpoint is kept",
            )
        optimiser.step()
        return float(loss.detach())

    @torch.no_grad()
    def _validate(self, learner: Learner) -> float:
        """Computes the mean loss over the validation side; a contrastive one over batches of whole
        sequences."""
        learner.eval()
        values, sequence = (
            self._values(self.validation, learner),
            torch.from_numpy(self.validation.sequence),
        )
        whole = learner.objective is Loss.CONTRASTIVE
        total, count = 0.0, 0
        for entries in validation_batches(self.validation.sequence, whole=whole):
            inputs = self.validation.batch(entries, np.zeros(len(entries), dtype=np.int64)).to(
                self.device
            )
            loss = learner.loss(inputs, values[entries.tolist()], sequence[entries].to(self.device))
            total, count = total + float(loss) * len(entries), count + len(entries)
        return total / count

    def _save(self, standing: Standing) -> None:
        if _share()[0] == 0:
            checkpoint.save(self.run, standing, identity=self.identity)


def validation_batches(sequence: IntArray, *, whole: bool) -> list[IntArray]:
    """Parts clips (n,) into batches, in the order of their sequences.

    Args:
        sequence: (n,) of each clip.
        whole: whether sequences stay whole and each batch has several, with two clips of one at
            least, as a contrastive loss needs; where that cannot be had all clips are one batch.
    """
    order = np.argsort(sequence, kind="stable")
    if not whole:
        return np.split(order, range(_EVALUATED, len(order), _EVALUATED))
    ends = np.flatnonzero(np.diff(sequence[order], append=sequence[order][-1:] + 1)) + 1
    cuts, begin = [0], 0
    for end in ends.tolist():
        if end - begin >= _EVALUATED and _comparable(sequence[order[begin:end]]):
            cuts.append(end)
            begin = end
    if begin < len(order) and not _comparable(sequence[order[begin:]]) and len(cuts) > 1:
        cuts.pop()
    return np.split(order, [cut for cut in cuts[1:] if cut < len(order)])


def _comparable(sequence: IntArray) -> bool:
    """Returns whether clips have a pair of one sequence and a pair of two."""
    return 1 < len(np.unique(sequence)) < len(sequence)


class _Loss(nn.Module):
    """The learner's loss as a forward pass, which is what `DistributedDataParallel` follows."""

    def __init__(self, learner: Learner) -> None:
        super().__init__()
        self.learner = learner

    def forward(self, inputs: Tensor, values: Tensor, sequence: Tensor) -> Tensor:
        return self.learner.loss(inputs, values, sequence)


def learning_rate(spec: OptimiserSpec, step: int, of_epoch: int) -> float:
    """Computes the rate of a step.

    Args:
        step: its number from the first of all.
        of_epoch: steps of an epoch.
    """
    if spec.schedule is Schedule.STEPS:
        return spec.rate * 0.1 ** (step // of_epoch // spec.drop_after)
    total = spec.epochs * of_epoch
    warm = max(1, round(_WARM_UP * total))
    if step < warm:
        return spec.rate * (_LEAST + (1 - _LEAST) * step / warm)
    share = (step - warm) / max(1, total - warm)
    return spec.rate * (_FINAL + (1 - _FINAL) * 0.5 * (1 + math.cos(math.pi * share)))


@contextmanager
def _computing(precision: Precision, device: torch.device) -> Iterator[None]:
    enabled = precision is Precision.BFLOAT16
    with torch.autocast(device.type, dtype=torch.bfloat16, enabled=enabled):
        yield


def _share() -> tuple[int, int]:
    """Returns (rank, ranks) of this process."""
    if ranks.is_initialized():
        return ranks.get_rank(), ranks.get_world_size()
    return 0, 1
