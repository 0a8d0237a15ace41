"""Who is simulated: the recipe of each side's sequences, or of each of its sessions or groups."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from flagdata.core.rng import child_seed, stream
from flagdata.errors import RefusedError
from flagdata.lake import Lake
from flagdata.recipes.documents import column_json
from flagdata.recipes.typed_tables import Range
from sim.datasets.dataset_recipe import DatasetRecipe, GroupSpec, SessionSpec, Side
from sim.run.members import Crew
from sim.run.publish import member_artifact
from sim.run.simulation_recipe import MaterialSpec
from sim.run.simulation_recipe import Recipe as Simulation

IN_PLACE_OF = "in_place_of"
"""Entry in the report of a sequence that others failed before: index → why, of the members whose
place it takes."""


@dataclass(frozen=True, kw_only=True)
class Cast:
    """Sequences that are simulated by one recipe.

    Attributes:
        side: they belong to.
        session: number of their session on that side; None where each stands alone.
        simulation: its `count` is how many are wanted.
        stated: what was drawn for all of them, name → value, SI; it goes into the ground truth of
            their films.
    """

    side: Side
    session: int | None
    simulation: Simulation
    stated: Mapping[str, float] = field(default_factory=dict)


def casts(recipe: DatasetRecipe) -> Iterator[Cast]:
    """Yields all sequences of a data set: by side, then by session or group. No two sides share a
    seed."""
    for side in recipe.sides:
        root = replace(recipe.simulation, name=f"{recipe.name}-{side.name}", title=recipe.title)
        if recipe.groups is not None:
            yield from _groups(recipe, recipe.groups, side, root)
            continue
        if recipe.sessions is None or not side.sessions:
            seed = child_seed(recipe.seed, "sequences", side.name)
            yield Cast(
                side=side, session=None, simulation=replace(root, seed=seed, count=side.sequences)
            )
            continue
        for session in range(side.sessions):
            seed = child_seed(recipe.seed, "sequences", side.name, session)
            count = len(range(session, side.sequences, side.sessions))
            simulation = _of_session(replace(root, seed=seed, count=count), recipe.sessions)
            yield Cast(
                side=side,
                session=session,
                simulation=replace(simulation, name=f"{root.name}-{session:02d}"),
            )


def _groups(
    recipe: DatasetRecipe, groups: GroupSpec, side: Side, root: Simulation
) -> Iterator[Cast]:
    """Yields the sequences of a side, a batch at a time."""
    for number, first in enumerate(range(0, side.sequences, root.batch)):
        simulation = replace(
            root, name=f"{root.name}-{number:03d}", count=min(root.batch, side.sequences - first)
        )
        yield of_group(
            simulation, groups, side, seed=child_seed(recipe.seed, "sequences", side.name, number)
        )


def of_group(simulation: Simulation, groups: GroupSpec, side: Side, *, seed: int) -> Cast:
    """Sequences with the height, the attachment and the rate that a group of this seed draws, as
    long as before [s]."""

    def drawn(name: str) -> float:
        return stream(seed, "group", name).random()

    height, time = groups.height, simulation.time
    rate = groups.rates[int(drawn("rate") * len(groups.rates))]
    scene = replace(
        simulation.scene,
        height=height.at(drawn("height")) if isinstance(height, Range) else height,
        attachment=groups.attachments[int(drawn("attachment") * len(groups.attachments))],
    )
    time = replace(time, rate=rate, frames=max(1, round(time.frames / time.rate * rate)))
    return Cast(
        side=side,
        session=None,
        simulation=replace(simulation, seed=seed, scene=scene, time=time),
        stated={"width": scene.width, "height": scene.height},
    )


def _of_session(simulation: Simulation, spec: SessionSpec) -> Simulation:
    """Returns the recipe of one session: one flag, drawn once, in winds about one mean."""
    drawn = Crew(replace(simulation, seed=child_seed(simulation.seed, "session"))).member(0)
    mean = drawn.parameters["wind_speed"]
    if not isinstance(mean, float):
        raise TypeError("a member's wind speed is a number")
    around = Range(low=mean * (1 - spec.spread), high=mean * (1 + spec.spread))
    return replace(
        simulation,
        material=MaterialSpec(bases=(drawn.scene.material,)),
        wind=replace(simulation.wind, speed=around),
        batch=min(simulation.batch, simulation.count),
    )


@dataclass(kw_only=True)
class Roll:
    """Which members of a cast are there: the first of its recipe that do not fail.

    A member that diverges or crumples is left out, and the next index takes its place; since
    failing is a matter of recipe and index alone, an interrupted build and an unbroken one choose
    the same.

    Attributes:
        cast: whose.
        ids: index → identity.
        done: indices that are in the lake.
        failed: indices that made no meshes, with why.
    """

    cast: Cast
    ids: dict[int, str] = field(default_factory=dict)
    done: set[int] = field(default_factory=set)
    failed: dict[int, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._crew = Crew(self.cast.simulation)
        self._recipe = self.cast.simulation.identity()

    @property
    def chosen(self) -> list[int]:
        """Indices of the sequences, as many as are wanted.

        Raises:
            RefusedError: more than a quarter of the members failed.
        """
        count, limit = self.cast.simulation.count, len(self.candidates)
        chosen: list[int] = []
        index = 0
        while len(chosen) < count:
            if index >= limit:
                first = next(iter(self.failed.values()))
                raise RefusedError(
                    f"{len(self.failed)} of {limit} sequences failed; the first: {first}",
                    where=self.cast.simulation.name,
                    fix="declare more damping or smaller steps in the scene",
                )
            if index not in self.failed:
                chosen.append(index)
            index += 1
        return chosen

    @property
    def in_one_batch(self) -> bool:
        """Whether all of its sequences are simulated together, those in place of any that fail
        too."""
        return self.cast.simulation.count <= self.cast.simulation.batch

    @property
    def candidates(self) -> range:
        """Indices among which sequences are chosen: some may fail."""
        count = self.cast.simulation.count
        return range(count + max(4, math.ceil(count / 4)))

    def pending(
        self, in_lake: Collection[str], in_shard: Collection[str] | None = None
    ) -> list[int]:
        """Returns the chosen members that are not in the lake.

        Args:
            in_lake: artifact ids that are there, and whole.
            in_shard: artifact ids that are to be made; None for all.
        """
        self.done |= {index for index in self.chosen if self.id(index) in in_lake}
        return [
            i
            for i in self.chosen
            if i not in self.done and (in_shard is None or self.id(i) in in_shard)
        ]

    def id(self, index: int) -> str:
        """Returns the identity of a member's mesh sequence."""
        if index not in self.ids:
            simulation = self.cast.simulation
            self.ids[index] = member_artifact(
                simulation, self._recipe, index, self._crew.seed(index)
            ).id
        return self.ids[index]

    @property
    def crew(self) -> Crew:
        """The members."""
        return self._crew


def recall_failures(lake: Lake, rolls: Sequence[Roll], *, branch: str) -> None:
    """Notes the members that failed in earlier builds, so that they are not simulated again to fail
    again.

    The reports of the sequences that took their places name them (`IN_PLACE_OF`).

    Raises:
        CorruptError: a report that cannot be read.
    """
    of = {roll.id(index): roll for roll in rolls for index in roll.candidates}
    rows = lake.rows({"artifact": list(of)}, at=branch, columns=["artifact", "report"])
    for artifact, report in zip(
        rows["artifact"].to_pylist(), rows["report"].to_pylist(), strict=True
    ):
        if report is not None:
            failed = column_json(report, "report", artifact=artifact).get(IN_PLACE_OF, {})
            of[artifact].failed |= {int(index): why for index, why in failed.items()}
