"""A recipe's members into a lake: what is there already is not made again; each batch is one commit."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import torch

from flagdata.errors import UsageError
from flagdata.lake import Artifact, Lake
from flagdata.lake.meshes import write_meshes
from flagdata.provenance import canonical
from flagdata.schema import Kind
from sim.run.batch import Outcome, Stepper, run
from sim.run.members import Crew
from sim.run.recipe import Recipe

Progress: TypeAlias = Callable[[int], object]
"""Called with the number of members done since the last call; a batch under way counts by its share of frames."""


@dataclass(frozen=True, kw_only=True)
class RunReport:
    """What a run did.

    Attributes:
        added: artifact ids published now.
        existing: artifact ids that were there already.
        failed: what was not stored: index, seed, kind and what of each.
        step: of the integrator [s].
        seconds: wall time of the simulation.
        rate: simulated members, failed ones included, a second.
    """

    added: tuple[str, ...]
    existing: tuple[str, ...]
    failed: tuple[Mapping[str, Any], ...]
    step: float
    seconds: float
    rate: float

    def as_dict(self) -> dict[str, Any]:
        return {
            "added": list(self.added), "existing": list(self.existing), "failed": [dict(f) for f in self.failed],
            "step": self.step, "seconds": self.seconds, "rate": self.rate,
        }  # fmt: skip


def simulate(
    lake: Lake,
    recipe: Recipe,
    *,
    branch: str = "main",
    device: str = "cpu",
    progress: Progress | None = None,
) -> RunReport:
    """Simulate the members of a recipe that are not on the branch yet, and publish them batch by batch.

    A run that was stopped goes on where its last commit was. Members that fail are reported and not stored; a later run
    tries them again.

    Raises:
        UsageError: a device that is not there, or a step or effect that does not fit the scene.
        InputError: a scene that cannot be simulated.
    """
    _check_device(device)
    crew = Crew(recipe)
    stepper = Stepper.of(crew)
    identity = recipe.identity()
    known = set(lake.rows(at=branch, columns=["artifact"])["artifact"].to_pylist())
    ids = {index: _artifact(recipe, identity, index, crew.seed(index)).id for index in range(recipe.count)}
    existing = [ids[index] for index in ids if ids[index] in known]
    pending = [index for index in ids if ids[index] not in known]
    if progress is not None:
        progress(len(existing))
    added: list[str] = []
    failed: list[Mapping[str, Any]] = []
    begun = time.perf_counter()
    for first in range(0, len(pending), recipe.batch):
        members = [crew.member(index) for index in pending[first : first + recipe.batch]]
        tick = None if progress is None else _Ticks(progress, len(members), recipe.time.total)
        outcomes = run(crew, stepper, members, size=recipe.batch, device=device, progress=tick)
        good = [o for o in outcomes if o.sequence is not None]
        failed += [_failure(o) for o in outcomes if o.failure is not None]
        if good:
            added += _publish(lake, recipe, identity, good, stepper, branch=branch)
    seconds = time.perf_counter() - begun
    return RunReport(
        added=tuple(added), existing=tuple(existing), failed=tuple(failed), step=stepper.step, seconds=seconds,
        rate=len(pending) / seconds if pending else 0.0,
    )  # fmt: skip


def _publish(
    lake: Lake, recipe: Recipe, identity: Mapping[str, Any], outcomes: list[Outcome], stepper: Stepper, *, branch: str
) -> list[str]:
    indices = ", ".join(str(o.member.index) for o in outcomes)
    with lake.transaction(f"simulate {recipe.name}: members {indices}", branch=branch) as transaction:
        for outcome in outcomes:
            if outcome.sequence is None:
                continue
            staged = transaction.staging(".zarr")
            write_meshes(staged, outcome.sequence)
            transaction.add(_artifact_of(recipe, identity, outcome, stepper, stored=transaction.put(staged)))
    result = transaction.result
    return list(result.added) if result is not None else []


def _artifact(recipe: Recipe, identity: Mapping[str, Any], index: int, seed: int) -> Artifact:
    """The member's row without its result; its identity is complete."""
    return Artifact(
        kind=Kind.MESHES, name=f"{recipe.name}-{index:05d}", recipe=identity, seed=seed,
        frame_count=recipe.time.frames, rate=recipe.time.rate,
    )  # fmt: skip


def _artifact_of(
    recipe: Recipe, identity: Mapping[str, Any], outcome: Outcome, stepper: Stepper, *, stored: str
) -> Artifact:
    member, diagnosis = outcome.member, outcome.diagnosis
    report = {
        "schema": "flagdata.simulation-report/1", "index": member.index, "root_seed": recipe.seed,
        "step": stepper.step, "batch": recipe.batch, "settle": recipe.time.settle, **diagnosis.summary(),
        "findings": [],
    }  # fmt: skip
    return replace(
        _artifact(recipe, identity, member.index, member.seed), object=stored, wind=member.wind_speed,
        parameters=canonical(member.parameters), report=json.dumps(report, allow_nan=False),
    )  # fmt: skip


def _failure(outcome: Outcome) -> dict[str, Any]:
    kind, what = outcome.failure or ("failed", "it failed")
    return {"index": outcome.member.index, "seed": outcome.member.seed, "kind": kind, "what": what}


def _check_device(device: str) -> None:
    try:
        torch.zeros(1, device=device)
    except (RuntimeError, AssertionError) as error:
        raise UsageError(
            f"device {device!r} is not there: {str(error).splitlines()[0]}", where="--device", fix="take cpu"
        ) from None


class _Ticks:
    """Turns frames of a batch into whole members."""

    def __init__(self, progress: Progress, members: int, frames: int) -> None:
        self._progress, self._members, self._frames = progress, members, frames
        self._seen = 0

    def __call__(self, frames: int) -> None:
        before = self._seen * self._members // self._frames
        self._seen += frames
        self._progress(self._seen * self._members // self._frames - before)
