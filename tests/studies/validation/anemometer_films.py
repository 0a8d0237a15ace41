"""Films that judge the flag as an anemometer: a flag on several days and from several places, and
another flag.

All of them are simulated by the recipe of the data set `gusty`, a cup anemometer beside the flag:

| film | flag | camera | light | gusts |
|---|---|---|---|---|
| gusty-test-00000 | drawn | drawn | drawn | ten minutes; those of `flagdata build gusty` for the recipe's own seed |
| day | the same | the same | another | others, of a mean within 25 % |
| light | the same | the same | the same | the first part of the day's |
| place | the same | another | another | the day's |
| flag | another | the same | another | others |

A film that is in the lake is not made again, so that a run that was stopped goes on.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from flagdata.core.rng import child_seed
from flagdata.core.schema import Kind
from flagdata.lake import Lake, MeshSequence, read_meshes
from flagdata.recipes.typed_tables import Range
from flagdata.record import Record
from flagdata.timebase import NANOSECONDS
from sim.assets import Assets
from sim.datasets import (
    EPOCH,
    Cast,
    DatasetRecipe,
    PlannedFilm,
    Roll,
    Sequences,
    build_jobs,
    casts,
    load,
)
from sim.render import RenderPrior
from sim.run import Crew, MaterialSpec
from sim.run import Recipe as Simulation
from sim.run.publish import publish

FIRST = "gusty-test-00000"
"""Name that `flagdata build gusty` gives its film."""
DAY, LIGHT, PLACE, FLAG = "day", "light", "place", "flag"
SECONDS = {DAY: 60.0, LIGHT: 36.0, PLACE: 36.0, FLAG: 48.0}
"""Length of the films beside the first [s]."""
_SETTLED = 10.0
"""s before another day's film that are simulated and not kept."""
_ABOUT = 0.25
"""Share of the first film's mean wind within which another day's lies."""
_DAY = 86_400 * NANOSECONDS
_OF_LIGHT = (
    "sun_height",
    "sun_radius",
    "sun_azimuth",
    "sun_strength",
    "sun_softness",
    "sky_strength",
    "exposure_bias",
    "exposure_time",
)


@dataclass(frozen=True, kw_only=True)
class Shot:
    """A film to be made.

    Attributes:
        recipe: whose camera and light it has.
        film: which.
        frames: of its sequence that it shows, from the first on.
    """

    recipe: DatasetRecipe
    film: PlannedFilm
    frames: int


def shots(seed: int, *, first: float) -> Iterator[tuple[str, Shot]]:
    """The films of one flag by name; the sequence of each follows from its cast.

    Args:
        seed: of the recipe in place of its own.
        first: length of the first film [s].
    """
    recipe = replace(load("gusty"), seed=seed)
    (cast,) = casts(recipe)
    rate = cast.simulation.time.rate
    time = replace(cast.simulation.time, frames=round(first * rate))
    cast = replace(cast, simulation=replace(cast.simulation, time=time))
    (index,) = Roll(cast=cast).chosen
    member = Crew(cast.simulation).member(index)
    own = next(Sequences(recipe=recipe, side="test", members=((cast, index, "0" * 32),)).films())
    day = _of(
        cast,
        "day",
        SECONDS[DAY],
        child_seed(seed, "another day"),
        material=MaterialSpec(bases=(member.scene.material,)),
        mean=member.wind_speed,
    )
    flag = _of(
        cast,
        "flag",
        SECONDS[FLAG],
        child_seed(seed, "another flag"),
        material=cast.simulation.material,
        mean=member.wind_speed,
    )
    lit = replace(recipe, prior=_in_other_light(recipe, child_seed(seed, "another light")))
    elsewhere = child_seed(seed, "another place")
    yield own.name, Shot(recipe=recipe, film=own, frames=time.frames)
    wanted = (
        (DAY, lit, day, own.look, 1),
        (LIGHT, recipe, day, own.look, 1),
        (PLACE, recipe, day, elsewhere, 2),
        (FLAG, lit, flag, own.look, 3),
    )
    for name, shown, simulated, look, number in wanted:
        film = replace(
            own,
            name=name,
            cast=simulated,
            index=0,
            sequence_seed=child_seed(simulated.simulation.seed, "member", 0),
            begin=EPOCH + number * _DAY,
            look=look,
            seed=child_seed(seed, "film", name),
            filming=shown.filming(),
        )
        yield name, Shot(recipe=shown, film=film, frames=round(SECONDS[name] * rate))


def _of(
    cast: Cast, name: str, seconds: float, seed: int, *, material: MaterialSpec, mean: float
) -> Cast:
    simulation = cast.simulation
    around = Range(low=mean * (1 - _ABOUT), high=mean * (1 + _ABOUT))
    own = replace(
        simulation,
        name=f"{simulation.name}-{name}",
        seed=seed,
        count=1,
        batch=1,
        material=material,
        wind=replace(simulation.wind, speed=around),
        time=replace(
            simulation.time, settle=_SETTLED, frames=round(seconds * simulation.time.rate)
        ),
    )
    return replace(cast, simulation=own)


def _in_other_light(recipe: DatasetRecipe, look: int) -> RenderPrior:
    drawn = recipe.prior.draw(look, Assets(photos=recipe.photos))
    return recipe.prior.with_quantities(
        {name: getattr(drawn, name) for name in _OF_LIGHT}, source="another day"
    )


def make(folder: Path, seed: int, *, first: float = 600.0) -> Lake:
    """The lake with the films of one flag, those that are missing made.

    Args:
        first: length of the first film [s].
    """
    lake = Lake.open(folder) if folder.exists() else Lake.create(folder)
    sequences: dict[str, tuple[str, MeshSequence]] = {}
    for name, shot in shots(seed, first=first):
        if name in set(lake.rows({"kind": Kind.RECORDING}, columns=["name"])["name"].to_pylist()):
            continue
        simulation = shot.film.cast.simulation
        if simulation.name not in sequences:
            sequences[simulation.name] = _sequence(lake, simulation, shot)
        identity, sequence = sequences[simulation.name]
        film = replace(shot.film, sequence=identity)
        shown = replace(
            sequence, time=sequence.time[: shot.frames], positions=sequence.positions[: shot.frames]
        )
        done = build_jobs.film(shot.recipe, film, shown, "cpu")
        with lake.transaction(f"film {name}") as transaction:
            staged = transaction.staging(".mcap")
            staged.write_bytes(done.data)
            stored = transaction.put(staged)
            times = Record.open(lake.object_path(stored)).frame_times
            rate = (len(times) - 1) * NANOSECONDS / (done.end - done.start)
            row = replace(
                film.artifact(),
                object=stored,
                start=done.start,
                end=done.end,
                rate=rate,
                frame_count=len(times),
                parameters=done.parameters,
            )
            transaction.add(row)
    return lake


def _sequence(lake: Lake, simulation: Simulation, shot: Shot) -> tuple[str, MeshSequence]:
    roll = Roll(cast=shot.film.cast)
    identity = roll.id(shot.film.index)
    rows = lake.rows({"artifact": identity}, columns=["object"]).to_pylist()
    if not rows:
        done = build_jobs.simulate(simulation, 0, [shot.film.index], "cpu")
        publish(lake, simulation, done.outcomes, step=done.step, branch="main")
        rows = lake.rows({"artifact": identity}, columns=["object"]).to_pylist()
    sequence = read_meshes(lake.whole_object(rows[0]["object"]))
    if not isinstance(sequence, MeshSequence):
        raise TypeError("a simulation's meshes are of one topology")
    return identity, sequence
