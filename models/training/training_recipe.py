"""What is trained on what, as TOML. Parsed here and nowhere else; unknown keys are refused, the
nearest is named.

title, seed [data]       dataset: a data set's name, or a list of them; sequences: of the training
side, all by default [input]      maps: "frames", "spectral-maps", "wave-maps", "flow-maps" or
"flow-maps-3"; size [px], frames; scales, mirror: of crops; variants: crops of each film that are
prepared; conditioned = true: films are made fit as `flagdata measure` does it, at the network's
instants [input.augment.NAME]  of conditioned films, NAME of `models.training.augment.DISTURBANCES`:
share (of the films), low, high [network]    name: of `models.networks.networks_by_name.NETWORKS`;
its other keys are the network's own [loss]       name: "regression", "posterior" or "contrastive";
targets: of `models.networks.targets`; components, margin [optimiser]  rate, decay, batch, epochs;
schedule: "steps" or "cosine"; drop-after: epochs; clip-norm; precision: "float32" or "bfloat16";
patience: epochs without a better validation loss, after which it ends
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, TypeAlias, cast

import torch
from msgspec import Meta

from flagdata.core.json_values import json_values
from flagdata.core.provenance import recipe_hash
from flagdata.core.schema import Kind
from flagdata.core.shell import command_line
from flagdata.errors import InputError, LimitError, NotFoundError, UnknownNameError, UsageError
from flagdata.lake import Lake
from flagdata.lake.matching import Values
from flagdata.recipes.retired_names import NAMES, hashed_name
from flagdata.recipes.shelves import Shelf, is_name, parse_recipe
from flagdata.recipes.typed_tables import WHOLE_LIMIT, Count, Named, Whole, read
from models.conditioning.conditioning import VERSION
from models.maps.crops import Cropping
from models.maps.frontend import RATE_LIMIT, FrontEnd, Maps
from models.networks.learner import NUMBER_LIMIT, Learner, Loss, build
from models.networks.networks_by_name import NETWORKS
from models.networks.targets import TARGETS
from models.training.augment import DISTURBANCES, Augment, Strength

TRAININGS = Shelf(folder="training", noun="training recipe")
RECIPE_VERSION = 1
"""Raised whenever the same recipe and data give other weights."""
FILM_LIMIT = 1 << 28
"""Most values that are prepared of a film: 512 MiB of maps."""
LEAST_BATCH = 2
"""Least clips of a step."""
_LARGEST_STEP = 10.0
"""Largest learning rate and weight decay; the catalog's are of 10⁻³ and 10⁻⁴."""
_Side: TypeAlias = Annotated[int, Meta(ge=4, le=WHOLE_LIMIT)]
_MAPS: tuple[Maps, ...] = ("frames", "spectral-maps", "wave-maps", "flow-maps", "flow-maps-3")


class Schedule(StrEnum):
    """How the learning rate falls."""

    STEPS = "steps"
    """To a tenth after so many epochs, as the paper's."""
    COSINE = "cosine"
    """From a twentieth up to the full rate within the first twentieth of the steps, then down as a
    cosine."""


class Precision(StrEnum):
    """What networks compute in."""

    FLOAT32 = "float32"
    BFLOAT16 = "bfloat16"


@dataclass(frozen=True, kw_only=True)
class DataSpec:
    """Attributes:
    datasets: names of the data sets that are learned from together.
    sequences: of the training side that are used; None for all.
    """

    datasets: tuple[str, ...]
    sequences: int | None = None

    @classmethod
    def of_identity(cls, entry: Mapping[str, Any]) -> DataSpec:
        """Rebuilds what `identity` was made of, as a model's card keeps it."""
        datasets = entry["dataset"]
        return cls(
            datasets=(datasets,) if isinstance(datasets, str) else tuple(datasets),
            sequences=entry["sequences"],
        )

    @property
    def rows(self) -> Values:
        """Returns what rows of the catalog that are of these data sets have in their columns."""
        return {"dataset": self.datasets}

    def where(self, side: str) -> Values:
        """Returns what rows of the catalog that are of a side have in their columns."""
        return {**self.rows, "side": side}

    def check(self, lake: Lake, *, at: str | None) -> None:
        """Checks that a lake has all of these data sets.

        Raises:
            NotFoundError: it has no data set at all.
            UnknownNameError: one that it has not; the nearest is named.
        """
        available = set(
            lake.rows({"kind": Kind.CLIP}, at=at, columns=["dataset"])["dataset"]
            .drop_null()
            .to_pylist()
        )
        for dataset in self.datasets:
            if not available:
                message = (
                    f"the lake has no clips of a data set, and the recipe learns from {dataset!r}"
                )
                fix = f"build it first: {command_line('flagdata', 'build', dataset)}"
                raise NotFoundError(message, where=str(lake.path), fix=fix)
            if dataset not in available:
                raise UnknownNameError.of("data set", dataset, available, where=str(lake.path))

    def identity(self) -> dict[str, Any]:
        """Returns JSON values; one data set is named by itself."""
        dataset = self.datasets[0] if len(self.datasets) == 1 else list(self.datasets)
        return {"dataset": dataset, "sequences": self.sequences}


@dataclass(frozen=True, kw_only=True)
class NetworkSpec:
    """Attributes:
    name: of `NETWORKS`.
    options: what its constructor takes.
    """

    name: str
    options: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class LossSpec:
    """Attributes:
    name: see `models.networks.learner.Loss`.
    targets: what the network estimates; none for the contrastive loss.
    components: of the mixture.
    margin: of the contrastive loss.
    """

    name: Loss = Loss.REGRESSION
    targets: tuple[Annotated[str, Named("target", TARGETS, was=NAMES)], ...] = ()
    components: Count = 6
    margin: Annotated[float, Meta(gt=0.0, le=NUMBER_LIMIT)] = 1.0


@dataclass(frozen=True, kw_only=True)
class OptimiserSpec:
    """Adam's settings.

    Attributes:
        rate: learning rate.
        decay: weight decay, added to the gradient as the paper's Adam does.
        batch: clips a step, all ranks together.
        epochs: at most.
        schedule, drop_after: see `Schedule`; the latter of "steps" alone.
        clip_norm: largest norm of the gradient; None for no limit.
        precision: see `Precision`.
        patience: epochs.
    """

    rate: Annotated[float, Meta(gt=0.0, le=_LARGEST_STEP)] = 1e-2
    decay: Annotated[float, Meta(ge=0.0, le=_LARGEST_STEP)] = 2e-3
    batch: Annotated[int, Meta(ge=LEAST_BATCH, le=WHOLE_LIMIT)] = 32
    epochs: Count = 40
    schedule: Schedule = Schedule.STEPS
    drop_after: Count = 20
    clip_norm: Annotated[float, Meta(gt=0.0, le=NUMBER_LIMIT)] | None = None
    precision: Precision = Precision.FLOAT32
    patience: Count = 10


@dataclass(frozen=True, kw_only=True)
class TrainingRecipe:
    """A training.

    Attributes:
        name: what its model is called.
        title: one line for people.
        seed: of initial weights, crops and orders.
        data, input, network, loss, optimiser: the tables above.
        variants: crops of each film that are prepared; an epoch takes one of them, the next the
            next.
        augment: what happens to films beside crops and mirror images.
    """

    name: str
    title: str
    seed: int
    data: DataSpec
    front_end: FrontEnd
    cropping: Cropping
    variants: int
    augment: Augment
    network: NetworkSpec
    loss: LossSpec
    optimiser: OptimiserSpec

    def identity(self) -> dict[str, Any]:
        """Returns all that shapes the weights beside the data themselves, as JSON."""
        return {
            "training": RECIPE_VERSION,
            "seed": self.seed,
            "data": self.data.identity(),
            "front_end": asdict(self.front_end),
            "cropping": json_values(self.cropping),
            "variants": self.variants,
            **(
                {"augment": self.augment.identity(), "conditioning": VERSION}
                if self.cropping.conditioned
                else {}
            ),
            "network": {"name": self.network.name, "options": dict(self.network.options)},
            "loss": {**asdict(self.loss), "targets": tuple(map(hashed_name, self.loss.targets))},
            "optimiser": asdict(self.optimiser),
        }

    def learner(self) -> Learner:
        """Builds the network with its head, its weights drawn by torch's generator as it stands.

        Raises:
            InputError: options that the network does not take.
        """
        loss = self.loss
        return build(
            self.network.name,
            self.network.options,
            loss=loss.name,
            targets=loss.targets,
            components=loss.components,
            margin=loss.margin,
        )

    def check(self) -> None:
        """Checks that the network takes what the front end gives, by shapes alone, before anything
        is prepared.

        Raises:
            InputError: options or clips that the network does not take.
        """
        try:
            with torch.no_grad(), torch.device("meta"):
                self.learner().network(torch.empty(2, *self.front_end.shape))
        except RuntimeError as error:
            shape = "×".join(map(str, self.front_end.shape))
            raise InputError(
                f"the network {self.network.name} does not take {shape} {self.front_end.maps}: "
                f"{error}",
                where="[network]",
                fix="give it smaller strides, or larger clips",
            ) from None

    @cached_property
    def hash(self) -> str:
        """SHA-256 of the identity."""
        return recipe_hash(self.identity())


def load(source: str) -> TrainingRecipe:
    """Loads the training recipe of that name in the catalog, or of a `.toml` file.

    Raises:
        NotFoundError: no such file.
        UnknownNameError: no such recipe; a key, name or option that is not known.
        InputError, UsageError: a value that does not fit.
    """
    source_text = TRAININGS.find(source)
    return parse(
        source_text.text, name=source_text.name, where=source_text.where, folder=source_text.folder
    )


@dataclass(frozen=True, kw_only=True)
class _TrainingTables:
    """The tables of a training recipe."""

    title: str = ""
    seed: Whole = 0
    data: _Data
    input: _Input
    network: Mapping[str, Any]
    loss: Mapping[str, Any]
    optimiser: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class _Data:
    dataset: Any = None
    sequences: Count | None = None


@dataclass(frozen=True, kw_only=True)
class _Input:
    maps: Annotated[str, Named("kind of maps", _MAPS)] = "spectral-maps"
    size: _Side = 224
    frames: _Side = 30
    rate: Annotated[float, Meta(gt=0.0, le=RATE_LIMIT)] = 25.0
    scales: tuple[float, ...] = ()
    mirror: bool = True
    variants: Count = 4
    conditioned: bool = False
    augment: Mapping[Annotated[str, Named("disturbance", DISTURBANCES)], Strength]


def parse(text: str, *, name: str, where: str, folder: Path = Path()) -> TrainingRecipe:
    """Parses a recipe from its text; raises as `load`."""
    form = read(_TrainingTables, parse_recipe(text, where=where), where=where)
    front_end, cropping = _input(form.input, where=f"{where} [input]")
    return TrainingRecipe(
        name=name,
        title=form.title or name,
        seed=form.seed,
        data=_data(form.data, where=f"{where} [data]"),
        front_end=front_end,
        cropping=cropping,
        variants=form.input.variants,
        augment=Augment(strengths=form.input.augment),
        network=_network(form.network, front_end, where=f"{where} [network]"),
        loss=_loss(form.loss, where=f"{where} [loss]"),
        optimiser=_optimiser(form.optimiser, where=f"{where} [optimiser]"),
    )


def _data(data: _Data, *, where: str) -> DataSpec:
    datasets = [data.dataset] if isinstance(data.dataset, str) else data.dataset
    if not isinstance(datasets, list) or not datasets or not all(map(is_name, datasets)):
        raise InputError(
            f"the data set is {data.dataset!r}",
            where=where,
            fix='name one, or several in a list: dataset = "flagsim-wide"',
        )
    return DataSpec(datasets=tuple(datasets), sequences=data.sequences)


def _input(form: _Input, *, where: str) -> tuple[FrontEnd, Cropping]:
    front_end = FrontEnd(
        maps=cast("Maps", form.maps), size=form.size, frames=form.frames, rate=form.rate
    )
    if (values := form.variants * math.prod(front_end.shape)) > FILM_LIMIT:
        raise LimitError(
            f"{form.variants} variants of {math.prod(front_end.shape)} values are {values:.3g} "
            "values of each film",
            where=where,
            fix=f"at most {FILM_LIMIT} are kept: give fewer variants or a smaller size",
        )
    if form.augment and not form.conditioned:
        raise UsageError(
            "films that are not conditioned cannot be disturbed",
            where=f"{where} [augment]",
            fix="write conditioned = true in [input], or leave them out",
        )
    scales = form.scales or Cropping.scales
    return front_end, Cropping(
        frames=form.frames,
        size=form.size,
        scales=scales,
        mirror=form.mirror,
        conditioned=form.conditioned,
    )


def _network(content: Mapping[str, Any], front_end: FrontEnd, *, where: str) -> NetworkSpec:
    name, options = (
        content.get("name"),
        {key: entry for key, entry in content.items() if key != "name"},
    )
    if not isinstance(name, str):
        raise InputError(
            "no name is given", where=where, fix=f"add name, one of {', '.join(NETWORKS)}"
        )
    takes = NETWORKS[name].takes
    if takes != front_end.maps:
        raise UsageError(
            f"the network {name} takes {takes}, not {front_end.maps}",
            where=where,
            fix=f'write maps = "{takes}" in [input]',
        )
    return NetworkSpec(
        name=name, options={key.replace("-", "_"): option for key, option in options.items()}
    )


def _loss(content: Mapping[str, Any], *, where: str) -> LossSpec:
    loss = read(LossSpec, content, where=where)
    if (loss.name is Loss.CONTRASTIVE) == bool(loss.targets):
        raise UsageError(
            "the contrastive loss has no targets, the others have at least one",
            where=where,
            fix='write targets = ["wind_speed"], or leave them out',
        )
    for key, needed in (("components", Loss.POSTERIOR), ("margin", Loss.CONTRASTIVE)):
        if loss.name is not needed and key in content:
            raise UsageError(
                f"{key} has no effect on {loss.name.value}", where=where, fix="leave it out"
            )
    return loss


def _optimiser(content: Mapping[str, Any], *, where: str) -> OptimiserSpec:
    optimiser = read(OptimiserSpec, content, where=where)
    if optimiser.schedule is not Schedule.STEPS and "drop-after" in content:
        raise UsageError(
            f"drop-after has no effect on {optimiser.schedule.value}",
            where=where,
            fix="leave it out",
        )
    return optimiser
