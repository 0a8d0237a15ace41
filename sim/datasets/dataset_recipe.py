"""What a data set's recipe says. The form of the file is in `sim.datasets.dataset_toml`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cache, cached_property
from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta

from flagdata.core.json_values import json_values
from flagdata.core.provenance import canonical, digest, file_hash, recipe_hash
from flagdata.core.rng import child_seed
from flagdata.core.shell import command_line
from flagdata.errors import UsageError
from flagdata.recipes.typed_tables import (
    Count,
    NotNegative,
    NotNegativeQuantity,
    Positive,
    Quantity,
)
from flagdata.record.writer import Coding
from sim.assets.photos import Photos
from sim.render.render_prior import RenderPrior
from sim.run.simulation_recipe import Attachment
from sim.run.simulation_recipe import Recipe as Simulation

_NOISE = Meta(ge=0.0, le=128.0)
RECIPE_VERSION = 2
"""Raised whenever the same recipe makes other bytes."""
_SESSIONS_DRAWN = 2
"""Raised whenever the same recipe of sessions draws other flags and winds; 1 drew a session's wind
from its first member's stream."""


class Truth(StrEnum):
    """What the ground truth of a clip is."""

    STATED = "stated"
    """The wind that was simulated, exactly."""
    MEASURED = "measured"
    """What the anemometer measured, with its uncertainty, as for a real recording."""


@dataclass(frozen=True, kw_only=True)
class Side:
    """One side of the split.

    Attributes:
        name: "train", "validation", "test".
        sequences: mesh sequences, each of its own seed.
        renders: recordings in all; each sequence has as many as any other, or one more.
        sessions: set-ups that the sequences are dealt to in turn; 0 where each sequence stands
            alone.
    """

    name: str
    sequences: int
    renders: int
    sessions: int = 0


@dataclass(frozen=True, kw_only=True)
class CameraSpec:
    """The camera behind the picture.

    Attributes:
        coding: "jpeg", each frame by itself, or "h264", as field cameras do, in a tenth of the
            bytes.
        jpeg_quality: 1 to 100; less where a frame would not fit into its slot. Of "jpeg" alone.
        rate_factor: x264's constant rate factor, 0 to 51; smaller is better. Of "h264" alone.
        read_noise: standard deviation that does not depend on the light, in 8-bit steps.
        shot_noise: of a full-scale (255) pixel, in 8-bit steps; its square is in proportion to the
            light.
        frame_slot: length of every stored JPEG, so that it reveals nothing; see
            `sim.datasets.camera_picture.jpegs`. Records are a whole multiple of it long, those of
            H.264 too [B].
    """

    coding: Coding = Coding.JPEG
    jpeg_quality: Annotated[Quantity, Meta(ge=1.0, le=100.0)] = 90.0
    rate_factor: Annotated[Quantity, Meta(ge=0.0, le=51.0)] = 20.0
    read_noise: Annotated[Quantity, _NOISE] = 0.0
    shot_noise: Annotated[Quantity, _NOISE] = 0.0
    frame_slot: Count = 32768


@dataclass(frozen=True, kw_only=True)
class AnemometerSpec:
    """The anemometer beside the flag.

    Attributes:
        truth: see `Truth`.
        rate: samples a second [Hz]; each is the mean of the time since the one before.
        before: for how long it ran before the first frame, where the wind is constant [s].
        noise: standard deviation of a sample [m/s].
        resolution: step of its readings [m/s].
        accuracy: standard uncertainty that its data sheet states [m/s].
        effects: names of `sim.effects.SENSOR_EFFECTS` → parameter → value, drawn for each
            recording.
    """

    truth: Truth = Truth.STATED
    rate: Positive = 1.0
    before: NotNegative = 75.0
    noise: NotNegativeQuantity = 0.0
    resolution: Positive = 0.1
    accuracy: NotNegative = 0.2
    effects: Mapping[str, Mapping[str, Quantity]]


@dataclass(frozen=True, kw_only=True)
class SessionSpec:
    """What the sequences of one session have in common beside the flag, camera and light, which are
    the same.

    Attributes:
        spread: the sequences' winds lie within this share of the session's mean, either way.
    """

    spread: NotNegative = 0.25


@dataclass(frozen=True, kw_only=True)
class GroupSpec:
    """What sequences that are simulated in one batch have in common, drawn for each batch of a
    side.

    A batch has one mesh and one rate, so these cannot differ from member to member. All else
    differs.

    Attributes:
        height: of the cloth [m].
        rates: of frames [Hz], of which each group takes one with equal chance; a rate that is
            listed twice is twice as likely. Films of all rates are as long as the scene's [s].
        attachments: where a flag is held, of which each group takes one with equal chance.
    """

    height: Quantity
    rates: tuple[float, ...]
    attachments: tuple[Attachment, ...]


@dataclass(frozen=True, kw_only=True)
class DatasetRecipe:
    """A data set.

    Attributes:
        name: what its artifacts are called after.
        title: one line for people.
        licence: of what is built.
        seed: all random streams follow from it.
        renderer: a name of `sim.render.RENDERERS`.
        simulation: the scene's recipe; its seed and count are the sides' own.
        prior: of ζ.
        photos: a folder of photographs in place of procedural backgrounds.
        sessions: None where sequences stand alone.
        groups: None where all sequences have the scene's height, rate and attachment.
    """

    name: str
    title: str
    licence: str
    seed: int
    renderer: str
    simulation: Simulation
    prior: RenderPrior
    sides: tuple[Side, ...]
    camera: CameraSpec
    anemometer: AnemometerSpec
    photos: Path | None = None
    sessions: SessionSpec | None = None
    groups: GroupSpec | None = None

    def side(self, name: str) -> Side:
        """Returns the side of that name."""
        return next(side for side in self.sides if side.name == name)

    def filming(self) -> dict[str, Any]:
        """Returns all that shapes a recording besides its mesh sequence and its seed, as JSON."""
        camera, anemometer = self.camera, self.anemometer
        return {
            "film": RECIPE_VERSION,
            "renderer": self.renderer,
            "prior": self.prior.identity(),
            "photos": None if self.photos is None else _content(self.photos),
            "camera": {
                **_coding(camera),
                "read_noise": json_values(camera.read_noise),
                "shot_noise": json_values(camera.shot_noise),
                "frame_slot": camera.frame_slot,
            },
            "anemometer": {
                "truth": anemometer.truth.value,
                "rate": anemometer.rate,
                "before": anemometer.before,
                "noise": json_values(anemometer.noise),
                "resolution": anemometer.resolution,
                "accuracy": anemometer.accuracy,
                "effects": {
                    name: json_values(parameters) for name, parameters in anemometer.effects.items()
                },
            },
        }

    def identity(self) -> dict[str, Any]:
        """Returns all that shapes the data set, as JSON."""
        return {
            "dataset": RECIPE_VERSION,
            "name": self.name,
            "seed": self.seed,
            "simulation": self.simulation.identity(),
            "filming": self.filming(),
            "sessions": None
            if self.sessions is None
            else {"drawn": _SESSIONS_DRAWN, **vars(self.sessions)},
            "sides": [vars(side).copy() for side in self.sides],
            **_group_description(self.groups, self.simulation.batch),
        }

    @cached_property
    def hash(self) -> str:
        """SHA-256 of the identity."""
        return recipe_hash(self.identity())


def _group_description(groups: GroupSpec | None, batch: int) -> dict[str, Any]:
    """Describes what is drawn per batch, and the batch size; nothing where there are no groups."""
    if groups is None:
        return {}
    return {
        "groups": {
            "size": batch,
            "height": json_values(groups.height),
            "rates": list(groups.rates),
            "attachments": [attachment.value for attachment in groups.attachments],
        }
    }


def _coding(camera: CameraSpec) -> dict[str, Any]:
    if camera.coding is Coding.JPEG:
        return {"jpeg_quality": json_values(camera.jpeg_quality)}
    return {"coding": camera.coding.value, "rate_factor": json_values(camera.rate_factor)}


@cache
def _content(folder: Path) -> str:
    """Hashes the names and bytes of a folder's photographs (SHA-256)."""
    return digest(canonical({name: file_hash(folder / name) for name in Photos.of(folder).members}))


def with_counts(
    recipe: DatasetRecipe, *, sequences: int | None, films: int | None
) -> DatasetRecipe:
    """Returns the recipe with so many sequences and films in all, which is another data set: its
    name says the counts, and its seed is its own, so that a lake can hold several.

    Args:
        sequences: of all sides together; None for as many as the recipe has.
        films: of all sides together; None for as many a sequence as the recipe has.

    Raises:
        UsageError: fewer sequences than sides, or fewer films than sequences.
    """
    if sequences is None and films is None:
        return recipe
    before = sum(side.sequences for side in recipe.sides)
    sequences = before if sequences is None else sequences
    if films is None:
        films = max(
            sequences, round(sum(side.renders for side in recipe.sides) * sequences / before)
        )
    if sequences < len(recipe.sides):
        raise UsageError(
            f"{sequences} sequences cannot be on {len(recipe.sides)} sides",
            where="--sequences",
            fix=f"give {command_line('--sequences', len(recipe.sides))} or more: "
            + ", ".join(side.name for side in recipe.sides),
        )
    if films < sequences:
        raise UsageError(
            f"{films} films are fewer than the {sequences} sequences, and each sequence is filmed",
            where="--films",
            fix=f"give {command_line('--films', sequences)} or more, or "
            f"{command_line('--sequences', films)} or fewer",
        )
    of_sides = _dealt(
        sequences, [side.sequences for side in recipe.sides], least=[1] * len(recipe.sides)
    )
    filmed = _dealt(films, [side.renders for side in recipe.sides], least=of_sides)
    sides = tuple(
        replace(
            side,
            sequences=count,
            renders=renders,
            sessions=side.sessions
            and max(1, min(count, round(side.sessions * count / side.sequences))),
        )
        for side, count, renders in zip(recipe.sides, of_sides, filmed, strict=True)
    )
    if sides == recipe.sides:
        return recipe
    seed = child_seed(recipe.seed, "counts", sequences, films)
    return replace(recipe, name=f"{recipe.name}-{sequences}x{films}", seed=seed, sides=sides)


def _dealt(total: int, shares: Sequence[int], *, least: Sequence[int]) -> list[int]:
    """Divides a total in proportion to shares, none below its least, the largest remainders
    first."""
    exact = [total * share / sum(shares) for share in shares]
    counts = [max(floor, int(part)) for floor, part in zip(least, exact, strict=True)]
    while sum(counts) < total:
        most = max(range(len(counts)), key=lambda side: exact[side] - counts[side])
        counts[most] += 1
    while sum(counts) > total:
        most = max(
            range(len(counts)),
            key=lambda side: (counts[side] > least[side], counts[side] - exact[side]),
        )
        counts[most] -= 1
    return counts
