"""What is trained on what, as TOML. Parsed here and nowhere else; unknown keys are refused, the nearest is named.

title, seed
[data]       dataset: a data set's name, or a list of them; sequences: of the training side, all by default
[input]      maps: "frames", "spectral-maps", "wave-maps", "flow-maps" or "flow-maps-3"; size [px], frames; scales,
             mirror: of crops; variants: crops of each film that are prepared; conditioned = true: films are made fit as
             `flagdata measure` does it, at the network's instants
[input.augment.NAME]  of conditioned films, NAME of `models.training.augment.DISTURBANCES`: share (of the films), low,
             high
[network]    name: of `models.registry.NETWORKS`; its other keys are the network's own
[loss]       name: "regression", "posterior" or "contrastive"; targets: of `models.targets`; components, margin
[optimiser]  rate, decay, batch, epochs; schedule: "steps" or "cosine"; drop-after: epochs; clip-norm; precision:
             "float32" or "bfloat16"; patience: epochs without a better validation loss, after which it ends
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import Any, cast

import torch

from flagdata.dataset.splits import ExplicitSplit
from flagdata.errors import InputError, LimitError, UnknownNameError, UsageError
from flagdata.lake import Lake
from flagdata.lake.matching import Values
from flagdata.provenance import recipe_hash
from flagdata.recipes import Shelf, is_name, parsed
from flagdata.schema import Kind
from flagdata.tables import COUNT, Bounds, Table
from models.conditioning.conditioning import VERSION
from models.crops import Cropping
from models.frontend import RATE_LIMIT, FrontEnd, Maps
from models.learner import NUMBER_LIMIT, Learner, Loss, build
from models.registry import NETWORKS
from models.targets import TARGETS
from models.training.augment import DISTURBANCES, Augment, Strength

TRAININGS = Shelf(folder="training", noun="training recipe")
RECIPE_VERSION = 1
"""Raised whenever the same recipe and data give other weights."""
FILM_LIMIT = 1 << 28
"""Most values that are prepared of a film: 512 MiB of maps."""
_LARGEST_STEP = 10.0
"""Largest learning rate and weight decay; the catalog's are of 10⁻³ and 10⁻⁴."""
_MAPS: tuple[Maps, ...] = ("frames", "spectral-maps", "wave-maps", "flow-maps", "flow-maps-3")


class Schedule(StrEnum):
    """How the learning rate falls."""

    STEPS = "steps"
    """To a tenth after so many epochs, as the paper's."""
    COSINE = "cosine"
    """From a twentieth up to the full rate within the first twentieth of the steps, then down as a cosine."""


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
        """What `identity` was made of, as a model's card keeps it."""
        named = entry["dataset"]
        return cls(datasets=(named,) if isinstance(named, str) else tuple(named), sequences=entry["sequences"])

    def where(self, side: str) -> Values:
        """What rows of the catalog that are of a side have in their columns."""
        return {"dataset": self.datasets, "side": side}

    def split(self, *sides: str) -> ExplicitSplit:
        """These sides of the data sets, by which pairs are read."""
        return ExplicitSplit(where={side: self.where(side) for side in sides})

    def check(self, lake: Lake, *, at: str | None) -> None:
        """Make sure that a lake has all of these data sets.

        Raises:
            UnknownNameError: one that it has not; the nearest is named.
        """
        known = set(lake.rows({"kind": Kind.CLIP}, at=at, columns=["dataset"])["dataset"].drop_null().to_pylist())
        for dataset in self.datasets:
            if dataset not in known:
                raise UnknownNameError.of("data set", dataset, known, where=str(lake.path))

    def identity(self) -> dict[str, Any]:
        """JSON values; one data set is named by itself."""
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
    name: see `models.learner.Loss`.
    targets: what the network estimates; none for the contrastive loss.
    components: of the mixture.
    margin: of the contrastive loss.
    """

    name: Loss
    targets: tuple[str, ...] = ()
    components: int = 6
    margin: float = 1.0


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

    rate: float = 1e-2
    decay: float = 2e-3
    batch: int = 32
    epochs: int = 40
    schedule: Schedule = Schedule.STEPS
    drop_after: int = 20
    clip_norm: float | None = None
    precision: Precision = Precision.FLOAT32
    patience: int = 10


@dataclass(frozen=True, kw_only=True)
class TrainingRecipe:
    """A training.

    Attributes:
        name: what its model is called.
        title: one line for people.
        seed: of initial weights, crops and orders.
        data, input, network, loss, optimiser: the tables above.
        variants: crops of each film that are prepared; an epoch takes one of them, the next the next.
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
        """All that shapes the weights beside the data themselves, as JSON."""
        return {
            "training": RECIPE_VERSION,
            "seed": self.seed,
            "data": self.data.identity(),
            "front_end": asdict(self.front_end),
            "cropping": self.cropping.as_dict(),
            "variants": self.variants,
            **({"augment": self.augment.identity(), "conditioning": VERSION} if self.cropping.conditioned else {}),
            "network": {"name": self.network.name, "options": dict(self.network.options)},
            "loss": asdict(self.loss),
            "optimiser": asdict(self.optimiser),
        }

    def learner(self) -> Learner:
        """The network with its head, its weights drawn by torch's generator as it stands.

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
        """Make sure that the network takes what the front end gives, by shapes alone, before anything is prepared.

        Raises:
            InputError: options or clips that the network does not take.
        """
        try:
            with torch.no_grad(), torch.device("meta"):
                self.learner().network(torch.empty(2, *self.front_end.shape))
        except RuntimeError as error:
            shape = "×".join(map(str, self.front_end.shape))
            raise InputError(
                f"the network {self.network.name} does not take {shape} {self.front_end.maps}: {error}",
                where="[network]",
                fix="give it smaller strides, or larger clips",
            ) from None

    @cached_property
    def hash(self) -> str:
        """SHA-256 of the identity."""
        return recipe_hash(self.identity())


def load(source: str) -> TrainingRecipe:
    """The training recipe of that name in the catalog, or of a `.toml` file.

    Raises:
        NotFoundError: no such file.
        UnknownNameError: no such recipe; a key, name or option that is not known.
        InputError, UsageError: a value that does not fit.
    """
    found = TRAININGS.find(source)
    return parse(found.text, name=found.name, where=found.where, folder=found.folder)


def parse(text: str, *, name: str, where: str, folder: Path = Path()) -> TrainingRecipe:
    """A recipe from its text; raises as `load`."""
    top = Table(parsed(text, where=where), where=where)
    front_end, cropping, variants, augment = _input(top.table("input"))
    recipe = TrainingRecipe(
        name=name,
        title=top.text("title", name) or name,
        seed=top.whole("seed", 0, least=0),
        data=_data(top.table("data")),
        front_end=front_end,
        cropping=cropping,
        variants=variants,
        augment=augment,
        network=_network(top.table("network"), front_end),
        loss=_loss(top.table("loss")),
        optimiser=_optimiser(top.table("optimiser")),
    )
    top.done()
    return recipe


def _data(table: Table) -> DataSpec:
    named = table.value("dataset")
    datasets = [named] if isinstance(named, str) else named
    if not isinstance(datasets, list) or not datasets or not all(is_name(dataset) for dataset in datasets):
        raise InputError(
            f"the data set is {named!r}",
            where=table.where,
            fix='name one, or several in a list: dataset = "flagsim-wide"',
        )
    sequences = table.whole("sequences", 1, least=1) if "sequences" in table else None
    table.done()
    return DataSpec(datasets=tuple(datasets), sequences=sequences)


def _input(table: Table) -> tuple[FrontEnd, Cropping, int, Augment]:
    maps = cast("Maps", table.named("maps", "spectral-maps", _MAPS, noun="kind of maps"))
    size, frames = table.whole("size", 224, least=4), table.whole("frames", 30, least=4)
    front_end = FrontEnd(
        maps=maps, size=size, frames=frames, rate=table.number("rate", 25.0, above=0.0, most=RATE_LIMIT)
    )
    scales = table.numbers("scales") or Cropping.scales
    mirror = table.flag("mirror") if "mirror" in table else True
    variants = table.whole("variants", 4, least=1)
    if (values := variants * math.prod(front_end.shape)) > FILM_LIMIT:
        raise LimitError(
            f"{variants} variants of {math.prod(front_end.shape)} values are {values:.3g} values of each film",
            where=table.where,
            fix=f"at most {FILM_LIMIT} are kept: give fewer variants or a smaller size",
        )
    conditioned = table.flag("conditioned")
    augment = _augment(table.table("augment"))
    if augment.strengths and not conditioned:
        raise UsageError(
            "disturbances of films that are not conditioned",
            where=f"{table.where} [augment]",
            fix="write conditioned = true in [input], or leave them out",
        )
    table.done()
    cropping = Cropping(frames=frames, size=size, scales=scales, mirror=mirror, conditioned=conditioned)
    return front_end, cropping, variants, augment


def _augment(table: Table) -> Augment:
    strengths = {}
    for name in table.names():
        if name not in DISTURBANCES:
            raise UnknownNameError.of("disturbance", name, DISTURBANCES, where=table.where)
        strengths[name] = table.table(name).record(Strength)
    table.done()
    return Augment(strengths=strengths)


def _network(table: Table, front_end: FrontEnd) -> NetworkSpec:
    name = table.text("name", None)
    if name is None:
        raise InputError("no network is named", where=table.where, fix=f"add name, one of {', '.join(NETWORKS)}")
    takes = NETWORKS[name].takes
    if takes != front_end.maps:
        raise UsageError(
            f"the network {name} takes {takes}, not {front_end.maps}",
            where=table.where,
            fix=f'write maps = "{takes}" in [input]',
        )
    options = {
        key.replace("-", "_"): value
        for key, value in ((key, table.value(key)) for key in table.names() if key != "name")
    }
    return NetworkSpec(name=name, options=options)


def _loss(table: Table) -> LossSpec:
    name = table.choice("name", Loss.REGRESSION)
    targets = table.texts("targets")
    for target in targets:
        if target not in TARGETS:
            raise UnknownNameError.of("target", target, TARGETS, where=table.where)
    if (name is Loss.CONTRASTIVE) == bool(targets):
        raise UsageError(
            "the contrastive loss has no targets, the others have at least one",
            where=table.where,
            fix='write targets = ["wind_speed"], or leave them out',
        )
    if name is not Loss.POSTERIOR and "components" in table:
        raise UsageError(f"components have no effect on {name.value}", where=table.where, fix="leave them out")
    if name is not Loss.CONTRASTIVE and "margin" in table:
        raise UsageError(f"a margin has no effect on {name.value}", where=table.where, fix="leave it out")
    return table.record(
        LossSpec,
        {"name": lambda: name, "targets": lambda: targets},
        components=COUNT,
        margin=Bounds(above=0.0, most=NUMBER_LIMIT),
    )


def _optimiser(table: Table) -> OptimiserSpec:
    schedule = table.choice("schedule", Schedule.STEPS)
    if schedule is not Schedule.STEPS and "drop-after" in table:
        raise UsageError(f"drop-after says nothing of {schedule.value}", where=table.where, fix="leave it out")
    return table.record(
        OptimiserSpec,
        rate=Bounds(above=0.0, most=_LARGEST_STEP),
        decay=Bounds(least=0.0, most=_LARGEST_STEP),
        batch=Bounds(least=2),
        epochs=COUNT,
        drop_after=COUNT,
        patience=COUNT,
        clip_norm=Bounds(above=0.0, most=NUMBER_LIMIT),
    )
