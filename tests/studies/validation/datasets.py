"""A whole data set built twice: without interruption, and killed on the way; compared, loaded, and
tested for leaks.

Takes as long as two builds (`flagdata build flagsim-small --plan`), and twice its size on the disk
meanwhile.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import flagdata
from flagdata.core.rng import stream
from flagdata.core.schema import CATALOG, Kind
from flagdata.dataset import Tolerance
from flagdata.errors import FlagdataError
from flagdata.lake import Lake, doctor, object_names, verify
from flagdata.record import Record
from sim.datasets import DatasetRecipe, load
from tests.sim.datasets.leakage import FEATURES, Surroundings, accuracies, dealt_anew, features_of

RECIPE = "flagsim-small"
KILLS = (0.1, 0.35, 0.7)
"""Shares of all sequences and films at which the second build is killed."""
WORKERS = 2
BATCH = 16
DEALS, TOGETHER = (
    400,
    20,
)  # of the parameters to other sequences, and how many of them are guessed at once
UNEQUAL = ("created", "code_version")
"""Columns that say when a row was committed, and by which commit of the code."""


@dataclass(frozen=True, kw_only=True)
class Built:
    """A lake with the data set, the seconds its last build took, and how many artifacts it had at
    each kill."""

    lake: Path
    seconds: float
    kills: tuple[int, ...]


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Both builds and what is found in them; the recipe has its own seed, and no picture is
    drawn."""
    del seed, out
    with tempfile.TemporaryDirectory(prefix="flagdata-datasets-") as folder:
        unbroken = build(Path(folder) / "unbroken", kills=())
        return evidence(unbroken, build(Path(folder) / "killed", kills=KILLS))


def build(lake: Path, *, kills: Sequence[float]) -> Built:
    """Build the data set in a process of its own, killed with all its workers at these shares of
    the work."""
    recipe = load(RECIPE)
    work = sum(side.sequences + side.renders for side in recipe.sides)
    found: list[int] = []
    for share in kills:
        process = _start(lake)
        while process.poll() is None and artifacts(lake) < share * work:
            time.sleep(0.5)
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        found.append(artifacts(lake))
    begun = time.perf_counter()
    process = _start(lake)
    if process.wait() != 0:
        raise RuntimeError(f"the build of {RECIPE} failed: read its messages above")
    return Built(lake=lake, seconds=time.perf_counter() - begun, kills=tuple(found))


def _start(lake: Path) -> subprocess.Popen[bytes]:
    command = [
        sys.executable,
        "-m",
        "flagdata.cli",
        "build",
        RECIPE,
        "--lake",
        str(lake),
        "--workers",
        str(WORKERS),
    ]
    return subprocess.Popen(command, start_new_session=True)


def artifacts(lake: Path | str) -> int:
    """Counts the sequences and films in the lake; 0 while there is none."""
    with suppress(FlagdataError, OSError):
        return (
            Lake.open(lake).rows("kind in ('meshes', 'recording')", columns=["artifact"]).num_rows
        )
    return 0


def evidence(unbroken: Built, killed: Built) -> dict[str, Any]:
    """All that is found in the two lakes, as JSON."""
    recipe, lake = load(RECIPE), Lake.open(unbroken.lake)
    rows = lake.rows(columns=["kind", "object", "object_bytes"]).to_pylist()
    sizes = {
        row["object"]: row["object_bytes"] or 0 for row in rows
    }  # clips are rows of their recording's object
    return {
        "recipe": recipe.name,
        "recipe_hash": recipe.hash,
        "workers": WORKERS,
        "rows": dict(Counter(row["kind"] for row in rows)),
        "bytes": sum(sizes.values()),
        "seconds_unbroken": unbroken.seconds,
        "seconds_after_last_kill": killed.seconds,
        "artifacts_at_kills": list(killed.kills),
        "comparison": compare(lake, Lake.open(killed.lake)),
        "problems": [finding.kind for finding in doctor(lake) if finding.severity != "note"],
        "loading": loading(unbroken.lake, recipe),
        "leak": leak(lake, recipe),
    }


def compare(one: Lake, other: Lake) -> dict[str, Any]:
    """Row by row and column by column; objects are re-hashed in both, so that equal names are equal
    bytes."""
    first, second = (
        {row["artifact"]: row for row in lake.rows().to_pylist()} for lake in (one, other)
    )
    common = sorted(first.keys() & second.keys())
    columns = [column for column in CATALOG if column not in UNEQUAL]
    different = Counter(
        column for id_ in common for column in columns if first[id_][column] != second[id_][column]
    )
    names = [sorted(object_names(lake)) for lake in (one, other)]
    return {
        "rows": [len(first), len(second)],
        "rows_in_both": len(common),
        "columns": len(columns),
        "columns_left_out": list(UNEQUAL),
        "rows_that_differ_by_column": dict(different),
        "objects": [len(names[0]), len(names[1])],
        "same_objects": names[0] == names[1],
        "objects_missing_or_changed": [
            len(verify(lake, own)) for lake, own in zip((one, other), names, strict=True)
        ],
    }


def loading(lake: Path, recipe: DatasetRecipe) -> dict[str, Any]:
    """The README's lines for real clips, on each side: pairs, refusals, clips a second."""
    found: dict[str, Any] = {}
    for side in recipe.sides:
        sure = Tolerance(clock_sigma=0.5)
        pairs = flagdata.open(lake).pairs(
            {"dataset": recipe.name}, split=side.name, tolerance=sure, seed=0
        )
        begun, clips = time.perf_counter(), 0
        for batch in pairs.loader(BATCH, workers=WORKERS):
            clips += len(batch.wind)
        seconds = time.perf_counter() - begun
        found[side.name] = {
            "pairs": len(pairs),
            "refused": len(pairs.refused),
            "clips": clips,
            "clips_per_second": clips / seconds,
            "clip": list(pairs[0].clip.shape),
        }
    return found


def leak(lake: Lake, recipe: DatasetRecipe) -> dict[str, Any]:
    """How well wind, θ and ζ are guessed from what surrounds the pictures, and how well if they
    were dealt by chance.

    The interval of an accuracy is that of chance: 95 % of deals of the same parameters to other
    sequences. The one test over all parameters compares the best accuracy with the best of each
    deal.
    """
    around = surroundings(lake, recipe)
    targets = [name for name in around.parameters[0] if _drawn(around, name)]
    labels = around.labels(targets)
    rng = stream(recipe.seed, "leak")
    found = accuracies(around.features, labels, around.sequence)
    chances: dict[str, list[np.ndarray]] = {guess: [] for guess in found}
    for _ in range(DEALS // TOGETHER):
        deals = np.concatenate(
            [labels[dealt_anew(around.sequence, rng)] for _ in range(TOGETHER)], axis=1
        )
        for guess, values in accuracies(around.features, deals, around.sequence).items():
            chances[guess].append(values.reshape(TOGETHER, len(targets)))
    result: dict[str, Any] = {
        "films": len(labels),
        "sequences": len(np.unique(around.sequence)),
        "parameters": len(targets),
        "deals": DEALS,
        "different_sizes": _different(around, "size"),
        "different_frame_lengths": _different(around, "mean frame"),
    }
    for guess, values in found.items():
        chance = np.concatenate(chances[guess])
        low, high = np.quantile(chance, [0.025, 0.975], axis=0)
        best = chance.max(axis=1)
        above = [
            name for name, value, most in zip(targets, values, high, strict=True) if value > most
        ]
        result[guess] = {
            "best": float(values.max()),
            "best_of": targets[int(values.argmax())],
            "best_by_chance": np.quantile(best, [0.025, 0.5, 0.975]).tolist(),
            "share_of_deals_with_a_better_best": float((best >= values.max()).mean()),
            "above_their_interval": above,
            "accuracy": {
                name: {"found": float(value), "by_chance": [float(least), float(most)]}
                for name, value, least, most in zip(targets, values, low, high, strict=True)
            },
        }
    return result


def _different(around: Surroundings, feature: str) -> int:
    return len(np.unique(around.features[:, FEATURES.index(feature)]))


def _drawn(around: Surroundings, name: str) -> bool:
    """Whether a parameter is of wind, θ, ζ or anemometer, and drawn. A camera's shows in its JPEGs,
    as it should."""
    return not name.startswith("camera.") and len({film[name] for film in around.parameters}) > 1


def surroundings(lake: Lake, recipe: DatasetRecipe) -> Surroundings:
    """Of all films of a data set, by the catalog; a name among the parameters is 0 or 1 for each
    there is."""
    columns = ["name", "seed", "object", "object_bytes", "parameters"]
    rows = lake.rows({"kind": Kind.RECORDING, "dataset": recipe.name}, columns=columns).to_pylist()
    features = [
        features_of(
            row["name"],
            Record.open(lake.object_path(row["object"])),
            order=order,
            size=row["object_bytes"],
        )
        for order, row in enumerate(rows)
    ]
    drawn = [json.loads(row["parameters"]) for row in rows]
    kinds = sorted(
        {
            (key, _kind(value))
            for film in drawn
            for key, value in film.items()
            if isinstance(value, str)
        }
    )
    return Surroundings(
        features=np.array(features),
        sequence=np.array([row["seed"] for row in rows]),
        parameters=[
            {key: value for key, value in film.items() if not isinstance(value, str)}
            | {f"{key} {kind}": float(_kind(film[key]) == kind) for key, kind in kinds}
            for film in drawn
        ],
    )


def _kind(name: str) -> str:
    """Of a background, which is numbered, its kind: "sky"; of a flag all of it."""
    kind, _, number = name.partition("/")
    return kind if number.isdigit() else name
