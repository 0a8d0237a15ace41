"""What each kind of wave map adds to our network: it is trained without one kind at a time, by three seeds each.

Reads a lake with the data sets of the recipe `wave`: FLAGDATA_ABLATION_LAKE names its folder, FLAGDATA_ABLATION_AT the
version, FLAGDATA_ABLATION_CACHE a folder with prepared inputs (by default beside the lake), FLAGDATA_ABLATION_SEQUENCES
how many simulations each network learns from (1,000), FLAGDATA_ABLATION_EPOCHS for how many epochs (12),
FLAGDATA_ABLATION_SEEDS how many seeds (3). Without a lake it is left out. The networks are committed on a branch of
that lake, so that an interrupted run goes on. Writes `validate-wave-ablation.md` beside the JSON.
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
from models.frontend import WAVE_CHANNELS
from models.training.command import trained
from models.training.inputs import prepare_clips
from models.training.recipe import DataSpec, TrainingRecipe, load

BRANCH = "wave-ablation"
_TESTED = DataSpec(datasets=("flagsim-wide",))
_KINDS: Mapping[str, tuple[str, ...]] = {
    "second peak": ("peak 2",),
    "shape of the spectrum": ("log power", "centre", "width", "band"),
    "phase gradient": ("phase gradient", "coherence"),
    "picture at rest": ("mean picture", "log of its slope", "log standard deviation"),
}
"""Kind → beginnings of its maps' names, without the derivative that they are of."""
ALL, _FIRST = "all maps", "first peak alone"


def channels() -> dict[str, tuple[str, ...]]:
    """Label of each network → the maps it sees; the last sees what the SDN does."""
    without = {
        f"without {kind}": tuple(name for name in WAVE_CHANNELS if not _is(name, beginnings))
        for kind, beginnings in _KINDS.items()
    }
    first = tuple(name for name in WAVE_CHANNELS if _is(name, ("peak 1",)))
    return {ALL: WAVE_CHANNELS, **without, _FIRST: first}


@dataclass(frozen=True, kw_only=True)
class Ground:
    """Where the networks of this comparison learn: a lake, its version, prepared inputs."""

    path: Path
    at: str | None
    cache: Path

    @classmethod
    def stated(cls) -> Ground | None:
        """As the environment says; None where it names no lake."""
        lake = os.environ.get("FLAGDATA_ABLATION_LAKE")
        if lake is None:
            return None
        cache = Path(os.environ.get("FLAGDATA_ABLATION_CACHE", f"{lake}.inputs"))
        return cls(path=Path(lake), at=os.environ.get("FLAGDATA_ABLATION_AT"), cache=cache)

    def network(self, recipe: TrainingRecipe) -> models.Estimator:
        """The network of a recipe, trained on a branch of the lake if it was not before."""
        source = flagdata.open(self.path)
        if BRANCH not in source.lake.refs.branches():
            source.lake.branch(BRANCH, at=self.at)
        report_of = trained(
            recipe, self.path, at=self.at, cache=self.cache, run=None, workers=1, device="cpu", branch=BRANCH,
            bars=progress,
        )  # fmt: skip
        if report_of is None:
            raise UsageError("other ranks of a torchrun train here", fix="run the validation in one process")
        return models.load(source.lake.object_path(report_of["object"]))


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """The table of all networks on the same clips of the test side, and the differences to the one that sees all."""
    ground = Ground.stated()
    if ground is None:
        return {"left_out": "FLAGDATA_ABLATION_LAKE names no lake with the data sets of the recipe wave"}
    told = [
        _predictions(ground, ground.network(recipe(label, chosen, seed=number + 1)), label, len(chosen), seed=seed)
        for label, chosen in channels().items()
        for number in range(int(os.environ.get("FLAGDATA_ABLATION_SEEDS", "3")))
    ]
    found = evaluate(told, data=f"flagsim-wide, test side, at {ground.at or 'head'}", seed=seed, reference=ALL)
    (out / "validate-wave-ablation.md").write_text(report.markdown(found), encoding="utf-8")
    return {
        "lake": ground.path.name, "at": ground.at, "recipe": recipe(ALL, WAVE_CHANNELS, seed=1).identity(),
        "maps": {label: len(chosen) for label, chosen in channels().items()}, "evaluation": as_document(found),
    }  # fmt: skip


def _is(name: str, beginnings: tuple[str, ...]) -> bool:
    return name.partition(": ")[2].startswith(beginnings) or name.startswith(beginnings)


def recipe(label: str, chosen: tuple[str, ...], *, seed: int) -> TrainingRecipe:
    """The recipe `wave` on fewer simulations and epochs, with these of its maps."""
    own = load("wave")
    options = dict(own.network.options) | ({} if label == ALL else {"channels": list(chosen)})
    return replace(
        own, name=f"wave-{label.replace(' ', '-')}", title=f"wave, {label}", seed=seed,
        data=replace(own.data, sequences=int(os.environ.get("FLAGDATA_ABLATION_SEQUENCES", "1000"))),
        network=replace(own.network, options=options),
        optimiser=replace(own.optimiser, epochs=int(os.environ.get("FLAGDATA_ABLATION_EPOCHS", "12"))),
    )  # fmt: skip


def _predictions(ground: Ground, network: models.Estimator, label: str, maps: int, *, seed: int) -> Predictions:
    split = _TESTED.split("train", "test")
    pairs = flagdata.open(ground.path).pairs(at=ground.at, split="test", split_by=split)
    with progress(len(pairs), "prepare what tests", "clip") as advance:
        clips = prepare_clips(
            pairs, network.front_end, network.cropping, folder=ground.cache, workers=1, advance=advance
        )
    return predict(
        network, clips, label=label, note=f"{maps} maps", seed=seed, milliseconds=time_a_clip(network, pairs)
    )
