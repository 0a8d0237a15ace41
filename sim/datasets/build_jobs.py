"""What workers do: pure functions from a recipe and a number to meshes and bytes (`simulate`,
`film`), and the same put into a lake's store (`put_sequences`, `put_film`), so that only rows go
back to the process that commits them.

Renderers and crews are kept from one job to the next, since they take time to make; they change no
result. Torch is left on one thread for good, since the last bits of its sums depend on how many it
has.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from socket import gethostname
from typing import Any

import torch

from flagdata.core.provenance import canonical
from flagdata.dataset.clips import clip_rows
from flagdata.errors import NotFoundError
from flagdata.lake import Artifact, Lake
from flagdata.lake.deposit import Deposit, deposit
from flagdata.lake.mesh_sequences import MeshSequence, RaggedMeshSequence, read_meshes
from flagdata.record import Record
from flagdata.timebase import NANOSECONDS
from sim.assets import Assets
from sim.datasets import anemometer, camera_picture
from sim.datasets.dataset_films import PlannedFilm
from sim.datasets.dataset_recipe import DatasetRecipe
from sim.datasets.film_record import Content, parameters_of, record_bytes, texts_of
from sim.render import RENDERERS, Meshes, RenderParameters
from sim.run.member_batch import BatchOutcome, Stepper, run
from sim.run.members import Crew
from sim.run.publish import Deposited, deposit_meshes
from sim.run.simulation_recipe import Recipe as Simulation
from sim.run.simulation_recipe import Shape

_KEPT = 8  # crews
_own = threading.local()


@dataclass(frozen=True, kw_only=True)
class Simulated:
    """A batch of members after a run.

    Attributes:
        name: of their recipe.
        outcomes: what became of each.
        step: of the integrator [s].
    """

    name: str
    outcomes: tuple[BatchOutcome, ...]
    step: float


@dataclass(frozen=True, kw_only=True)
class Filmed:
    """A recording.

    Attributes:
        film: which.
        data: the record's bytes.
        start, end: of its frames [UTC ns].
        parameters: θ, ζ and the instruments' draws: canonical JSON.
    """

    film: PlannedFilm
    data: bytes
    start: int
    end: int
    parameters: str


@dataclass(frozen=True, kw_only=True)
class PutSequences:
    """Members whose meshes are in a lake's store, without a row yet.

    Attributes:
        name: of their recipe.
        stored: index → row and object.
        failed: index → why it has no meshes.
    """

    name: str
    stored: Mapping[int, Deposited]
    failed: Mapping[int, str]


@dataclass(frozen=True, kw_only=True)
class PutFilm:
    """A recording that is in a lake's store, and the rows that are to refer to it."""

    recording: Artifact
    clips: tuple[Artifact, ...]
    put: Deposit


def simulate(simulation: Simulation, base: int, indices: Sequence[int], device: str) -> Simulated:
    """Simulate members of one material of a recipe together."""
    torch.set_num_threads(1)
    crew, steppers = _crew(simulation)
    if base not in steppers:
        steppers[base] = Stepper.of(crew, base)
    members = [crew.member(index) for index in indices]
    outcomes = run(crew, steppers[base], members, size=simulation.batch, device=device)
    return Simulated(name=simulation.name, outcomes=tuple(outcomes), step=steppers[base].step)


def film(
    recipe: DatasetRecipe,
    job: PlannedFilm,
    sequence: MeshSequence | RaggedMeshSequence,
    device: str,
) -> Filmed:
    """Films a sequence.

    Raises:
        FlagdataError: a renderer that is not installed or fails, or an asset that is not there.
    """
    torch.set_num_threads(1)
    assets = Assets(photos=recipe.photos)
    zeta = recipe.prior.draw(job.look, assets)
    crew, _ = _crew(job.cast.simulation)
    member = crew.member(job.index)
    reading = anemometer.read(
        recipe.anemometer, crew, member, instrument=job.look, seed=job.seed, begin=job.begin
    )
    drawn = camera_picture.settings(recipe.camera, seed=job.look)
    rendered = shot(recipe, job, sequence, zeta, assets, device=device).cpu().numpy()
    frames = camera_picture.encode_pictures(rendered, drawn, recipe.camera, seed=job.seed)
    parameters = parameters_of(
        member, zeta, {**job.cast.stated, **reading.parameters, **drawn}, recipe.anemometer.truth
    )
    times = job.begin + sequence.time
    content = Content(
        film=job,
        times=times,
        wind=reading.series,
        parameters=parameters,
        zeta=zeta,
        camera=recipe.camera,
        frames=frames,
    )
    return Filmed(
        film=job,
        data=record_bytes(content),
        start=int(times[0]),
        end=int(times[-1]),
        parameters=canonical({**parameters, **texts_of(member, zeta)}),
    )


def put_sequences(
    lake: str, simulation: Simulation, base: int, indices: Sequence[int], device: str
) -> PutSequences:
    """Simulates members as `simulate`, and puts their meshes into the lake's store.

    Raises:
        NotFoundError: this process does not see the lake.
        FlagdataError: no space, no permission.
    """
    done = simulate(simulation, base, indices, device)
    failed = {o.member.index: o.failure[1] for o in done.outcomes if o.failure is not None}
    stored = deposit_meshes(_lake(lake), simulation, done.outcomes, step=done.step)
    return PutSequences(name=simulation.name, stored=stored, failed=failed)


def put_film(
    lake: str, recipe: DatasetRecipe, job: PlannedFilm, meshes: str, device: str
) -> PutFilm:
    """Films a sequence of the lake as `film`, and puts the record into its store.

    Args:
        meshes: the sequence's object.

    Raises:
        CorruptError: the object was damaged, and must not be filmed.
        NotFoundError: this process does not see the lake.
        FlagdataError: a renderer that is not installed or fails, no space, no permission.
    """
    opened = _lake(lake)
    sequence = read_meshes(opened.whole_object(meshes))
    done = film(recipe, job, sequence, device)
    put = deposit(opened, ".mcap", lambda path: path.write_bytes(done.data))
    record = Record.open(opened.record_place(put.name))
    times = record.frame_times
    rate = (len(times) - 1) * NANOSECONDS / (done.end - done.start) if len(times) > 1 else None
    recording = replace(
        job.artifact(),
        object=put.name,
        start=done.start,
        end=done.end,
        rate=rate,
        parameters=done.parameters,
    )
    return PutFilm(recording=recording, clips=tuple(clip_rows(record, recording)), put=put)


def _lake(address: str) -> Lake:
    """Opens the lake of this thread's last job again, or another.

    Raises:
        NotFoundError: there is none here.
    """
    lakes: dict[str, Lake] = _own.__dict__.setdefault("lakes", {})
    if address not in lakes:
        try:
            lakes[address] = Lake.open(address)
        except NotFoundError:
            raise NotFoundError(
                "a worker does not see the lake",
                where=f"{address} on {gethostname()}",
                fix="keep the lake in a bucket (s3://bucket/prefix), or in a folder that all "
                "workers share",
            ) from None
    return lakes[address]


def shot(
    recipe: DatasetRecipe,
    job: PlannedFilm,
    sequence: MeshSequence | RaggedMeshSequence,
    zeta: RenderParameters,
    assets: Assets,
    *,
    device: str,
) -> torch.Tensor:
    """Frames (n, height, width, 3) uint8."""
    simulation = job.cast.simulation
    if simulation.scene.shape is Shape.HANGING_CLOTH:
        meshes = Meshes.hanging(sequence, device=device)
    else:
        member = _crew(simulation)[0].member(job.index)
        toward = member.parameters["wind_toward"]
        meshes = Meshes.flag(
            sequence, heading=float(toward) if isinstance(toward, float) else 0.0, device=device
        )
    with torch.no_grad():
        return _renderer(recipe.renderer, assets).render(meshes, zeta)


def _crew(simulation: Simulation) -> tuple[Crew, dict[int, Stepper]]:
    """Returns the crew of a recipe with its steppers, from this thread's cache."""
    crews: dict[str, tuple[Crew, dict[int, Stepper]]] = _own.__dict__.setdefault("crews", {})
    key = canonical({**simulation.identity(), "batch": simulation.batch, "name": simulation.name})
    if key not in crews:
        while len(crews) >= _KEPT:
            crews.pop(next(iter(crews)))
        crews[key] = (Crew(simulation), {})
    return crews[key]


def _renderer(name: str, assets: Assets) -> Any:
    """Returns this thread's renderer: Blender's has a process of its own, which answers one request
    at a time."""
    renderers: dict[tuple[str, Assets], Any] = _own.__dict__.setdefault("renderers", {})
    if (name, assets) not in renderers:
        renderers[name, assets] = RENDERERS[name](assets=assets)
    return renderers[name, assets]
