"""One film a recording, each of a sequence, under a file name that reveals nothing about it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from flagdata.core.rng import child_seed, stream
from flagdata.core.schema import Kind
from flagdata.lake import Artifact
from flagdata.timebase import NANOSECONDS, parse
from sim.datasets.cast import Cast
from sim.datasets.dataset_recipe import DatasetRecipe

EPOCH = parse("2020-01-01T00:00:00Z")
"""When a simulation begins that has no day of its own."""
_DAY = 86_400 * NANOSECONDS
_MORNING = 9 * 3600 * NANOSECONDS  # when a session begins, after midnight
_APART = 900 * NANOSECONDS  # from one recording of a session to the next


@dataclass(frozen=True, kw_only=True)
class PlannedFilm:
    """A recording to be made.

    Attributes:
        name: of the recording; its number is its place in an order that was shuffled.
        dataset: that it is built for.
        cast: of the sequence.
        index: of the sequence in its cast.
        sequence: artifact of the mesh sequence.
        sequence_seed: of the member; the recording's too, so that splits keep its films together.
        seed: of the camera's noise and the anemometer's.
        look: seed of ζ and of what the instruments are; in a session the camera and the anemometer
            stay the same.
        begin: instant at which the simulation's time is 0 [UTC ns].
        filming: all that shapes it beside the sequence and the seeds.
    """

    name: str
    dataset: str
    cast: Cast
    index: int
    sequence: str
    sequence_seed: int
    seed: int
    look: int
    begin: int
    filming: dict[str, Any]

    @property
    def session(self) -> str | None:
        """One set-up of camera, flag and light."""
        session = self.cast.session
        return None if session is None else f"{self.cast.simulation.name}"

    def artifact(self) -> Artifact:
        """Returns the recording's row without its result; its identity is complete."""
        return Artifact(
            kind=Kind.RECORDING,
            name=self.name,
            parents=(self.sequence,),
            seed=self.sequence_seed,
            session=self.session,
            dataset=self.dataset,
            side=self.cast.side.name,
            frame_count=self.cast.simulation.time.frames,
            recipe={**self.filming, "seed": self.seed, "look": self.look, "begin": self.begin},
        )


@dataclass(frozen=True, kw_only=True)
class Sequences:
    """The sequences of a side, dealt in turn to its films."""

    recipe: DatasetRecipe
    side: str
    members: tuple[tuple[Cast, int, str], ...]
    """Cast, index and artifact of each, the sessions' sequences one after another."""

    @cached_property
    def filming(self) -> dict[str, Any]:
        return self.recipe.filming()

    def films(self) -> Iterator[PlannedFilm]:
        """Yields films in the order of their names, which is shuffled so that neighbours are
        unrelated."""
        recipe, renders = self.recipe, self.recipe.side(self.side).renders
        order = stream(recipe.seed, "order", self.side).permutation(renders).tolist()
        for position, number in enumerate(order):
            cast, index, sequence = self.members[number % len(self.members)]
            take = number // len(self.members)
            seed = child_seed(recipe.seed, "film", self.side, number)
            look = seed if cast.session is None else child_seed(cast.simulation.seed, "look", take)
            yield PlannedFilm(
                name=f"{recipe.name}-{self.side}-{position:05d}",
                dataset=recipe.name,
                cast=cast,
                index=index,
                sequence=sequence,
                sequence_seed=child_seed(cast.simulation.seed, "member", index),
                seed=seed,
                look=look,
                begin=self._begin(cast, index),
                filming=self.filming,
            )

    def _begin(self, cast: Cast, index: int) -> int:
        """Sessions are on days of their own, the sides' one after another; their recordings follow
        in the morning."""
        if cast.session is None:
            return EPOCH
        before = 0
        for side in self.recipe.sides:
            if side.name == self.side:
                break
            before += side.sessions
        return EPOCH + (before + cast.session) * _DAY + _MORNING + index * _APART
