"""What a build will take: counts from the recipe and the lake, bytes and hours from a measurement
of a few frames."""

from __future__ import annotations

import itertools
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from pathlib import Path
from typing import ClassVar, TypeVar

from flagdata.core.files.checksums import files_of
from flagdata.core.schema import CLIP_FRAMES
from flagdata.core.workload import announce_work, one_thread
from flagdata.errors import FlagdataError
from flagdata.lake import Lake
from flagdata.lake.mesh_sequences import MeshSequence, RaggedMeshSequence, write_meshes
from sim.datasets import build_jobs
from sim.datasets.cast import Cast, Roll, casts, recall_failures
from sim.datasets.dataset_films import Sequences
from sim.datasets.dataset_recipe import DatasetRecipe
from sim.datasets.shard import Shard

T = TypeVar("T")
_FEW, _MORE = 3, 9  # frames of the two runs between which costs are linear
_BRIEF = 180.0  # s
_USUAL_PACE = 25.0  # s of a flag in a second of one core
_USUAL_FRAMES = (
    50.0  # of the raster renderer in a second of one core, docs/results/bench-render.json
)


@dataclass(frozen=True, kw_only=True)
class Rates:
    """What one takes.

    Attributes:
        sequence_seconds, film_seconds: of one core (or the device), for a whole sequence and a
            whole film.
        sequence_bytes, film_bytes: in the lake.
    """

    sequence_seconds: float
    film_seconds: float
    sequence_bytes: float
    film_bytes: float


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What is to be made.

    Attributes:
        sequences, films, clips: side → how many the data set has.
        missing_sequences, missing_films: how many of them are not in the lake.
        rates: as measured.
        workers: that share the work.
    """

    recipe: DatasetRecipe
    sequences: dict[str, int]
    films: dict[str, int]
    clips: dict[str, int]
    missing_sequences: int
    missing_films: int
    rates: Rates
    workers: int
    JSON_NAMES: ClassVar = (
        *("recipe=recipe.name", "recipe_hash=recipe.hash", "renderer=recipe.renderer"),
        *("sequences", "films", "clips", "missing", "rates", "workers", "bytes=size", "hours"),
    )

    @property
    def seconds(self) -> float:
        """Wall time [s]."""
        work = (
            self.missing_sequences * self.rates.sequence_seconds
            + self.missing_films * self.rates.film_seconds
        )
        return work / self.workers

    @property
    def hours(self) -> float:
        """Wall time [h]."""
        return self.seconds / 3600

    @property
    def size(self) -> int:
        """Size of what is missing [B]."""
        return round(
            self.missing_sequences * self.rates.sequence_bytes
            + self.missing_films * self.rates.film_bytes
        )

    @property
    def missing(self) -> dict[str, int]:
        """How many are missing of each kind."""
        return {"sequences": self.missing_sequences, "films": self.missing_films}


def plan(
    recipe: DatasetRecipe,
    lake: Lake | None,
    *,
    workers: int,
    branch: str = "main",
    device: str = "cpu",
    rates: Rates | None = None,
    shard: Shard | None = None,
) -> Plan:
    """Counts what a build makes, and measures what it takes.

    Args:
        lake: what is in it is not made again; None where there is none yet.
        workers: that will share the work.
        rates: as they are known; None to measure them.
        shard: the part that is made; None for all.

    Raises:
        FlagdataError: the measurement failed, as the build would.
    """
    in_lake: set[str] = set()
    rolls = [Roll(cast=cast) for cast in casts(recipe)]
    if lake is not None:
        in_lake = set(lake.rows(at=branch, columns=["artifact"])["artifact"].to_pylist())
        recall_failures(lake, rolls, branch=branch)
    in_shard = None if shard is None else shard.sequences(rolls)
    films = 0
    frames: dict[str, list[int]] = {side.name: [] for side in recipe.sides}
    for side in recipe.sides:
        side_rolls = [roll for roll in rolls if roll.cast.side.name == side.name]
        members = tuple(
            (roll.cast, index, roll.id(index)) for roll in side_rolls for index in roll.chosen
        )
        side_films = Sequences(recipe=recipe, side=side.name, members=members).films()
        for film in side_films:
            films += film.artifact().id not in in_lake and (
                in_shard is None or film.sequence in in_shard
            )
            frames[side.name].append(film.cast.simulation.time.frames)
    return Plan(
        recipe=recipe,
        sequences={side.name: side.sequences for side in recipe.sides},
        films={side.name: side.renders for side in recipe.sides},
        clips={
            side: sum(count // CLIP_FRAMES for count in counts) for side, counts in frames.items()
        },
        missing_sequences=sum(len(roll.pending(in_lake, in_shard)) for roll in rolls),
        missing_films=films,
        rates=rates or measure(recipe, _typical([roll.cast for roll in rolls]), device=device),
        workers=workers,
    )


def length(
    recipe: DatasetRecipe,
    lake: Lake,
    *,
    workers: int,
    branch: str = "main",
    device: str = "cpu",
    shard: Shard | None = None,
) -> str | None:
    """Describes what a build makes and for about how long; None where nothing is missing. Rates are
    measured where the typical ones predict more than a few minutes.

    Raises:
        FlagdataError: the measurement failed, as the build would.
    """
    typical = _typical(list(casts(recipe)))
    usual = plan(recipe, lake, workers=workers, branch=branch, rates=_usual(typical), shard=shard)
    if not usual.missing_sequences and not usual.missing_films:
        return None
    estimate = (
        usual
        if usual.seconds < _BRIEF
        else replace(usual, rates=measure(recipe, typical, device=device))
    )
    return announce_work(
        f"building {estimate.missing_sequences} sequences and {estimate.missing_films} films",
        estimate.seconds * workers,
        workers=workers,
        kept="an interrupted build goes on where its last commit was",
    )


def _usual(cast: Cast) -> Rates:
    """Returns typical rates for sequences and films of the raster renderer; bytes are not known."""
    spec = cast.simulation.time
    return Rates(
        sequence_seconds=spec.total / spec.rate / _USUAL_PACE,
        film_seconds=spec.frames / _USUAL_FRAMES,
        sequence_bytes=0.0,
        film_bytes=0.0,
    )


def _typical(sequences: Sequence[Cast]) -> Cast:
    """Returns the sequences whose number of frames is nearest to the mean."""
    frames = [cast.simulation.time.frames for cast in sequences]
    mean = sum(frames) / len(frames)
    return min(sequences, key=lambda cast: abs(cast.simulation.time.frames - mean))


def measure(recipe: DatasetRecipe, cast: Cast, *, device: str = "cpu") -> Rates:
    """Simulates and films two short sequences of every material, and extrapolates in proportion to
    their frames.

    Raises:
        FlagdataError: no sequence can be simulated, or a renderer that is not installed or fails.
    """
    shorter, longer = (_shorten_cast(cast, frames) for frames in (_FEW, _MORE))
    spec = cast.simulation.time
    bases = range(len(cast.simulation.material.bases))
    with one_thread():
        runs = [
            (_simulate_few(shorter, base, device), _simulate_few(longer, base, device))
            for base in bases
        ]
        films = [_film_cost(recipe, cast, run, device) for run in runs[0]]
    sequences = [_line(a.seconds, b.seconds, spec.total) for a, b in runs]
    return Rates(
        sequence_seconds=sum(sequences) / len(sequences),
        film_seconds=_line(films[0][0], films[1][0], spec.frames),
        sequence_bytes=_line(
            _stored_size(runs[0][0].sequence), _stored_size(runs[0][1].sequence), spec.frames
        ),
        film_bytes=_line(films[0][1], films[1][1], spec.frames),
    )


@dataclass(frozen=True, kw_only=True)
class _Run:
    """A short sequence: its index, its meshes, and the seconds it took of its batch's."""

    index: int
    sequence: MeshSequence | RaggedMeshSequence
    seconds: float


def _shorten_cast(cast: Cast, frames: int) -> Cast:
    time_ = replace(cast.simulation.time, settle=0.0, frames=frames)
    return replace(cast, simulation=replace(cast.simulation, time=time_))


def _simulate_few(cast: Cast, base: int, device: str) -> _Run:
    simulation, crew = cast.simulation, Roll(cast=cast).crew
    indices = list(islice((i for i in itertools.count() if crew.base(i) == base), simulation.batch))
    build_jobs.simulate(
        _shorten_cast(cast, 1).simulation, base, indices[:1], device
    )  # the kernel is compiled once
    done, seconds = _time_call(partial(build_jobs.simulate, simulation, base, indices, device))
    for outcome in done.outcomes:
        if outcome.sequence is not None:
            return _Run(
                index=outcome.member.index,
                sequence=outcome.sequence,
                seconds=seconds / len(indices),
            )
    raise FlagdataError(
        "no sequence could be simulated", where=simulation.name, fix="correct the scene"
    )


def _film_cost(recipe: DatasetRecipe, cast: Cast, run: _Run, device: str) -> tuple[float, float]:
    """Seconds and bytes of a film of few frames, with the whole sequence's anemometer."""
    members = ((cast, run.index, "0" * 32),)
    film = next(Sequences(recipe=recipe, side=cast.side.name, members=members).films())
    build_jobs.film(recipe, film, run.sequence, device)  # the renderer starts once
    filmed, seconds = _time_call(partial(build_jobs.film, recipe, film, run.sequence, device))
    return seconds, len(filmed.data)


def _time_call(function: Callable[[], T]) -> tuple[T, float]:
    begun = time.perf_counter()
    return function(), time.perf_counter() - begun


def _stored_size(sequence: MeshSequence | RaggedMeshSequence) -> float:
    """Measures the size of a sequence in the lake [B]."""
    with tempfile.TemporaryDirectory(prefix="flagdata-plan-") as folder:
        path = Path(folder) / "sequence.zarr"
        write_meshes(path, sequence)
        return sum(file.stat().st_size for file in files_of(path))


def _line(of_few: float, of_more: float, frames: int) -> float:
    """Extrapolates linearly to `frames` frames from two smaller numbers of them; never below the
    larger of the two."""
    return max(of_few, of_more, of_few + (of_more - of_few) / (_MORE - _FEW) * (frames - _FEW))
