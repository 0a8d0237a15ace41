"""Building a data set: sequences first, then their films, each commit a batch of them.

Workers put what they make into the lake's store (`sim.datasets.build_jobs`); this process alone
commits. What is in the lake is known by its identity, so that a build that was killed goes on where
its last commit was, and ends with the same artifacts and objects as an unbroken one.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeAlias

from flagdata.core.provenance import canonical
from flagdata.core.schema import Kind
from flagdata.errors import ConflictError, RefusedError
from flagdata.lake import Artifact, Lake
from flagdata.recipes.documents import column_json
from sim.datasets import build_jobs
from sim.datasets.build_jobs import PutFilm, PutSequences
from sim.datasets.cast import IN_PLACE_OF, Cast, Roll, casts, recall_failures
from sim.datasets.dataset_films import PlannedFilm, Sequences
from sim.datasets.dataset_recipe import DatasetRecipe
from sim.datasets.shard import Shard
from sim.run.publish import Deposited, commit, whole
from sim.workers import Job, Workers

COMMIT_RESULTS = 32
"""Results of jobs, films or batches of sequences, of one commit."""
COMMIT_SECONDS = 30.0
"""A commit is due after this time, however few results there are."""

Advance: TypeAlias = Callable[[int], None]
Bars: TypeAlias = Callable[[int, str, str], AbstractContextManager[Advance]]
"""Makes a progress bar of a total, a label and a unit."""


@dataclass(frozen=True, kw_only=True)
class BuildReport:
    """What a build did.

    Attributes:
        sequences, films: how many the data set has.
        new_sequences, new_films: how many of them were made now.
        healed: how many of all were there, but damaged or missing, and were made again.
        clips: how many the films have.
        failed: sequences that diverged or crumpled and were replaced, with why.
        seconds: wall time.
    """

    sequences: int
    films: int
    new_sequences: int
    new_films: int
    healed: int
    clips: int
    failed: tuple[str, ...]
    seconds: float


@dataclass(kw_only=True)
class Build:
    """One build of a recipe into a lake.

    Args:
        device: where workers compute.
        shard: the part that is made; None for all.
    """

    lake: Lake
    recipe: DatasetRecipe
    workers: Workers
    bars: Bars
    branch: str = "main"
    device: str = "cpu"
    shard: Shard | None = None
    _new_sequences: int = field(default=0, init=False)
    _new_films: int = field(default=0, init=False)
    _healed: int = field(default=0, init=False)
    _clips: int = field(default=0, init=False)

    def run(self) -> BuildReport:
        """Make what is missing.

        Raises:
            ConflictError: the branch has films of this name by another recipe, or these films under
                another name.
            RefusedError: too many sequences fail, or one of a cast that shards share.
            WorkerError: workers kept dying, or all of them are gone.
            FlagdataError: a renderer, an asset or the disk failed.
        """
        begun = time.perf_counter()
        self._refuse_other_names(self.films(Roll(cast=cast) for cast in casts(self.recipe)))
        rolls = [Roll(cast=cast) for cast in casts(self.recipe)]
        recall_failures(self.lake, rolls, branch=self.branch)
        in_shard = None if self.shard is None else self.shard.sequences(rolls)
        sequences = self._simulate(rolls, in_shard)
        films = self._film(rolls, in_shard)
        failed = [
            f"{roll.cast.simulation.name} {index}: {why}"
            for roll in rolls
            for index, why in roll.failed.items()
        ]
        return BuildReport(
            sequences=sequences,
            films=len(films),
            new_sequences=self._new_sequences,
            new_films=self._new_films,
            healed=self._healed,
            clips=self._clips,
            failed=tuple(failed),
            seconds=time.perf_counter() - begun,
        )

    # Sequences

    def _simulate(self, rolls: Sequence[Roll], in_shard: Collection[str] | None) -> int:
        """Simulates what is missing of the sequences that are made here, and returns how many those
        are."""
        in_lake = whole(
            self.lake, [roll.id(i) for roll in rolls for i in roll.candidates], branch=self.branch
        )
        total = sum(len(roll.pending((), in_shard)) for roll in rolls)
        with self.bars(total, f"{self.recipe.name}: simulate", "flag") as advance:
            todo = [(roll, roll.pending(in_lake, in_shard)) for roll in rolls]
            known = {roll.cast.simulation.name: set(roll.failed) for roll in rolls}
            advance(total - sum(len(pending) for _, pending in todo))
            while any(pending for _, pending in todo):
                self._simulate_once([entry for entry in todo if entry[1]], advance)
                self._refuse_replacing(rolls, known)
                todo = [(roll, roll.pending(in_lake, in_shard)) for roll, _ in todo]
        return total

    def _refuse_replacing(self, rolls: Sequence[Roll], known: Mapping[str, set[int]]) -> None:
        """Refuses a shard in which a sequence of a cast that other shards share failed: their films
        would change. Those that are `known` to fail were replaced in an earlier build."""
        shared = [roll for roll in rolls if not roll.in_one_batch]
        failed = [
            (roll, i)
            for roll in shared
            for i in roll.failed
            if i not in known[roll.cast.simulation.name]
        ]
        if self.shard is not None and failed:
            (roll, index), *_ = failed
            raise RefusedError(
                f"sequence {index} failed, and a shard cannot choose another: {roll.failed[index]}",
                where=roll.cast.simulation.name,
                fix="build the data set without --shard, on a branch that has none of its films",
            )

    def _simulate_once(self, todo: Sequence[tuple[Roll, list[int]]], advance: Advance) -> None:
        """Simulates all pending members of the rolls once; those that fail are noted on their
        roll."""
        by_name = {roll.cast.simulation.name: roll for roll, _ in todo}
        replaced = {name: dict(roll.failed) for name, roll in by_name.items()}

        def commit_sequences(results: Sequence[PutSequences]) -> int:
            stored: dict[str, dict[int, Deposited]] = {}
            for done in results:
                by_name[done.name].failed |= done.failed
                stored.setdefault(done.name, {}).update(done.stored)
            return sum(
                self._commit_sequences(by_name[name], members, replaced[name])
                for name, members in stored.items()
                if members
            )

        self._commit_each(self._batches(todo), commit_sequences, advance)

    def _commit_sequences(
        self, roll: Roll, stored: Mapping[int, Deposited], replaced: Mapping[int, str]
    ) -> int:
        """Commits sequences that are in the store and returns how many; the reports of those that
        take the place of others name the members `replaced`."""
        if replaced:
            wanted = roll.cast.simulation.count
            stored = {
                i: (_in_place_of(replaced, row) if i >= wanted else row, put)
                for i, (row, put) in stored.items()
            }
        committed = commit(self.lake, roll.cast.simulation, stored, branch=self.branch)
        roll.done |= set(stored)
        self._new_sequences += len(committed.added)
        self._healed += len(committed.healed)
        return len(stored)

    def _commit_each(
        self, work: Iterator[Job], commit_results: Callable[[Any], int], advance: Advance
    ) -> None:
        """Has jobs done and commits their results, some together; what is done stays where the work
        is stopped."""
        waiting: list[Any] = []
        last = time.monotonic()
        try:
            for done in self.workers.results(work):
                waiting.append(done)
                if len(waiting) >= COMMIT_RESULTS or time.monotonic() - last > COMMIT_SECONDS:
                    ready, waiting = waiting, []
                    advance(commit_results(ready))
                    last = time.monotonic()
        finally:
            advance(commit_results(waiting))

    def _batches(self, todo: Sequence[tuple[Roll, list[int]]]) -> Iterator[Job]:
        for roll, pending in todo:
            simulation = roll.cast.simulation
            for base in range(len(simulation.material.bases)):
                indices = [index for index in pending if roll.crew.base(index) == base]
                for first in range(0, len(indices), simulation.batch):
                    members = indices[first : first + simulation.batch]
                    yield (
                        build_jobs.put_sequences,
                        (self._address, simulation, base, members, self.device),
                    )

    # Films

    def films(self, rolls: Iterable[Roll]) -> list[PlannedFilm]:
        """Returns all films of the data set in the order they are rendered: small sides first, so
        that a network's validation films exist while its training films are still being
        rendered."""
        members: dict[str, list[tuple[Cast, int, str]]] = {
            side.name: [] for side in self.recipe.sides
        }
        for roll in rolls:
            members[roll.cast.side.name] += [
                (roll.cast, index, roll.id(index)) for index in roll.chosen
            ]
        return [
            film
            for side, side_members in sorted(
                members.items(), key=lambda item: self.recipe.side(item[0]).renders
            )
            for film in Sequences(
                recipe=self.recipe, side=side, members=tuple(side_members)
            ).films()
        ]

    def _film(self, rolls: Sequence[Roll], in_shard: Collection[str] | None) -> list[PlannedFilm]:
        films = self.films(rolls)
        self._refuse_other_names(films)
        candidates = {roll.id(index) for roll in rolls for index in roll.candidates}
        others = candidates.difference(candidates if in_shard is None else in_shard)
        self._refuse_mixture({film.artifact().id for film in films}, others)
        films = [film for film in films if in_shard is None or film.sequence in in_shard]
        film_ids = {film.artifact().id for film in films}
        in_lake = whole(self.lake, film_ids, branch=self.branch)
        missing = [film for film in films if film.artifact().id not in in_lake]
        clips = self.lake.rows({"kind": Kind.CLIP}, at=self.branch, columns=["recording"])[
            "recording"
        ].to_pylist()
        self._clips = sum(recording in film_ids for recording in clips)
        with self.bars(len(films), f"{self.recipe.name}: render", "film") as advance:
            advance(len(films) - len(missing))
            self._commit_each(self._shots(missing), self._commit_films, advance)
        return films

    def _refuse_mixture(self, film_ids: set[str], others: set[str]) -> None:
        """Make sure that all films of the data set's name are of this recipe.

        Another shard may have replaced a sequence that failed: films of `others` are judged by how
        they are filmed.
        """
        films = {"kind": Kind.RECORDING, "dataset": self.recipe.name}
        rows = self.lake.rows(films, at=self.branch, columns=["artifact", "parents"]).to_pylist()
        foreign = {row["artifact"] for row in rows} - film_ids
        replaced = {
            row["artifact"] for row in rows if not others.isdisjoint(row["parents"])
        } & foreign
        foreign -= {artifact for artifact in replaced if self._films_alike(artifact)}
        if foreign:
            raise ConflictError(
                f"{len(foreign)} recordings of the data set {self.recipe.name!r} are of another "
                "recipe",
                where=f"branch {self.branch}",
                fix="give the recipe another name, or build on another branch",
            )

    def _films_alike(self, recording: str) -> bool:
        """Whether a recording of the branch is filmed as this recipe films."""
        (row,) = self.lake.rows(
            {"artifact": recording}, at=self.branch, columns=["recipe"]
        ).to_pylist()
        recipe = column_json(row["recipe"], "recipe", artifact=recording)
        return canonical({**recipe, **self.recipe.filming()}) == canonical(recipe)

    def _refuse_other_names(self, films: Sequence[PlannedFilm]) -> None:
        """Make sure that no film of this recipe is there under another data set's name, where it
        would stay."""
        film_ids = [film.artifact().id for film in films]
        columns = ["artifact", "dataset"]
        datasets = self.lake.rows({"artifact": film_ids}, at=self.branch, columns=columns)[
            "dataset"
        ].to_pylist()
        other_datasets = sorted({str(dataset) for dataset in datasets} - {self.recipe.name})
        if other_datasets:
            raise ConflictError(
                f"films of this recipe are there already, in the data set {other_datasets[0]!r}",
                where=f"branch {self.branch}",
                fix="use that data set, or give the recipe another seed",
            )

    def _shots(self, films: Sequence[PlannedFilm]) -> Iterator[Job]:
        rows = self.lake.rows(
            "kind = 'meshes'", at=self.branch, columns=["artifact", "object"]
        ).to_pylist()
        objects = {row["artifact"]: row["object"] for row in rows}
        for film in films:
            yield (
                build_jobs.put_film,
                (self._address, self.recipe, film, objects[film.sequence], self.device),
            )

    @property
    def _address(self) -> str:
        """Where workers find the lake."""
        path = self.lake.path
        return str(path.absolute() if isinstance(path, Path) else path)

    def _commit_films(self, filmed: Sequence[PutFilm]) -> int:
        """Commits films that are in the store and returns how many."""
        if not filmed:
            return 0
        message = f"build {self.recipe.name}: {len(filmed)} films"
        with self.lake.transaction(message, branch=self.branch) as transaction:
            for done in filmed:
                transaction.rely(done.put)
                transaction.add(done.recording)
                for clip in done.clips:
                    self._clips += transaction.add(clip)
        films = {done.recording.id for done in filmed}
        self._new_films += len(films.intersection(transaction.result.added))
        self._healed += len(films.intersection(transaction.result.healed))
        return len(filmed)


def _in_place_of(replaced: Mapping[int, str], row: Artifact) -> Artifact:
    report = column_json(row.report or "{}", "report", artifact=row.id)
    return replace(row, report=json.dumps({**report, IN_PLACE_OF: replaced}))
