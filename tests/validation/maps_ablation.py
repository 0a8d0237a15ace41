"""What each kind of map adds to a network on maps: it is trained without one kind at a time, by three seeds each.

Reads a lake with the data sets of the network's recipe: FLAGDATA_ABLATION_LAKE names its folder,
FLAGDATA_ABLATION_AT the version, FLAGDATA_ABLATION_CACHE a folder with prepared inputs (by default beside the lake),
FLAGDATA_ABLATION_SEQUENCES how many simulations each network learns from (1,000), FLAGDATA_ABLATION_EPOCHS for how many
epochs (12), FLAGDATA_ABLATION_SEEDS how many seeds (3). Without a lake it is left out. The networks are committed on a
branch of that lake, so that an interrupted run goes on. Writes `validate-NAME-ablation.md` beside the JSON.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import flagdata
from flagdata.console import progress
from flagdata.errors import UsageError
from models import estimator as models
from models.evaluation import report
from models.evaluation.evaluation import as_document, evaluate
from models.evaluation.predict import predict, time_a_clip
from models.evaluation.predictions import Predictions
from models.training.command import trained
from models.training.inputs import prepare_clips
from models.training.recipe import DataSpec, TrainingRecipe, load

_TESTED = DataSpec(datasets=("flagsim-wide",))
ALL = "all maps"


@dataclass(frozen=True, kw_only=True)
class Ablation:
    """Attributes:
    name: of the training recipe.
    known: names of the maps that its network sees.
    kinds: kind → beginnings of its maps' names, without what stands before a colon.
    least: label and beginnings of the few maps that one network sees alone.
    """

    name: str
    known: tuple[str, ...]
    kinds: Mapping[str, tuple[str, ...]]
    least: tuple[str, tuple[str, ...]]

    @property
    def branch(self) -> str:
        """Where the networks are committed."""
        return f"{self.name}-ablation"

    def channels(self) -> dict[str, tuple[str, ...]]:
        """Label of each network → the maps it sees."""
        without = {
            f"without {kind}": tuple(name for name in self.known if not _is(name, beginnings))
            for kind, beginnings in self.kinds.items()
        }
        label, beginnings = self.least
        return {ALL: self.known, **without, label: tuple(name for name in self.known if _is(name, beginnings))}

    def recipe(self, label: str, chosen: tuple[str, ...], *, seed: int) -> TrainingRecipe:
        """The recipe on fewer simulations and epochs, with these of its maps."""
        own = load(self.name)
        options = dict(own.network.options) | ({} if label == ALL else {"channels": list(chosen)})
        return replace(
            own, name=f"{self.name}-{label.replace(' ', '-')}", title=f"{self.name}, {label}", seed=seed,
            data=replace(own.data, sequences=int(os.environ.get("FLAGDATA_ABLATION_SEQUENCES", "1000"))),
            network=replace(own.network, options=options),
            optimiser=replace(own.optimiser, epochs=int(os.environ.get("FLAGDATA_ABLATION_EPOCHS", "12"))),
        )  # fmt: skip

    def run(self, *, seed: int, out: Path) -> dict[str, Any]:
        """The table of all networks on the same test clips, and how they differ from the one that sees all maps."""
        ground = Ground.stated(self.branch)
        if ground is None:
            return {"left_out": f"FLAGDATA_ABLATION_LAKE names no lake with the data sets of the recipe {self.name}"}
        told = [
            _predictions(ground, ground.network(self.recipe(label, chosen, seed=number + 1)), label, len(chosen), seed)
            for label, chosen in self.channels().items()
            for number in range(int(os.environ.get("FLAGDATA_ABLATION_SEEDS", "3")))
        ]
        found = evaluate(told, data=f"flagsim-wide, test side, at {ground.at or 'head'}", seed=seed, reference=ALL)
        (out / f"validate-{self.branch}.md").write_text(report.markdown(found), encoding="utf-8")
        return {
            "lake": ground.path.name, "at": ground.at, "recipe": self.recipe(ALL, self.known, seed=1).identity(),
            "maps": {label: len(chosen) for label, chosen in self.channels().items()},
            "evaluation": as_document(found),
        }  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Ground:
    """Where the networks of this comparison learn: a lake, its version, prepared inputs."""

    path: Path
    at: str | None
    cache: Path
    branch: str

    @classmethod
    def stated(cls, branch: str) -> Ground | None:
        """As the environment says; None where it names no lake."""
        lake = os.environ.get("FLAGDATA_ABLATION_LAKE")
        if lake is None:
            return None
        cache = Path(os.environ.get("FLAGDATA_ABLATION_CACHE", f"{lake}.inputs"))
        return cls(path=Path(lake), at=os.environ.get("FLAGDATA_ABLATION_AT"), cache=cache, branch=branch)

    def network(self, recipe: TrainingRecipe) -> models.Estimator:
        """The network of a recipe, trained on a branch of the lake if it was not before."""
        source = flagdata.open(self.path)
        if self.branch not in source.lake.refs.branches():
            source.lake.branch(self.branch, at=self.at)
        report_of = trained(
            recipe, self.path, at=self.at, cache=self.cache, run=None, workers=1, device="cpu",
            branch=self.branch, bars=progress,
        )  # fmt: skip
        if report_of is None:
            raise UsageError("other ranks of a torchrun train here", fix="run the validation in one process")
        return models.load(source.lake.object_path(report_of["object"]))


def _is(name: str, beginnings: tuple[str, ...]) -> bool:
    return name.partition(": ")[2].startswith(beginnings) or name.startswith(beginnings)


def _predictions(ground: Ground, network: models.Estimator, label: str, maps: int, seed: int) -> Predictions:
    split = _TESTED.split("train", "test")
    pairs = flagdata.open(ground.path).pairs(at=ground.at, split="test", split_by=split)
    with progress(len(pairs), "prepare what tests", "clip") as advance:
        clips = prepare_clips(
            pairs, network.front_end, network.cropping, folder=ground.cache, workers=1, advance=advance
        )
    return predict(
        network, clips, label=label, note=f"{maps} maps", seed=seed, milliseconds=time_a_clip(network, pairs)
    )
