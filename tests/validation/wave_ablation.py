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
from dataclasses import replace
from pathlib import Path
from typing import Any

import flagdata
from flagdata.console import progress
from flagdata.dataset import Source
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
_ALL, _FIRST = "all maps", "first peak alone"


def channels() -> dict[str, tuple[str, ...]]:
    """Label of each network → the maps it sees; the last sees what the SDN does."""
    without = {
        f"without {kind}": tuple(name for name in WAVE_CHANNELS if not _is(name, beginnings))
        for kind, beginnings in _KINDS.items()
    }
    first = tuple(name for name in WAVE_CHANNELS if _is(name, ("peak 1",)))
    return {_ALL: WAVE_CHANNELS, **without, _FIRST: first}


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """The table of all networks on the same clips of the test side, and the differences to the one that sees all."""
    lake = os.environ.get("FLAGDATA_ABLATION_LAKE")
    if lake is None:
        return {"left_out": "FLAGDATA_ABLATION_LAKE names no lake with the data sets of the recipe wave"}
    at = os.environ.get("FLAGDATA_ABLATION_AT")
    cache = Path(os.environ.get("FLAGDATA_ABLATION_CACHE", f"{lake}.inputs"))
    source = flagdata.open(Path(lake))
    if BRANCH not in source.lake.refs.branches():
        source.lake.branch(BRANCH, at=at)
    told: list[Predictions] = []
    for label, chosen in channels().items():
        for number in range(int(os.environ.get("FLAGDATA_ABLATION_SEEDS", "3"))):
            recipe = _recipe(label, chosen, seed=number + 1)
            report_of = trained(
                recipe, Path(lake), at=at, cache=cache, run=None, workers=1, device="cpu", branch=BRANCH, bars=progress
            )
            assert report_of is not None  # no torchrun
            told.append(_predictions(source, report_of["object"], label, at=at, cache=cache, seed=seed))
    found = evaluate(told, data=f"flagsim-wide, test side, at {at or 'head'}", seed=seed, reference=_ALL)
    (out / "validate-wave-ablation.md").write_text(report.markdown(found), encoding="utf-8")
    return {
        "lake": Path(lake).name, "at": at, "recipe": _recipe(_ALL, WAVE_CHANNELS, seed=1).identity(),
        "maps": {label: len(chosen) for label, chosen in channels().items()}, "evaluation": as_document(found),
    }  # fmt: skip


def _is(name: str, beginnings: tuple[str, ...]) -> bool:
    return name.partition(": ")[2].startswith(beginnings) or name.startswith(beginnings)


def _recipe(label: str, chosen: tuple[str, ...], *, seed: int) -> TrainingRecipe:
    own = load("wave")
    options = dict(own.network.options) | ({} if label == _ALL else {"channels": list(chosen)})
    return replace(
        own, name=f"wave-{label.replace(' ', '-')}", title=f"wave, {label}", seed=seed,
        data=replace(own.data, sequences=int(os.environ.get("FLAGDATA_ABLATION_SEQUENCES", "1000"))),
        network=replace(own.network, options=options),
        optimiser=replace(own.optimiser, epochs=int(os.environ.get("FLAGDATA_ABLATION_EPOCHS", "12"))),
    )  # fmt: skip


def _predictions(source: Source, obj: str, label: str, *, at: str | None, cache: Path, seed: int) -> Predictions:
    network = models.load(source.lake.object_path(obj))
    split = _TESTED.split("train", "test")
    pairs = source.pairs(at=at, split="test", split_by=split)
    with progress(len(pairs), "prepare what tests", "clip") as advance:
        clips = prepare_clips(pairs, network.front_end, network.cropping, folder=cache, workers=1, advance=advance)
    return predict(
        network, clips, label=label, note=f"{network.learners[0].network.channels} maps", seed=seed,
        milliseconds=time_a_clip(network, pairs),
    )  # fmt: skip
