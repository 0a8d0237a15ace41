"""Hostile models, checkpoints and banks of nulls: damaged files, other values in cards, tensors
that do not fit."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import torch
import torch._dynamo  # which the first step of an optimiser loads
from hypothesis import strategies as st

from flagdata.core.files.checksums import write_sums
from measure.nulls import bank
from models.maps.crops import Cropping
from models.maps.frontend import FrontEnd
from models.networks.learner import Learner, Loss, build
from models.trained import estimator
from models.trained.estimator import CLOUD
from models.trained.model_folder import CARD, WEIGHTS, write_card, write_tensors
from models.trained.outliers import Familiarity
from models.training import checkpoint
from models.training.progress import LossCourse
from tests.damage import damaged, damages, edited, edits
from tests.studies.hostile.campaign import Subject

OPTIONS = {"dimension": 4, "widths": [4, 4, 4]}
WORDS: Any = {
    "name": "small",
    "seed": 1,
    "members": 1,
    "widening": [1.0],
    "front_end": asdict(FrontEnd(maps="wave-maps", size=24, frames=12)),
    "cropping": asdict(Cropping(frames=12, size=24)),
    "recipe": {
        "network": {"name": "wave", "options": OPTIONS},
        "loss": {"name": "posterior", "targets": ["wind_speed"], "components": 2, "margin": 1.0},
        "data": {"dataset": "made", "sequences": None},
    },
}
IDENTITY = {"recipe": "small"}


def small_learner() -> Learner:
    return build(
        "wave", OPTIONS, loss=Loss.POSTERIOR, targets=("wind_speed",), components=2, margin=1.0
    )


def write_model(folder: Path) -> None:
    """A model of one member and its cloud, without checksums."""
    folder.mkdir()
    write_card(folder, WORDS)
    write_tensors(
        folder / WEIGHTS,
        {f"0.{name}": value for name, value in small_learner().state_dict().items()},
    )
    cloud = Familiarity(centre=np.zeros(4), whitening=np.eye(4), reference=np.array([1.0, 2.0]))
    write_tensors(
        folder / CLOUD, {name: torch.from_numpy(value) for name, value in cloud.arrays().items()}
    )


def standing() -> checkpoint.Standing:
    """A training that has not begun."""
    learner = small_learner()
    return checkpoint.Standing(
        learner=learner,
        best=None,
        optimiser=torch.optim.Adam(learner.parameters()),
        course=LossCourse(),
        batches={},
    )


def write_checkpoint(folder: Path) -> None:
    """A checkpoint after one step."""
    taken = standing()
    sum(parameter.sum() for parameter in taken.learner.parameters()).backward()  # type: ignore[union-attr]
    taken.optimiser.step()
    taken.best = copy.deepcopy(taken.learner.state_dict())
    checkpoint.save(folder, taken, identity=IDENTITY)


def arrays() -> dict[str, np.ndarray]:
    """The arrays of a batch of two segments, by their names; of other columns than this
    version's."""
    rows = np.zeros((2, 3))
    return {
        **dict.fromkeys(bank._SEGMENTS, rows),
        "recording": np.arange(2),
        "columns": np.array(["a", "b"]),
        "cloth": np.array(["x", "y"]),
        "duration": np.array(1.0),
        "anchors_told": np.array(True),
        "carried": np.array(False),
        "version": np.array(bank._VERSION),
    }


SHAPES = st.sampled_from([(), (0,), (1,), (4,), (4, 4), (1, 0), (2, 2, 2), (4096,)])
TYPES = st.sampled_from(
    [torch.float16, torch.float64, torch.int64, torch.bool, torch.uint8, torch.complex64]
)
FILLS = st.sampled_from([0.0, -1.0, 1e30, float("nan")])
retensored = st.lists(
    st.tuples(
        st.floats(0, 1, exclude_max=True),
        st.sampled_from(("put", "drop", "add")),
        SHAPES,
        TYPES,
        FILLS,
    ),
    min_size=1,
    max_size=3,
)
"""Tensors of a file, each by its place, of another shape and type."""


def _retensor(path: Path, changes: list[Any]) -> None:
    from safetensors.torch import load, save

    tensors = load(path.read_bytes())
    for place, kind, shape, of_type, fill in changes:
        if tensors:
            name = sorted(tensors)[int(place * len(tensors))]
            if kind == "drop":
                del tensors[name]
            else:
                whole = of_type not in (torch.float16, torch.float64, torch.complex64)
                value = torch.full(
                    shape, 0.0 if whole or (fill == 1e30 and of_type == torch.float16) else fill
                )
                tensors["9.x" if kind == "add" else name] = value.to(of_type)
    path.write_bytes(save(tensors))


def _bytes(path: Path, damage: Any) -> None:
    path.write_bytes(damaged(path.read_bytes(), damage))


def _card(path: Path, edit: Any) -> None:
    content = json.loads(path.read_text())
    path.write_text(json.dumps(edited(content, edit)))


def _estimated(folder: Path) -> None:
    """What the model says of two small films."""
    model = estimator.load(folder)
    clips = np.random.default_rng(0).integers(
        0, 255, (2, model.front_end.frames, 30, 40), dtype=np.uint8
    )
    made = model.estimate(model.inputs(clips), draws=20)
    made.interval(0.9)


def _restored(folder: Path) -> None:
    checkpoint.restore(folder, standing(), identity=IDENTITY)


def _model(
    name: str, examples: st.SearchStrategy[Any], file: str, change: Callable[[Path, Any], None]
) -> Subject:
    def act(example: Any, folder: Path) -> None:
        write_model(folder / "small")
        change(folder / "small" / file, example)
        write_sums(folder / "small")
        _estimated(folder / "small")

    return Subject(name=name, examples=examples, act=act)


def _checkpoint(
    name: str, examples: st.SearchStrategy[Any], file: str, change: Callable[[Path, Any], None]
) -> Subject:
    def act(example: Any, folder: Path) -> None:
        write_checkpoint(folder / "run")
        change(folder / "run" / "last" / file, example)
        write_sums(folder / "run" / "last")
        _restored(folder / "run")

    return Subject(name=name, examples=examples, act=act)


def _unsigned(example: Any, folder: Path) -> None:
    """Damage beside checksums that still state what was."""
    (model, place), damage = example
    target = folder / "made"
    if model:
        write_model(target)
        write_sums(target)
    else:
        write_checkpoint(target)
    files = sorted(path for path in target.rglob("*") if path.is_file())
    _bytes(files[int(place * len(files))], damage)
    _estimated(target) if model else _restored(target)


def _bank(example: Any, folder: Path) -> None:
    path = folder / "nulls-0000.npz"
    np.savez_compressed(path, **arrays())  # type: ignore[arg-type]
    _bytes(path, example)
    bank._content(path)


def subjects() -> list[Subject]:
    """All that a training or a simulation leaves for later."""
    share = st.floats(0, 1, exclude_max=True)
    return [
        _model("card", edits, CARD, _card),
        _model("card's bytes", damages, CARD, _bytes),
        _model("weights", retensored, WEIGHTS, _retensor),
        _model("weights' bytes", damages, WEIGHTS, _bytes),
        _model("cloud", retensored, CLOUD, _retensor),
        _checkpoint("checkpoint's card", edits, CARD, _card),
        _checkpoint("checkpoint's weights", retensored, WEIGHTS, _retensor),
        _checkpoint("checkpoint's moments", retensored, "moments.safetensors", _retensor),
        _checkpoint("checkpoint's best", retensored, "best.safetensors", _retensor),
        Subject(
            name="bytes beside checksums",
            examples=st.tuples(st.tuples(st.booleans(), share), damages),
            act=_unsigned,
        ),
        Subject(name="bank of nulls", examples=damages, act=_bank),
    ]
