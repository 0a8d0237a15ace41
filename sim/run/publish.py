"""A recipe's members into a lake: what is there already is not made again; each batch is one
commit."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import Any, TypeAlias

import torch

from flagdata.core.provenance import canonical
from flagdata.core.schema import Kind
from flagdata.core.workload import one_thread
from flagdata.errors import UsageError
from flagdata.lake import Artifact, CommitResult, Lake
from flagdata.lake.deposit import Deposit, deposit
from flagdata.lake.mesh_sequences import write_meshes
from flagdata.lake.remaking import Remade, unsound
from sim.compiler import library
from sim.run.member_batch import BatchOutcome, Stepper, run
from sim.run.members import Crew
from sim.run.simulation_recipe import Recipe

Deposited: TypeAlias = tuple[Artifact, Deposit]
"""A row that is not committed yet, and its object in the store."""
Progress: TypeAlias = Callable[[int], object]
"""Called with the number of members done since the last call; a batch under way counts by its share
of frames."""


@dataclass(frozen=True, kw_only=True)
class RunReport:
    """What a run did.

    Attributes:
        added: artifact ids published now.
        existing: artifact ids that were there already, and whole.
        healed: artifact ids that were there, whose objects were damaged or missing and were made
            again → how.
        failed: what was not stored: index, seed, kind and what of each.
        steps: material → step of the integrator [s].
        seconds: wall time of the simulation.
        rate: simulated members, failed ones included, a second.
    """

    added: tuple[str, ...]
    existing: tuple[str, ...]
    healed: Mapping[str, Remade]
    failed: tuple[Mapping[str, Any], ...]
    steps: Mapping[str, float]
    seconds: float
    rate: float


def simulate(
    lake: Lake,
    recipe: Recipe,
    *,
    branch: str = "main",
    device: str = "cpu",
    workers: int = 1,
    progress: Progress | None = None,
) -> RunReport:
    """Simulate the members of a recipe that are not on the branch yet, or whose object there is
    damaged or missing, and publish them batch by batch.

    A run that was stopped goes on where its last commit was. Members that fail are reported and not
    stored; a later run tries them again. What a member becomes depends neither on the workers nor
    on what it is simulated with.

    Args:
        workers: batches at a time, each in a thread of its own; the compiled kernel lets them run
            side by side.
        progress: may be called from any of these threads, never from two at once.

    Raises:
        UsageError: no workers, a device that is not there, or a step or effect that does not fit
            the scene.
        InputError: a scene that cannot be simulated.
    """
    check_device(device)
    if workers < 1:
        raise UsageError(f"{workers} workers", where="--workers", fix="give at least one")
    crew = Crew(recipe)
    identity = recipe.identity()
    ids = {
        index: member_artifact(recipe, identity, index, crew.seed(index)).id
        for index in range(recipe.count)
    }
    # What the branch has already is left alone.
    in_lake = whole(lake, ids.values(), branch=branch)
    existing = [ids[index] for index in ids if ids[index] in in_lake]
    pending = [index for index in ids if ids[index] not in in_lake]
    steppers = [Stepper.of(crew, base) for base in range(len(recipe.material.bases))]
    if progress is not None:
        progress(len(existing))
    added: list[str] = []
    healed: dict[str, Remade] = {}
    failed: list[Mapping[str, Any]] = []
    begun = time.perf_counter()
    # Each batch is a commit of its own: what is done stays where a run is stopped.
    waiting = batches(crew, steppers, pending)
    for stepper, done in outcomes(crew, waiting, device=device, workers=workers, progress=progress):
        good = [o for o in done if o.sequence is not None]
        failed += [failure_of(o) for o in done if o.failure is not None]
        if good:
            commit = publish(lake, recipe, good, step=stepper.step, branch=branch)
            added += commit.added
            healed |= commit.healed
    seconds = time.perf_counter() - begun
    return RunReport(
        added=tuple(added),
        existing=tuple(existing),
        healed=healed,
        failed=tuple(failed),
        seconds=seconds,
        steps={
            base.name: stepper.step
            for base, stepper in zip(recipe.material.bases, steppers, strict=True)
        },
        rate=len(pending) / seconds if pending else 0.0,
    )


def whole(lake: Lake, artifacts: Collection[str], *, branch: str) -> frozenset[str]:
    """Returns those of some artifacts that a branch has and whose objects are neither damaged nor
    missing."""
    present = lake.rows({"artifact": list(artifacts)}, at=branch, columns=["artifact"])[
        "artifact"
    ].to_pylist()
    return frozenset(present) - unsound(lake, present, at=branch)


def batches(
    crew: Crew, steppers: Sequence[Stepper], pending: Sequence[int]
) -> list[tuple[Stepper, list[int]]]:
    """Groups members by material, since each material has its own steps."""
    size = crew.recipe.batch
    groups: list[tuple[Stepper, list[int]]] = []
    for base, stepper in enumerate(steppers):
        indices = [index for index in pending if crew.base(index) == base]
        groups += [
            (stepper, indices[first : first + size]) for first in range(0, len(indices), size)
        ]
    return groups


def outcomes(
    crew: Crew,
    batches: Sequence[tuple[Stepper, list[int]]],
    *,
    device: str,
    workers: int,
    progress: Progress | None,
) -> Iterator[tuple[Stepper, list[BatchOutcome]]]:
    """Yields the batches' outcomes as they come, one batch waiting beside those that run.

    Leaving the iteration early stops what is still running.
    """
    ticks = _Ticks(progress, crew.recipe.time.total)

    def simulate_batch(stepper: Stepper, indices: list[int]) -> tuple[Stepper, list[BatchOutcome]]:
        members = [crew.member(index) for index in indices]
        tick = ticks.of_batch(len(members))
        return stepper, run(
            crew, stepper, members, size=crew.recipe.batch, device=device, progress=tick
        )

    if device.startswith("cpu"):
        library()  # built once, before several threads ask for it
    waiting = iter(batches)
    executor = ThreadPoolExecutor(max_workers=workers, thread_name_prefix="simulate")
    with one_thread():
        try:
            running = {
                executor.submit(simulate_batch, *batch) for batch in islice(waiting, workers + 1)
            }
            while running:
                done, running = wait(running, return_when=FIRST_COMPLETED)
                for future in done:
                    yield future.result()
                    running |= {
                        executor.submit(simulate_batch, *batch) for batch in islice(waiting, 1)
                    }
        finally:
            ticks.stop()
            executor.shutdown(cancel_futures=True)


def publish(
    lake: Lake, recipe: Recipe, outcomes: Sequence[BatchOutcome], *, step: float, branch: str
) -> CommitResult:
    """Publish the outcomes that have meshes in one commit.

    Args:
        step: of the integrator [s].
    """
    identity = recipe.identity()
    with lake.transaction(
        _message(recipe, [o.member.index for o in outcomes]), branch=branch
    ) as transaction:
        for outcome in outcomes:
            if outcome.sequence is None:
                continue
            staged = transaction.staging(".zarr")
            write_meshes(staged, outcome.sequence)
            transaction.add(
                _publish_row(recipe, identity, outcome, step, stored=transaction.put(staged))
            )
    return transaction.result


def deposit_meshes(
    lake: Lake, recipe: Recipe, outcomes: Sequence[BatchOutcome], *, step: float
) -> dict[int, Deposited]:
    """Puts the meshes of outcomes that have some into the store; returns index → row and object.

    Args:
        step: of the integrator [s].
    """
    identity = recipe.identity()
    stored: dict[int, Deposited] = {}
    for outcome in outcomes:
        if outcome.sequence is not None:
            put = deposit(lake, ".zarr", partial(write_meshes, sequence=outcome.sequence))
            stored[outcome.member.index] = (
                _publish_row(recipe, identity, outcome, step, stored=put.name),
                put,
            )
    return stored


def commit(
    lake: Lake, recipe: Recipe, stored: Mapping[int, Deposited], *, branch: str
) -> CommitResult:
    """Commits the rows of members whose meshes are in the store."""
    with lake.transaction(_message(recipe, stored), branch=branch) as transaction:
        for row, put in stored.values():
            transaction.rely(put)
            transaction.add(row)
    return transaction.result


def _message(recipe: Recipe, indices: Iterable[int]) -> str:
    return f"simulate {recipe.name}: members {', '.join(map(str, indices))}"


def member_artifact(recipe: Recipe, identity: Mapping[str, Any], index: int, seed: int) -> Artifact:
    """Returns the member's row without its result; its identity is complete."""
    return Artifact(
        kind=Kind.MESHES,
        name=f"{recipe.name}-{index:05d}",
        recipe=identity,
        seed=seed,
        frame_count=recipe.time.frames,
        rate=recipe.time.rate,
        parents=recipe.parents,
    )


def _publish_row(
    recipe: Recipe, identity: Mapping[str, Any], outcome: BatchOutcome, step: float, *, stored: str
) -> Artifact:
    member, diagnosis = outcome.member, outcome.diagnosis
    report = {
        "schema": "flagdata.simulation-report/1",
        "index": member.index,
        "root_seed": recipe.seed,
        "step": step,
        "batch": recipe.batch,
        "settle": recipe.time.settle,
        **diagnosis.summary(),
        "findings": [],
    }
    return replace(
        member_artifact(recipe, identity, member.index, member.seed),
        object=stored,
        wind=member.wind_speed,
        parameters=canonical(member.parameters),
        report=json.dumps(report, allow_nan=False),
    )


def failure_of(outcome: BatchOutcome) -> dict[str, Any]:
    kind, reason = outcome.failure or ("failed", "it failed")
    return {
        "index": outcome.member.index,
        "seed": outcome.member.seed,
        "kind": kind,
        "what": reason,
    }


def check_device(device: str) -> None:
    """Raises:
    UsageError: a device that is not there.
    """
    try:
        torch.zeros(1, device=device)
    except (RuntimeError, AssertionError) as error:
        raise UsageError(
            f"device {device!r} is not there: {str(error).splitlines()[0]}",
            where="--device",
            fix="take cpu",
        ) from None


class _Ticks:
    """Turns frames of batches into whole members, one call at a time, until it is stopped."""

    def __init__(self, progress: Progress | None, frames: int) -> None:
        self._progress, self._frames = progress, frames
        self._lock = threading.Lock()
        self._stopped = threading.Event()

    def stop(self) -> None:
        """Let the batches that still run end at their next frame."""
        self._stopped.set()

    def of_batch(self, members: int) -> Callable[[int], None]:
        """Returns a function that one batch calls with the frames it has done.

        Raises:
            CancelledError: from that call, once all is stopped.
        """
        done = 0

        def tick(frames: int) -> None:
            nonlocal done
            if self._stopped.is_set():
                raise CancelledError
            before = done * members // self._frames
            done += frames
            if self._progress is not None:
                with self._lock:
                    self._progress(done * members // self._frames - before)

        return tick
